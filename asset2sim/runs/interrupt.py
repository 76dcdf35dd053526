"""SIGTERM handling that tolerates repeated signals: Prefect's runner, for one, may send two to stop a night."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

_waiting = threading.Event()
"""Set by a SIGTERM that came while it could not be acted on."""


@contextmanager
def sigterm_as_interrupt() -> Iterator[None]:
    """Treat the block's first SIGTERM as Ctrl-C (Prefect would drop all results) and ignore later ones, so that
    stopping the children and publishing can finish. Does nothing outside the main thread."""
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
def sigterm_deferred() -> Iterator[None]:
    """Defer a SIGTERM within the block to the next ``sigterm_as_interrupt``; after the last one it is ignored,
    since only publishing is left, which takes seconds. Does nothing outside the main thread."""
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
