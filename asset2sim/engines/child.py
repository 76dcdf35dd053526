"""Engines in a forked child of this process: a crash or a hang of an engine costs its own report, and no more.

The process of an asset is itself a child that can be killed, has one thread and its engines loaded already, so that a
plain fork is safe and takes any function and arguments as they are. It is not free: what the child touches is copied
page by page, 0.05 to 0.1 s of processor time, so engines share one until one of them has a problem.
"""

import os
import pickle
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Generic, NoReturn, TypeVar

from asset2sim.assets.child_process import dump_traceback, end_with_parent
from schemas.errors import Asset2SimError, AssetError
from schemas.vocabulary import Engine

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
    seconds: float = field(default=0.0, compare=False)
    """Wall time of the call, s, its child's start included."""


def in_child(engine: Engine, function: Callable[..., T], *args: object, time_limit_s: float) -> ChildOutcome[T]:
    """Call ``function(*args)`` in a forked child, killed after ``time_limit_s`` of wall time; its result is pickled.

    Never raises for what the child does, and leaves nothing behind: the child stays in this process's group, ends with
    this process, and is gone when this returns. A traceback goes to standard error, which is an asset's log.
    """
    return in_children({engine: partial(function, *args)}, time_limit_s=time_limit_s)[engine]


def in_children(calls: Mapping[Engine, Callable[[], T]], *, time_limit_s: float) -> dict[Engine, ChildOutcome[T]]:
    """As ``in_child``, a call for each engine, each with that limit, one after the other in one child; after a call
    that had a problem the others go on in a new one."""
    found: dict[Engine, ChildOutcome[T]] = {}
    while len(found) < len(calls):
        found |= _in_one_child({engine: call for engine, call in calls.items() if engine not in found}, time_limit_s)
    return found


def _in_one_child(calls: Mapping[Engine, Callable[[], T]], time_limit_s: float) -> dict[Engine, ChildOutcome[T]]:
    """The outcomes of these calls up to the first that had a problem."""
    sys.stdout.flush()
    sys.stderr.flush()
    reader, writer = Pipe(duplex=False)
    parent = os.getpid()
    pid = os.fork()
    if pid == 0:
        reader.close()
        _work(writer, parent, calls.values())
    writer.close()
    found: dict[Engine, ChildOutcome[T]] = {}
    status: int | None = None
    try:
        for engine in calls:
            start = time.perf_counter()
            outcome: ChildOutcome[T]
            try:
                if reader.poll(time_limit_s):
                    outcome = pickle.loads(reader.recv_bytes())
                else:
                    dump_traceback(pid)
                    why = f"was not done after {time_limit_s:g} s, and was killed"
                    outcome = ChildOutcome(None, why, timed_out=True, died=True)
            except (pickle.UnpicklingError, AttributeError, ValueError) as error:
                outcome = ChildOutcome(None, f"died while it answered ({error})", died=True)
            except (EOFError, OSError):
                _, status = os.waitpid(pid, 0)
                outcome = ChildOutcome(None, _cause_of_death(status), died=True)
            named = None if outcome.problem is None else f"{engine} {outcome.problem}"
            found[engine] = replace(outcome, problem=named, seconds=time.perf_counter() - start)
            if named is not None:
                break
        return found
    finally:
        reader.close()
        # A child that has sent its results may still hang while it ends.
        if status is None:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)


def _work(writer: Connection, parent: int, calls: Iterable[Callable[[], T]]) -> NoReturn:
    """The child: make the calls, send each outcome, and end without the parent's exit handlers."""
    code = 1
    try:
        end_with_parent(parent)
        for call in calls:
            said, sound = _attempt(call)
            writer.send_bytes(said)
            if not sound:
                break
        sys.stdout.flush()
        sys.stderr.flush()
        code = 0
    finally:
        os._exit(code)


def _attempt(call: Callable[[], T]) -> tuple[bytes, bool]:
    """The pickled outcome of a call, its problem without the engine's name, and whether it had none."""
    try:
        return pickle.dumps(ChildOutcome(call())), True
    except Asset2SimError as error:
        return pickle.dumps(ChildOutcome(None, f"says: {error}", refused=isinstance(error, AssetError))), False
    except MemoryError:
        return pickle.dumps(ChildOutcome(None, "needed more memory than an asset may use", starved=True)), False
    except Exception as error:  # whatever is raised in here costs this engine's report alone
        traceback.print_exc()
        return pickle.dumps(ChildOutcome(None, f"failed: {type(error).__name__}: {error}")), False


def _cause_of_death(status: int) -> str:
    code = os.waitstatus_to_exitcode(status)
    if code >= 0:
        return f"ended its process with exit code {code} and without a result"
    return f"crashed: its process was killed by {signal.Signals(-code).name}"
