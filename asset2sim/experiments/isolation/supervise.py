"""Run a function in a killable child process, serve its calls meanwhile, return how it ended; stop all of an owner."""

import os
import pickle
import signal
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing import connection
from multiprocessing.context import ForkServerProcess
from pathlib import Path
from typing import TypeVar

from asset2sim.assets.child_process import dump_traceback
from asset2sim.experiments.isolation.children import PROCESS_LOCK, Child, return_to_pool, start_work
from asset2sim.experiments.isolation.pipe_messages import (
    Answer,
    Begun,
    Call,
    ChildWork,
    Ending,
    Outcome,
    Raised,
    Returned,
)
from schemas.settings import RunSettings

Item = TypeVar("Item")
Result = TypeVar("Result")
_lock = threading.Lock()
_running: dict[int, str] = {}
_refused: set[str] = set()
_stopped: set[int] = set()


def register(pid: int, owner: str) -> None:
    """Note a child that ``stop_children`` must kill; a child that comes too late is killed here."""
    with _lock:
        _running[pid] = owner
        if owner in _refused:
            _stop(pid)


def forget(pid: int) -> None:
    """Remove a child that has ended."""
    with _lock:
        _running.pop(pid, None)
        _stopped.discard(pid)


def stop_children(owner: str) -> None:
    """Kill an owner's running children and refuse it new ones until ``accept_children``."""
    with _lock:
        _refused.add(owner)
        for pid, running_for in _running.items():
            if running_for == owner:
                _stop(pid)


def accept_children(owner: str) -> None:
    """Allow the owner children again."""
    with _lock:
        _refused.discard(owner)


def is_stopped(owner: str) -> bool:
    """Whether the owner is refused children."""
    with _lock:
        return owner in _refused


def was_stopped(pid: int) -> bool:
    """Whether this child was killed because its owner was stopped, even if the owner may have children again."""
    with _lock:
        return pid in _stopped


def _stop(pid: int) -> None:
    _stopped.add(pid)
    kill_group(pid)


def kill_group(pid: int) -> None:
    """Kill a child and everything it started. A child too young to lead its own group is killed alone."""
    for kill in (os.killpg, os.kill):
        with suppress(ProcessLookupError):
            kill(pid, signal.SIGKILL)
            return


REAP_WAIT_S = 5.0
"""Time in which a killed child must be gone, s: only a process stuck in the kernel takes longer."""


def run_isolated(
    function: Callable[..., object] | str,
    args: tuple[object, ...],
    *,
    time_limit_s: float,
    memory_limit_mb: int,
    services: Mapping[str, Callable[..., object]],
    log_path: Path,
    owner: str = "",
    fresh: bool = False,
) -> Outcome:
    """Call ``function(*args, **services)`` in a child process and wait for it.

    ``function`` must be importable by name, or is such a name, ``module:function``; its arguments and result must be
    picklable. Each service runs here, in the calling thread, when the child calls it by keyword; the time it takes is
    not the child's, so it does not count towards ``time_limit_s``. The child does nothing else at the time; it may be a
    reused one, unless ``fresh``.
    What it prints goes to ``log_path``, which is removed if it stays empty. ``stop_children(owner)`` kills it.
    Never raises for what the child does; raises ``UsageError`` where this process may not have children.
    """
    if is_stopped(owner):
        return Outcome(Ending.STOPPED, None, "stopped before it began", 0.0)
    work = ChildWork(pickle.dumps((function, args)), tuple(services), memory_limit_mb, str(log_path))
    child = start_work(work, fresh=fresh)
    register(child.pid, owner)
    outcome: Outcome | None = None
    try:
        outcome = _supervise(child, time_limit_s, memory_limit_mb, services)
        return outcome
    finally:
        if outcome is not None and outcome.clean and not was_stopped(child.pid):
            forget(child.pid)
            return_to_pool(child)
        else:
            kill_group(child.pid)
            _exit_code(child.process)
            forget(child.pid)
            child.pipe.close()
        if log_path.exists() and log_path.stat().st_size == 0:
            log_path.unlink()


