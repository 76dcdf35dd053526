"""One Prefect server for all tests of a worker that need one and are not about its start. Fixture: ``prefect_server``.

As a user's own server, which ``PREFECT_API_URL`` names: loading one takes each command 4 s of a core, and a fresh
database as much again. That a run starts a server of its own, on a database that it makes, is what test_project_walks
shows.
"""

import os
import shutil
import sqlite3
import urllib.request
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path

import pytest
from filelock import FileLock

from flows.server.server import temporary_server
from tests.processes import wait_until

LIMIT_S = 900.0
DATABASE = "prefect.db"


@pytest.fixture(scope="session")
def prefect_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a server on a database of its own, whose tables one worker makes for all."""
    home, tables = tmp_path_factory.mktemp("prefect"), _tables(tmp_path_factory)
    with ExitStack() as stack:
        with FileLock(f"{tables}.lock"):
            there = tables.exists()
            if not there:
                address = stack.enter_context(_running(home))
                with closing(sqlite3.connect(home / DATABASE)) as made, closing(sqlite3.connect(tables)) as kept:
                    made.backup(kept)
        if there:
            shutil.copy(tables, home / DATABASE)
            address = stack.enter_context(_running(home))
        yield address


@pytest.fixture(scope="session")
def prefect_tables(prefect_server: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database with the tables of Prefect's server, for ``with_tables``."""
    return _tables(tmp_path_factory)


def with_tables(home: Path, tables: Path) -> Path:
    """A folder of Prefect's as an earlier run has left it: with the tables, and nothing in them."""
    home.mkdir(parents=True, exist_ok=True)
    shutil.copy(tables, home / DATABASE)
    return home


def _tables(tmp_path_factory: pytest.TempPathFactory) -> Path:
    base = tmp_path_factory.getbasetemp()
    return (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "prefect-tables.db"


@contextmanager
def _running(home: Path) -> Iterator[str]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PREFECT_HOME", str(home))
        patch.delenv("PREFECT_API_URL", raising=False)
        with temporary_server() as address:
            patch.undo()
            assert address is not None and wait_until(lambda: answers(address), LIMIT_S)
            yield address


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
