"""Being told to stop, once or more often: whoever stops a night, Prefect's runner for one, may say so twice."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

_waiting = threading.Event()
"""Set by a SIGTERM that nobody could obey when it came."""


@contextmanager
def terminated_as_interrupted() -> Iterator[None]:
    """Take the first SIGTERM for Ctrl-C within the block; Prefect would drop everything. Later ones change nothing:
    what the first began, stopping children and publishing, must not be cut. Does nothing outside the main thread."""
    told = False

    def interrupt() -> None:
        nonlocal told
        if not told:
            told = True
            raise KeyboardInterrupt

    with _on_sigterm(interrupt):
        if _waiting.is_set():
            _waiting.clear()
            interrupt()
        yield


@contextmanager
def termination_deferred() -> Iterator[None]:
    """Let a SIGTERM within the block wait for the next ``terminated_as_interrupted``; after the last one it is too late
    to stop, and what is left, publishing, takes seconds. Does nothing outside the main thread."""
    _waiting.clear()
    try:
        with _on_sigterm(_waiting.set):
            yield
    finally:
        _waiting.clear()


@contextmanager
def _on_sigterm(act: Callable[[], None]) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def handle(number: int, frame: FrameType | None) -> None:
        act()

    before = signal.signal(signal.SIGTERM, handle)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
