"""Nightlies that are served on this machine, with their servers: a locked file each in Prefect's folder. Imports
nothing of Prefect. The lock ends with the process that holds it, so the file of a killed one does not count."""

import fcntl
import hashlib
import json
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

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
