"""Rate and concurrency limits of a provider, over all threads and processes that share an output folder.

Own code, since it is small and belongs together: rate, concurrency, and a ``Retry-After`` that one worker gets and
that holds for all. The slots are locks of ``filelock``, which the system frees however a process ends.
"""

import contextlib
import re
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.parse import urlsplit

from filelock import FileLock, Timeout

from asset2sim.models.gateway.choices import find_provider
from asset2sim.models.gateway.ledger import transaction
from schemas.errors import ModelError
from schemas.settings import ModelSettings

SLOTS = ".cache/slots"
"""Under the output folder: one empty file for each request that a provider may be asked at the same time."""
POLL_S = 0.05
"""Interval between searches for a free slot, s: a request takes a second or more."""
LOOK_S = 0.2
"""Longest sleep between checks whether the run was stopped, s."""

Stopped = Callable[[], bool]


class RunStoppedError(ModelError):
    """The run was stopped while a request waited for its turn."""


def never() -> bool:
    """Stop callback that never stops."""
    return False


def sleep(seconds: float, stopped: Stopped) -> None:
    """Sleep; raises ``RunStoppedError`` as soon as the run is stopped."""
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0.0:
        if stopped():
            raise RunStoppedError("the run was stopped")
        time.sleep(min(left, LOOK_S))


def provider_name(settings: ModelSettings) -> str:
    """Name under which requests are counted: the provider, and the host of ``api_base``. Safe in a file name."""
    host = urlsplit(settings.api_base or "").netloc.rpartition("@")[2]
    name = "@".join(part for part in (find_provider(settings.model) or "unknown", host) if part)
    return re.sub(r"[^\w.@-]", "_", name)


@contextlib.contextmanager
def slot(folder: Path, provider: str, count: int, stopped: Stopped = never) -> Iterator[None]:
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
        sleep(POLL_S, stopped)


def wait_for_turn(file: Path, provider: str, per_minute: float | None, stopped: Stopped = never) -> None:
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
