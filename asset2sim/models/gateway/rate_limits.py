"""Rate and concurrency limits of a provider, and the SQLite file through which all workers of an output folder agree.
Own code, since it is small and belongs together: rate, concurrency, and a ``Retry-After`` that one worker gets and that
holds for all. The slots are locks of ``filelock``, which the system frees however a process ends."""

import contextlib
import re
import sqlite3
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.parse import urlsplit

from filelock import FileLock, Timeout

from asset2sim.models.gateway.environment import find_provider
from schemas.errors import ModelError
from schemas.settings import ModelSettings

LEDGER = ".cache/ledger.sqlite"
"""Under the output folder: the SQLite file of amounts spent and reserved, and of when each provider may be asked."""
BUSY_S = 30.0
"""Longest wait for another process's transaction, s; each takes milliseconds."""

SLOTS = ".cache/slots"
"""Under the output folder: one empty file for each request that a provider may be asked at the same time."""
SLOT_POLL_S = 0.05
"""Interval between searches for a free slot, s: a request takes a second or more."""
STOP_POLL_S = 0.2
"""Longest wait between checks whether the run was stopped, s."""

_TABLES = (
    "CREATE TABLE IF NOT EXISTS spent (run_id TEXT, scope TEXT, calls INTEGER NOT NULL, tokens INTEGER NOT NULL, "
    "usd REAL NOT NULL, PRIMARY KEY (run_id, scope)) WITHOUT ROWID",
    "CREATE TABLE IF NOT EXISTS held (ticket TEXT PRIMARY KEY, run_id TEXT, scope TEXT, tokens INTEGER NOT NULL, "
    "usd REAL NOT NULL, most_tokens INTEGER NOT NULL, most_usd REAL NOT NULL, until REAL NOT NULL) WITHOUT ROWID",
    "CREATE TABLE IF NOT EXISTS pace (provider TEXT PRIMARY KEY, next_at REAL NOT NULL) WITHOUT ROWID",
)

Stopped = Callable[[], bool]


class RunStoppedError(ModelError):
    """The run was stopped while a request waited for its turn."""


def never_stopped() -> bool:
    """Stop callback that never stops."""
    return False


def sleep(seconds: float, stopped: Stopped) -> None:
    """Sleep; raises ``RunStoppedError`` as soon as the run is stopped."""
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0.0:
        if stopped():
            raise RunStoppedError("the run was stopped")
        time.sleep(min(left, STOP_POLL_S))


def provider_name(settings: ModelSettings) -> str:
    """Name under which requests are counted: the provider, and the host of ``api_base``. Safe in a file name."""
    host = urlsplit(settings.api_base or "").netloc.rpartition("@")[2]
    name = "@".join(part for part in (find_provider(settings.model) or "unknown", host) if part)
    return re.sub(r"[^\w.@-]", "_", name)


@contextlib.contextmanager
def slot(folder: Path, provider: str, count: int, stopped: Stopped = never_stopped) -> Iterator[None]:
    """One of ``count`` concurrent requests at a provider: waits without limit, and is held within the block."""
    folder.mkdir(parents=True, exist_ok=True)
    while True:
        for number in range(count):
            lock = FileLock(folder / f"{provider}-{number}.lock", blocking=False, thread_local=False)
            try:
                lock.acquire()
            except Timeout:
                continue
            try:
                yield
            finally:
                lock.release()
            return
        sleep(SLOT_POLL_S, stopped)


def wait_for_turn(file: Path, provider: str, per_minute: float | None, stopped: Stopped = never_stopped) -> None:
    """Wait until the provider may be asked: requests are spread evenly over the minute, first come first served,
    and none is sent before the time that ``postpone_next_request`` has set."""
    now = time.time()
    with transaction(file) as ledger:
        row = ledger.execute("SELECT next_at FROM pace WHERE provider = ?", (provider,)).fetchone()
        turn = max(now, row[0]) if row else now
        if per_minute is not None:
            ledger.execute("INSERT OR REPLACE INTO pace VALUES (?, ?)", (provider, turn + 60.0 / per_minute))
    sleep(turn - now, stopped)


def postpone_next_request(file: Path, provider: str, seconds: float) -> None:
    """Delay all requests to a provider, which has asked one of the workers to wait."""
    with transaction(file) as ledger:
        ledger.execute(
            "INSERT INTO pace VALUES (?, ?) ON CONFLICT (provider) DO UPDATE SET "
            "next_at = max(next_at, excluded.next_at)",
            (provider, time.time() + seconds),
        )


@contextlib.contextmanager
def transaction(file: Path) -> Iterator[sqlite3.Connection]:
    """One exclusive transaction over all processes and threads; rolled back where the block raises. Each has its own
    connection, in the default journal mode: WAL is faster but fails on shared file systems. Raises ``sqlite3.Error`` or
    ``OSError`` where the file cannot be used."""
    file.parent.mkdir(parents=True, exist_ok=True)
    connection = sqlite3.connect(file, timeout=BUSY_S, isolation_level=None)
    try:
        connection.execute("BEGIN IMMEDIATE")
        for table in _TABLES:
            connection.execute(table)
        yield connection
        connection.execute("COMMIT")
    except BaseException:
        with contextlib.suppress(sqlite3.Error):
            connection.execute("ROLLBACK")
        raise
    finally:
        connection.close()
