"""One run at a time on an output: a lock on its folder, and an object at its URL that only one process can create.
Stores have no lock that ends with its process. So the holder renews the object, and a lock that is not renewed is taken
over. The machines' clocks must agree to about a minute."""

import fcntl
import json
import logging
import os
import platform
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from asset2sim.storage.objects import (
    StoreError,
    object_info,
    read_object,
    remove_objects,
    scheme_of,
    store_usage_error,
    write_object,
)
from schemas.errors import Asset2SimError, UsageError

LOCK_FILE = ".lock"
RENEW_S = 60.0
"""Time between two renewals, s: 480 small requests in a night of eight hours."""
STALE_S = 300.0
"""Age from which a lock counts as abandoned, s: four renewals may fail, or clocks differ by minutes, before a live run
loses it. A killed run delays the next by at most this."""

logger = logging.getLogger(__name__)


@contextmanager
def lock_output(folder: Path, *, shown: Path | str | None = None, wait: bool = False) -> Iterator[None]:
    """Lock a folder for this process, and make it; the system releases the lock however the process ends. Where another
    process holds it, ``wait`` for its end, or raise UsageError, which names that process and OUT as ``shown``. The file
    stays: removing it would let two runs lock two files of one name."""
    out = shown or folder
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handle = os.open(folder / LOCK_FILE, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    except OSError as error:
        raise UsageError(f"cannot write to the output folder {out}: {error.strerror}; choose another --out") from error
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        except BlockingIOError as error:
            holder = os.pread(handle, 64, 0).decode(errors="replace").strip() or "unknown"
            raise UsageError(
                f"another run (process {holder}) is writing to {out}; wait until it ends, or choose another --out"
            ) from error
        os.ftruncate(handle, 0)
        os.pwrite(handle, f"{os.getpid()}\n".encode(), 0)
        yield
    finally:
        os.close(handle)


class LostLockError(Asset2SimError):
    """Another run has taken this one's output over."""


@dataclass(frozen=True)
class Holder:
    """Holder of an output's lock: unique token, process, machine, and time of the last renewal (s since 1970)."""

    token: str
    process: int
    host: str
    time: float

    def __str__(self) -> str:
        return f"process {self.process} on {self.host}"


@contextmanager
def lock_url(url: str, note: Path, renew_s: float = RENEW_S) -> Iterator[Callable[[], None]]:
    """Lock an output URL for this process. Yields a function that raises LostLockError once another run has it.

    ``note`` is a local file that only the caller uses; it holds the token of the last lock taken from this machine. If
    the store still has that lock, its run was killed, and it is replaced at once. Raises UsageError, naming the holder,
    where another run holds the URL, and where nothing can be written.
    """
    place = f"{url}/{LOCK_FILE}"
    mine = Holder(uuid.uuid4().hex, os.getpid(), platform.node(), time.time())
    killed = ""
    with suppress(OSError):
        killed = note.read_text(encoding="ascii", errors="replace")
    try:
        _acquire(url, place, mine, killed)
        note.write_text(mine.token, encoding="ascii")
    except StoreError as error:
        raise store_usage_error(error) from error
    lost, ended = threading.Event(), threading.Event()

    def renew() -> None:
        while not ended.wait(renew_s):
            try:
                if not _renew(place, mine):
                    lost.set()
                    return
            except StoreError as error:
                logger.warning("the lock on %s cannot be renewed now (%s)", url, error)

    def check() -> None:
        if lost.is_set():
            raise LostLockError(
                f"another run took {url} over, because this one had not renewed its lock for {STALE_S:.0f} s; nothing "
                "more is written there"
            )

    thread = threading.Thread(target=renew, name="asset2sim-lock", daemon=True)
    thread.start()
    try:
        yield check
    finally:
        ended.set()
        thread.join()
        with suppress(StoreError):
            if not lost.is_set() and _read(place)[0].token == mine.token:
                remove_objects([place])


def _acquire(url: str, place: str, mine: Holder, killed: str) -> None:
    try:
        write_object(place, _text(mine), mode="create")
        return
    except FileExistsError:
        pass
    try:
        holder, version = _read(place)
    except StoreError as error:
        if not error.missing:
            raise
        raise UsageError(f"another run on {url} is just starting or ending; try again in a few seconds") from error
    age = time.time() - holder.time
    if age < STALE_S and holder.token != killed:
        raise UsageError(
            f"another run ({holder}) is writing to {url}; wait until it ends, or choose another --out. If it was "
            f"killed, its lock counts for nothing in {STALE_S - age:.0f} s"
        )
    if not _replace(place, mine, holder, version):
        raise UsageError(f"another run on {url} is just starting; wait until it ends, or choose another --out")
    logger.warning("%s was left locked by %s, which was last alive %.0f s ago; this run goes on", url, holder, age)


def _replace(place: str, mine: Holder, holder: Holder, version: str) -> bool:
    """Replace ``holder``'s lock with ours; False where another process was faster."""
    if scheme_of(place) in ("s3", "s3a"):
        try:
            write_object(place, _text(mine), IfMatch=f'"{version}"')
        except StoreError as error:
            # The library has no error of its own for a condition that does not hold.
            if _read(place)[1] != version:
                return False
            raise error
        return True
    # fsspec passes no such condition to other stores: two processes may both remove the object at once, but only one
    # creates it, and the other one notices at its renewal.
    if _read(place)[0].token != holder.token:
        return False
    if holder.token == mine.token:
        write_object(place, _text(mine))
        return True
    remove_objects([place])
    try:
        write_object(place, _text(mine), mode="create")
    except FileExistsError:
        return False
    return True


def _renew(place: str, mine: Holder) -> bool:
    try:
        holder, version = _read(place)
    except StoreError as error:
        if error.missing:
            return False
        raise
    if holder.token != mine.token:
        return False
    return _replace(place, Holder(**asdict(mine) | {"time": time.time()}), holder, version)


def _read(place: str) -> tuple[Holder, str]:
    """The holder, and the object's version."""
    info = object_info(place)
    if info is None:
        raise StoreError(f"{place}: not there", missing=True)
    text = read_object(place)
    try:
        return Holder(**json.loads(text)), info.version
    except (ValueError, TypeError):
        # Not written by us: its age is unknown, so it counts as abandoned.
        return Holder("", 0, "unknown", 0.0), info.version


def _text(holder: Holder) -> bytes:
    return json.dumps(asdict(holder)).encode()
