"""One Prefect server for all tests of a worker that need one and are not about its start. Fixture: ``prefect_server``.

As a user's own server, which ``PREFECT_API_URL`` names: loading one takes each command 4 s of a core, and a fresh
database more. That a run starts a server of its own is what test_project_walks and test_flows_refine_dataset show.
"""

import os
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

from flows.server.server import temporary_server
from tests.processes import wait_until

LIMIT_S = 900.0


@pytest.fixture(scope="session")
def prefect_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a server on a database of its own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PREFECT_HOME", str(tmp_path_factory.mktemp("prefect")))
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
