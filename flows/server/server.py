"""Prefect's settings where the user has made none, a temporary Prefect server for the time of a run, and nightlies that
are served on this machine: a locked file each in Prefect's folder, which does not count once its process has ended.

Imports nothing of Prefect, which reads its settings when it is imported, and loads while the server does.

Prefect would start one itself, but in the terminal's process group, where Ctrl-C ends it under the run that needs it:
the run then waits minutes for it. This one has a session of its own, and ends when the run does, however that ends.
"""

import fcntl
import hashlib
import json
import os
import re
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

from asset2sim.models.gateway.environment import checkout_folder, quiet_environment
from asset2sim.storage.objects import cache_root
from schemas.errors import UsageError
from schemas.location import Location

FLOW = "nightly"
FOLDER = "nightlies"
STOP_LIMIT_S = 60.0
"""Time that a stopped night gets to publish what it has, s: 10 to 15 are usual, Prefect's runner waits 30."""
DIGITS = 8
"""Hexadecimal digits that tell two folders of one name apart."""


@dataclass(frozen=True)
class Serving:
    """A nightly that is being served; ``address`` is None where the user's own configuration names the server."""

    process: int
    address: str | None


def deployment_name(out: Path | str) -> str:
    """The deployment's name for an output, a folder or a URL: no other dataset on the server may take its place."""
    place = os.fsencode(Location(out).absolute())
    name = os.fsdecode(place.rpartition(b"/")[2])
    word = re.sub(r"[^A-Za-z0-9]+", "-", name).strip("-").lower() or "out"
    return f"{word}-{hashlib.sha256(place).hexdigest()[:DIGITS]}"


def prefect_home() -> Path:
    """Prefect's folder."""
    return Path(os.environ.get("PREFECT_HOME", "~/.prefect")).expanduser()


@contextmanager
def serving(out: Path | str, address: str | None) -> Iterator[None]:
    """Note that this process serves the nightly of ``out``; raises ``UsageError`` where another does."""
    path = _file(out)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            holder = _read(handle)
            process = holder.process if holder else "unknown"
            raise UsageError(
                f"a nightly (process {process}) serves {out} already; stop it first, or add --now for a night at once"
            ) from error
        os.ftruncate(handle, 0)
        os.pwrite(handle, json.dumps(asdict(Serving(os.getpid(), address))).encode(), 0)
        yield
    finally:
        os.close(handle)


def find_serving(out: Path | str) -> Serving | None:
    """The nightly that serves ``out`` from this machine; None where none does."""
    try:
        handle = os.open(_file(out), os.O_RDONLY | os.O_CLOEXEC)
    except FileNotFoundError:
        return None
    try:
        fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return _read(handle)
    finally:
        os.close(handle)
    return None


def _file(out: Path | str) -> Path:
    return prefect_home() / FOLDER / f"{deployment_name(out)}.json"


def _read(handle: int) -> Serving | None:
    try:
        return Serving(**json.loads(os.pread(handle, 4096, 0)))
    except (ValueError, TypeError):
        return None


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
    words, pipe = [sys.executable, "-P", str(program), str(fd), services, str(cache_root() / "empty")], subprocess.PIPE
    return subprocess.Popen(words, stdin=pipe, stdout=log, stderr=log, pass_fds=[fd], start_new_session=True, env=env)


def _stop(server: subprocess.Popen[bytes]) -> None:
    if server.stdin is not None:
        server.stdin.close()
    try:
        server.wait(timeout=SERVER_STOP_LIMIT_S)
    except subprocess.TimeoutExpired:
        server.kill()
        server.wait()