def _supervise(
    child: Child, time_limit_s: float, memory_limit_mb: int, services: Mapping[str, Callable[..., object]]
) -> Outcome:
    started = time.monotonic()
    served = 0.0

    def failed(ending: Ending, reason: str) -> Outcome:
        return Outcome(ending, None, reason, time.monotonic() - started)

    while True:
        left = started + time_limit_s + served - time.monotonic()
        if left <= 0 or not connection.wait([child.pipe], timeout=left):
            dump_traceback(child.pid)
            return failed(Ending.TIMED_OUT, f"not done after {time_limit_s:g} s, and killed")
        try:
            message = child.pipe.recv()
            if isinstance(message, Begun):
                continue
            if isinstance(message, Call):
                asked = time.monotonic()
                answer = _serve(services, message)
                served += time.monotonic() - asked
                child.pipe.send(answer)
                continue
        except (EOFError, ConnectionError):
            if was_stopped(child.pid):
                return failed(Ending.STOPPED, "stopped with the run")
            return failed(Ending.DIED, _cause_of_death(_exit_code(child.process), memory_limit_mb))
        if isinstance(message, Returned):
            return Outcome(Ending.RETURNED, message.value, "", time.monotonic() - started, message.clean)
        if isinstance(message, Raised):
            return failed(*_cause_of_raise(message, memory_limit_mb))
        return failed(Ending.DIED, f"the child process said {type(message).__name__}, which means nothing here")


def _serve(services: Mapping[str, Callable[..., object]], call: Call) -> Answer:
    try:
        return Answer(value=services[call.service](*call.args))
    except Exception as error:  # whatever a service raises is reported to its caller, the child
        return Answer(error=f"{type(error).__name__}: {error}")


def _exit_code(process: ForkServerProcess) -> int | None:
    """Wait for a dead child's exit code: negative is the signal that killed it."""
    connection.wait([process.sentinel], timeout=REAP_WAIT_S)
    with PROCESS_LOCK:
        return process.exitcode


def _cause_of_raise(raised: Raised, memory_limit_mb: int) -> tuple[Ending, str]:
    said = f"{raised.type_name}: {raised.message}"
    if raised.out_of_memory:
        return Ending.OUT_OF_MEMORY, f"needed more than the {memory_limit_mb} MB of memory that one asset may add"
    if raised.disk_full:
        return Ending.DISK_FULL, f"a disk is full: {said}"
    return Ending.RAISED, said


def _cause_of_death(exit_code: int | None, memory_limit_mb: int) -> str:
    if exit_code is None or exit_code >= 0:
        return f"the process in which the asset ran ended with exit code {exit_code} and without a result"
    name = signal.Signals(-exit_code).name
    hint = {
        "SIGKILL": "; Linux does that when memory runs out: use fewer workers",
        "SIGABRT": f"; a library gave up, perhaps over the memory limit of {memory_limit_mb} MB",
    }.get(name, "")
    return f"the process in which the asset ran was killed by {name}{hint}"


@dataclass(frozen=True)
class Work:
    """A function, or its name ``module:function``, its arguments, and the most that calling it may take. ``services``
    and ``fresh``: see ``run_isolated``."""

    function: Callable[..., object] | str
    args: tuple[object, ...]
    time_limit_s: float
    memory_limit_mb: int = RunSettings().asset_memory_limit_mb
    services: Mapping[str, Callable[..., object]] = field(default_factory=dict)
    fresh: bool = False


def in_child(work: Work, owner: str = "", log_path: Path | None = None) -> Outcome:
    """How the work ended; its output goes to ``log_path``, if any. ``stop_children(owner)`` ends it."""
    with tempfile.TemporaryDirectory(prefix="asset2sim-work-") as place:
        return run_isolated(
            work.function, work.args, time_limit_s=work.time_limit_s, memory_limit_mb=work.memory_limit_mb,
            services=work.services, log_path=log_path or Path(place, "work.log"), owner=owner, fresh=work.fresh,
        )  # fmt: skip


def each_in_threads(work: Callable[[Item], Result], items: Iterable[Item], owner: str, workers: int) -> list[Result]:
    """The result of each item, in their order, so many ``workers`` at a time, each of which waits for a child of
    ``owner``'s; Ctrl-C stops these."""
    pool = ThreadPoolExecutor(workers)
    try:
        return list(pool.map(work, items))
    except KeyboardInterrupt:
        stop_children(owner)
        raise
    finally:
        pool.shutdown(cancel_futures=True)
