"""What a test starts: Python programs, forks, servers and engines. A test that starts any is marked ``system``."""

import sys
import threading
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

from asset2sim.engines.registry import declared_engine, known_engines, package_of
from schemas.vocabulary import Engine

_seen: list[str] | None = None
_watched: set[Engine] = set()


def begin() -> None:
    """Note from here on what this thread, the tests' own, starts."""
    global _seen
    _seen = []
    for engine in known_engines():
        # Nothing is imported that no test has: an engine is slow to load.
        if package_of(engine) in sys.modules and engine not in _watched:
            _watch(engine, *declared_engine(engine).started)


def end() -> list[str]:
    """What was started since ``begin``, each kind once."""
    global _seen
    found, _seen = sorted(set(_seen or ())), None
    return found


def _note(what: str) -> None:
    if _seen is not None and threading.current_thread() is threading.main_thread():
        _seen.append(what)


def _watch(engine: Engine, holder: object, name: str) -> None:
    call: Callable[..., Any] = getattr(holder, name)

    @wraps(call)
    def noting(*args: Any, **options: Any) -> Any:
        _note(f"the engine {engine}")
        return call(*args, **options)

    setattr(holder, name, noting)
    _watched.add(engine)


def _hear(event: str, args: tuple[Any, ...]) -> None:
    """Python's audit hook; small programs such as git or make are free."""
    if event == "subprocess.Popen":
        words = args[1]
        program = words if isinstance(words, (str, bytes)) else words[0]
        name = Path(program.decode() if isinstance(program, bytes) else program).name
        if name.startswith("python"):
            _note("a Python program")
    elif event == "os.fork":
        _note("a fork of this process")
    elif event == "socket.bind" and isinstance(args[1], tuple) and args[1] != ("::1", 0):
        _note("a server")  # urllib3 binds that once as it is imported, to learn whether there is IPv6


sys.addaudithook(_hear)
