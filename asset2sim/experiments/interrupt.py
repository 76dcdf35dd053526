"""SIGTERM that may come again and again (Prefect's runner, for one, may send two to stop a night), and Ctrl-C that is
never lost."""

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
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
def lost_interrupts_repeated() -> Iterator[None]:
    """Send Ctrl-C again where Python dropped it within the block: in a destructor or the garbage collector's callback
    it would only print a traceback, and the program would go on. A shell starts what runs in its background deaf to
    Ctrl-C: it hears one all the same."""
    before = sys.unraisablehook
    main_thread = threading.main_thread().ident
    if threading.get_ident() == main_thread and signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)

    def repeat(lost: "sys.UnraisableHookArgs") -> None:
        if not isinstance(lost.exc_value, KeyboardInterrupt):
            before(lost)
        elif main_thread is not None:
            # Later: this hook is called within what dropped it. While Python ends there are no new threads.
            with suppress(RuntimeError):
                threading.Timer(0.05, signal.pthread_kill, (main_thread, signal.SIGINT)).start()

    sys.unraisablehook = repeat
    try:
        yield
    finally:
        sys.unraisablehook = before


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
