"""How fast and how often at once a provider is asked, over all threads and processes that share an output folder.

Own code, since what is needed is small and goes together: how often, how many at once, and one worker's ``Retry-After``
that holds back the others. The slots are locks of ``filelock``, which the system frees however a process ends.
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
"""Time between two looks for a free slot, s: a request takes a second or more."""
LOOK_S = 0.2
"""Longest sleep without looking whether the run was stopped, s."""

Stopped = Callable[[], bool]


class RunStoppedError(ModelError):
    """The run was stopped while a request waited for its turn."""


def never() -> bool:
    """For those whom nobody stops."""
    return False


def sleep(seconds: float, stopped: Stopped) -> None:
    """Sleep; raises ``RunStoppedError`` as soon as the run is stopped."""
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0.0:
        if stopped():
            raise RunStoppedError("the run was stopped")
        time.sleep(min(left, LOOK_S))


def provider_name(settings: ModelSettings) -> str:
    """Who counts the requests: the provider, and the server where it is one of the user's own. Fit for a file name."""
    host = urlsplit(settings.api_base or "").netloc.rpartition("@")[2]
    name = "@".join(part for part in (find_provider(settings.model) or "unknown", host) if part)
    return re.sub(r"[^\w.@-]", "_", name)


@contextlib.contextmanager
def slot(folder: Path, provider: str, count: int, stopped: Stopped = never) -> Iterator[None]:
    """One of ``count`` places at a provider, waited for as long as it takes and held within the block."""
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
    """Wait until the provider may be asked: requests are spread evenly over the minute, in the order of their asking,
    and none goes out before the time that a provider asked for (``hold_back``)."""
    now = time.time()
    with transaction(file) as ledger:
        row = ledger.execute("SELECT next_at FROM pace WHERE provider = ?", (provider,)).fetchone()
        turn = max(now, row[0]) if row else now
        if per_minute is not None:
            ledger.execute("INSERT OR REPLACE INTO pace VALUES (?, ?)", (provider, turn + 60.0 / per_minute))
    sleep(turn - now, stopped)


def hold_back(file: Path, provider: str, seconds: float) -> None:
    """Let nobody ask the provider for so long: it said so to one of the workers."""
    with transaction(file) as ledger:
        ledger.execute(
            "INSERT INTO pace VALUES (?, ?) ON CONFLICT (provider) DO UPDATE SET "
            "next_at = max(next_at, excluded.next_at)",
            (provider, time.time() + seconds),
        )
