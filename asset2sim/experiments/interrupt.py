"""SIGTERM that may come again and again (Prefect's runner, for one, may send two to stop a night), and Ctrl-C that is
never lost.

Neither interrupts an import. Packages that try one under ``except BaseException`` (trimesh does) would take it for a
library that is missing and go on without; pydantic makes another error of it; and a module's lock may stay held, on
which a thread that imports the same waits for ever.
"""

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

    def interrupt(*_: object) -> None:
        nonlocal told
        if not told:
            told = True
            raise KeyboardInterrupt

    with _handled(signal.SIGTERM, interrupt):
        if _waiting.is_set():
            _waiting.clear()
            interrupt()
        yield


@contextmanager
def lost_interrupts_repeated() -> Iterator[None]:
    """Send Ctrl-C again where Python would drop it within the block: in an import, or in a destructor or the garbage
    collector's callback, where it would only print a traceback, and the program would go on. A shell starts what runs
    in its background deaf to Ctrl-C: it hears one all the same."""
    hook = sys.unraisablehook

    def repeat(lost: "sys.UnraisableHookArgs") -> None:
        if isinstance(lost.exc_value, KeyboardInterrupt):
            # This hook is called within what dropped it.
            _send_again(signal.SIGINT)
        else:
            hook(lost)

    sys.unraisablehook = repeat
    try:
        with _handled(signal.SIGINT, signal.default_int_handler):
            yield
    finally:
        sys.unraisablehook = hook


@contextmanager
def sigterm_deferred() -> Iterator[None]:
    """Defer a SIGTERM within the block to the next ``sigterm_as_interrupt``; after the last one it is ignored,
    since only publishing is left, which takes seconds. Does nothing outside the main thread."""
    _waiting.clear()
    try:
        with _handled(signal.SIGTERM, lambda *_: _waiting.set()):
            yield
    finally:
        _waiting.clear()


@contextmanager
def _handled(number: signal.Signals, handler: Callable[[int, FrameType | None], object]) -> Iterator[None]:
    """Call ``handler`` for a signal that comes within the block, once no import is under way that the block began. Does
    nothing outside the main thread."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    begun = _imports(sys._getframe())

    def handle(number: int, frame: FrameType | None) -> None:
        if _imports(frame) > begun:
            _send_again(number)
        else:
            handler(number, frame)

    before = signal.signal(number, handle)
    try:
        yield
    finally:
        signal.signal(number, before)


def _imports(frame: FrameType | None) -> int:
    """Frames of Python's import among a frame and those that called it."""
    found = 0
    while frame is not None:
        found += frame.f_code.co_filename.startswith("<frozen importlib")
        frame = frame.f_back
    return found


def _send_again(number: int) -> None:
    """Send the main thread a signal once more, in a moment."""
    main_thread = threading.main_thread().ident
    # While Python ends there are no new threads.
    with suppress(RuntimeError):
        if main_thread is not None:
            threading.Timer(0.05, signal.pthread_kill, (main_thread, number)).start()
