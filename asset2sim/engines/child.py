"""One engine in a forked child of this process: a crash or a hang of the engine costs its own report, and no more.

The process of an asset is itself a child that can be killed, has one thread and its engines loaded already, so that a
plain fork is safe, costs a few milliseconds, and takes any function and arguments as they are.
"""

import os
import pickle
import select
import signal
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Generic, NoReturn, TypeVar

from asset2sim.assets.child_process import dump_traceback, end_with_parent
from schemas.errors import Asset2SimError, AssetError
from schemas.vocabulary import Engine

CHUNK = 1 << 20
"""Bytes that are read from the child at once."""
T = TypeVar("T")


@dataclass(frozen=True)
class ChildOutcome(Generic[T]):
    """Outcome of a child: a value, or a ``problem``, one sentence that names the engine. ``died``: the engine crashed
    or hung, and so reported nothing itself; ``refused``: it was raised as an error of the asset, and would be again;
    ``starved``: it lacked memory."""

    value: T | None
    problem: str | None = None
    timed_out: bool = False
    died: bool = False
    refused: bool = False
    starved: bool = False


def in_child(engine: Engine, function: Callable[..., T], *args: object, time_limit_s: float) -> ChildOutcome[T]:
    """Call ``function(*args)`` in a forked child, killed after ``time_limit_s`` of wall time; its result is pickled.

    Never raises for what the child does, and leaves nothing behind: the child stays in this process's group, ends with
    this process, and is gone when this returns. A traceback goes to standard error, which is an asset's log.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    reader, writer = os.pipe()
    parent = os.getpid()
    pid = os.fork()
    if pid == 0:
        os.close(reader)
        _work(writer, parent, function, args)
    os.close(writer)
    deadline = time.monotonic() + time_limit_s
    status: int | None = None
    try:
        said = _read(reader, deadline)
        if said is None:
            dump_traceback(pid)
            return ChildOutcome(
                None, f"{engine} was not done after {time_limit_s:g} s, and was killed", timed_out=True, died=True
            )
        # A child that has sent its result may still hang while it ends; it is killed below.
        if not said:
            _, status = os.waitpid(pid, 0)
            return ChildOutcome(None, f"{engine} {_cause_of_death(status)}", died=True)
        return _unpickled(engine, said)
    finally:
        os.close(reader)
        if status is None:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)


def _work(writer: int, parent: int, function: Callable[..., T], args: tuple[object, ...]) -> NoReturn:
    """The child: call the function, send the outcome, and end without running what the parent would at its exit."""
    code = 1
    try:
        end_with_parent(parent)
        said = _attempt(function, args)
        with os.fdopen(writer, "wb") as stream:
            stream.write(said)
        sys.stdout.flush()
        sys.stderr.flush()
        code = 0
    finally:
        os._exit(code)


def _attempt(function: Callable[..., T], args: tuple[object, ...]) -> bytes:
    """The pickled outcome of a call, its problem without the engine's name."""
    try:
        return pickle.dumps(ChildOutcome(function(*args)))
    except Asset2SimError as error:
        return pickle.dumps(ChildOutcome(None, f"says: {error}", refused=isinstance(error, AssetError)))
    except MemoryError:
        return pickle.dumps(ChildOutcome(None, "needed more memory than an asset may use", starved=True))
    except Exception as error:  # whatever is raised in here costs this engine's report alone
        traceback.print_exc()
        return pickle.dumps(ChildOutcome(None, f"failed: {type(error).__name__}: {error}"))


def _unpickled(engine: Engine, said: bytes) -> ChildOutcome[T]:
    """The outcome that the child sent; ``died`` where it is cut short."""
    try:
        found: ChildOutcome[T] = pickle.loads(said)
    except (pickle.UnpicklingError, EOFError, AttributeError, ValueError) as error:
        return ChildOutcome(None, f"{engine} died while it answered ({error})", died=True)
    return found if found.problem is None else replace(found, problem=f"{engine} {found.problem}")


def _read(reader: int, deadline: float) -> bytes | None:
    """All that the child writes until it closes its end; None where the deadline passes first."""
    chunks: list[bytes] = []
    while True:
        left = deadline - time.monotonic()
        if left <= 0.0 or not select.select([reader], [], [], left)[0]:
            return None
        chunk = os.read(reader, CHUNK)
        if not chunk:
            return b"".join(chunks)
        chunks.append(chunk)


def _cause_of_death(status: int) -> str:
    code = os.waitstatus_to_exitcode(status)
    if code >= 0:
        return f"ended its process with exit code {code} and without a result"
    return f"crashed: its process was killed by {signal.Signals(-code).name}"
