"""One Prefect server for all tests of all workers that need one and are not about its start. Fixture:
``prefect_server``.

As a user's own server, which ``PREFECT_API_URL`` names: loading one takes 6 s of a core, a fresh database as much, and
an idle one 1 % of it. That a run starts a server of its own, on a database that it makes, is what test_project_walks
shows.
"""

import os
import shutil
import socket
import sqlite3
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import IO

import pytest

import flows.server.server
from tests.of_all import folder_of_all, one_of_all
from tests.processes import wait_until

LIMIT_S = 900.0
DATABASE, TABLES = "prefect.db", "tables.db"
PROGRAM = Path(flows.server.server.__file__).with_name("api_server.py")


@pytest.fixture(scope="session")
def prefect_server_home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the server's database and log."""
    return folder_of_all(tmp_path_factory, "prefect-of-all")


@pytest.fixture(scope="session")
def prefect_server(prefect_server_home: Path) -> Iterator[str]:
    """The server's address."""
    with one_of_all(prefect_server_home, lambda alive: started(prefect_server_home, alive), answers) as address:
        yield address


def started(home: Path, alive: IO[bytes]) -> str:
    """The address of a new server, once it answers; its tables are kept as they are then."""
    named = {name: value for name, value in os.environ.items() if name != "PREFECT_API_URL"}
    environment = {**flows.server.server.SERVER_DEFAULTS, **named, "PREFECT_HOME": str(home)}
    with socket.create_server(("127.0.0.1", 0)) as listener, (home / "log").open("wb") as log:
        fd, port = listener.fileno(), listener.getsockname()[1]
        subprocess.Popen(
            [sys.executable, "-P", str(PROGRAM), str(fd), "few"], stdin=alive, stdout=log, stderr=log,
            pass_fds=[fd], start_new_session=True, env=environment,
        )  # fmt: skip
    url = f"http://127.0.0.1:{port}/api"
    assert wait_until(lambda: answers(url), LIMIT_S), (home / "log").read_text(encoding="utf-8")
    with closing(sqlite3.connect(home / DATABASE)) as made, closing(sqlite3.connect(home / TABLES)) as kept:
        made.backup(kept)
    return url


@pytest.fixture(scope="session")
def prefect_tables(prefect_server: str, prefect_server_home: Path) -> Path:
    """A database with the tables of Prefect's server and no more, for ``with_tables``."""
    return prefect_server_home / TABLES


def with_tables(home: Path, tables: Path) -> Path:
    """A folder of Prefect's as an earlier run has left it: with the tables, and nothing in them."""
    home.mkdir(parents=True, exist_ok=True)
    shutil.copy(tables, home / DATABASE)
    return home


def answers(address: str) -> bool:
    try:
        with urllib.request.urlopen(f"{address}/health", timeout=10.0):
            return True
    except OSError:
        return False


def using(address: str, home: Path) -> dict[str, str]:
    """The environment of a command that uses the server and keeps what else Prefect writes in ``home``."""
    return {**os.environ, "PREFECT_API_URL": address, "PREFECT_HOME": str(home)}


@contextmanager
def in_use(address: str) -> Iterator[None]:
    """This process as a client of the server, as where the user's own environment names it."""
    from prefect.settings import PREFECT_API_URL, temporary_settings

    with pytest.MonkeyPatch.context() as patch, temporary_settings({PREFECT_API_URL: address}):
        patch.setenv("PREFECT_API_URL", address)
        yield
