"""A temporary Prefect server for the time of a run. Imports nothing of Prefect, so that the server loads while
Prefect does.

Prefect would start one itself, but in the terminal's process group, where Ctrl-C ends it under the run that needs it:
the run then waits minutes for it. This one has a session of its own, and ends when the run does, however that ends.
"""

import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from flows.server.serving import prefect_home

STOP_LIMIT_S = 2.0
"""Time that the server gets to end by itself, s: all is in its database by then, and ending takes it 3 to 20."""
LOG = "api_server.log"

DEFAULTS = {"PREFECT_API_BLOCKS_REGISTER_ON_START": "false"}


@contextmanager
def temporary_server(*, schedules: bool = False) -> Iterator[str | None]:
    """The address of a server that loads while the block begins, or None where the user has configured one.

    ``schedules`` asks for the services that start scheduled runs. Connect with ``flows.server.client.use_server``.
    """
    home = prefect_home()
    if "PREFECT_API_URL" in os.environ or (home / "profiles.toml").exists():
        yield None
        return
    home.mkdir(parents=True, exist_ok=True)
    with socket.create_server(("127.0.0.1", 0)) as listener, (home / LOG).open("wb") as log:
        port = listener.getsockname()[1]
        server = _start(listener, log.fileno(), "all" if schedules else "few")
    try:
        yield f"http://127.0.0.1:{port}/api"
    finally:
        _stop(server)


def _start(listener: socket.socket, log: int, services: str) -> subprocess.Popen[bytes]:
    program = Path(__file__).with_name("api_server.py")
    return subprocess.Popen(
        [sys.executable, "-P", str(program), str(listener.fileno()), services],
        stdin=subprocess.PIPE,
        stdout=log,
        stderr=log,
        pass_fds=[listener.fileno()],
        start_new_session=True,
        env={**DEFAULTS, **os.environ},
    )


def _stop(server: subprocess.Popen[bytes]) -> None:
    if server.stdin is not None:
        server.stdin.close()
    try:
        server.wait(timeout=STOP_LIMIT_S)
    except subprocess.TimeoutExpired:
        server.kill()
        server.wait()
