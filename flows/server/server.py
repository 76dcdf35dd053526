"""Prefect's settings where the user has made none, and a temporary Prefect server for the time of a run.

Imports nothing of Prefect, which reads its settings when it is imported, and loads while the server does.

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

from asset2sim.models.gateway.environment import checkout_folder, quiet_environment
from flows.server.serving import prefect_home

SERVER_STOP_LIMIT_S = 2.0
"""Time that the server gets to end by itself, s: all is in its database by then, and ending takes it 3 to 20."""
LOG = "api_server.log"

STATE_FOLDER = ".prefect"

# Every exception of a flow reaches its caller, who reports it; Prefect would print a traceback of its own besides.
PREFECT_DEFAULTS = {"PREFECT_LOGGING_LEVEL": "CRITICAL"}
SERVER_DEFAULTS = {"PREFECT_API_BLOCKS_REGISTER_ON_START": "false"}


def prepare_environment() -> None:
    """Set what is not set yet: a quiet Prefect that stays off the network and keeps its state in the checkout."""
    quiet_environment()
    for name, value in PREFECT_DEFAULTS.items():
        os.environ.setdefault(name, value)
    checkout = checkout_folder()
    if checkout is not None and os.access(checkout, os.W_OK):
        os.environ.setdefault("PREFECT_HOME", str(checkout / STATE_FOLDER))


@contextmanager
def temporary_server(*, schedules: bool = False) -> Iterator[str | None]:
    """The address of a server that loads while the block begins, or None where the user has configured one.
    ``schedules`` asks for the services that start scheduled runs. Connect with ``flows.server.client.use_server``."""
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
    program, fd, env = Path(__file__).with_name("api_server.py"), listener.fileno(), {**SERVER_DEFAULTS, **os.environ}
    words, pipe = [sys.executable, "-P", str(program), str(fd), services], subprocess.PIPE
    return subprocess.Popen(words, stdin=pipe, stdout=log, stderr=log, pass_fds=[fd], start_new_session=True, env=env)


def _stop(server: subprocess.Popen[bytes]) -> None:
    if server.stdin is not None:
        server.stdin.close()
    try:
        server.wait(timeout=SERVER_STOP_LIMIT_S)
    except subprocess.TimeoutExpired:
        server.kill()
        server.wait()
