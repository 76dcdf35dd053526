"""Main loop of a child process: set limits, then run one function after another and send back each result."""

import contextlib
import os
import pickle
import pkgutil
import threading
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path

from asset2sim.experiments.isolation import child_setup
from asset2sim.experiments.isolation.child_setup import MEGABYTE, memory
from asset2sim.experiments.isolation.pipe_messages import Answer, Begun, Call, ChildWork, Raised, Returned
from schemas.errors import Asset2SimError, is_disk_full

MAX_GROWTH_MB = 400.0
"""Resident memory that work may leave behind, MB."""


@dataclass(frozen=True)
class ProcessState:
    """State of a process; 0 ``resident_mb``, ``open_files`` and ``threads`` where the system does not tell."""

    resident_mb: float
    open_files: int
    threads: int
    has_children: bool
    folder: str
    environment: frozenset[tuple[str, str]]


def process_state() -> ProcessState:
    """The present state of this process."""
    present = memory()
    return ProcessState(
        0.0 if present is None else present[1] / MEGABYTE,
        _entries(Path("/proc/self/fd")),
        max(threading.active_count(), _entries(Path("/proc/self/task"))),
        _has_children(),
        os.getcwd(),
        frozenset(os.environ.items()),
    )


def is_unchanged_since(before: ProcessState) -> bool:
    """Whether this process is as before: no more threads or open files, no children, the same folder and environment,
    and at most ``MAX_GROWTH_MB`` more memory."""
    now = process_state()
    return (
        now.resident_mb <= before.resident_mb + MAX_GROWTH_MB
        and now.open_files <= before.open_files
        and now.threads <= before.threads
        and not now.has_children
        and (now.folder, now.environment) == (before.folder, before.environment)
    )


def _has_children() -> bool:
    """Whether this process has a child, running or not waited for; yes where the system does not tell."""
    if not hasattr(os, "waitid"):  # macOS
        return True
    try:
        os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
    except ChildProcessError:
        return False
    return True


def _entries(folder: Path) -> int:
    try:
        return len(os.listdir(folder))
    except OSError:
        return 0


MAX_WORK_PER_CHILD = 50
"""Most pieces of work of one child, which bounds leaks that ``process_state`` does not measure."""
IDLE_LIMIT_S = 5.0
"""Time without work after which a child ends, s, so that nothing has to end the children when a run ends."""


class ServiceError(Asset2SimError):
    """A service in the parent process raised; the message says what."""


def child_main(pipe: Connection) -> None:
    """Do the work that comes over the pipe, until some of it leaves traces, none comes for ``IDLE_LIMIT_S``,
    ``MAX_WORK_PER_CHILD`` is reached, or the parent is gone."""
    child_setup.lead_own_group()
    child_setup.die_with_parent()
    child_setup.forbid_core_files()
    child_setup.adopt_orphans()
    before = process_state()
    for number in range(1, MAX_WORK_PER_CHILD + 1):
        if not pipe.poll(IDLE_LIMIT_S):
            return
        try:
            work = pipe.recv()
        except EOFError:
            return
        if not _do(pipe, work, before, number < MAX_WORK_PER_CHILD):
            return


def _do(pipe: Connection, work: ChildWork, before: ProcessState, may_do_more: bool) -> bool:
    """Do one piece of work and send its result. Returns whether this process may be given more."""
    child_setup.log_to(Path(work.log_path))
    child_setup.limit_memory(work.memory_limit_mb)
    pipe.send(Begun())
    last_word = _attempt(pipe, work)
    child_setup.close_log()
    if isinstance(last_word, Returned):
        last_word = replace(last_word, clean=may_do_more and is_unchanged_since(before))
    try:
        pipe.send(last_word)
    except (pickle.PicklingError, AttributeError, TypeError, MemoryError) as error:
        pipe.send(_raised(error))
        return False
    return isinstance(last_word, Returned) and last_word.clean


def _attempt(pipe: Connection, work: ChildWork) -> Returned | Raised:
    """Call the function as ``function(*args, **proxies)``, a proxy for each service: a call to it is answered by the
    parent."""
    try:
        function, args = pickle.loads(work.pickled)
        if isinstance(function, str):
            function = pkgutil.resolve_name(function)
        return Returned(function(*args, **{name: _proxy(pipe, name) for name in work.services}))
    except Exception as error:  # a broken program in here is one asset's failure: the parent reports it
        with contextlib.suppress(OSError):
            traceback.print_exc()
        return _raised(error)


def _raised(error: Exception) -> Raised:
    return Raised(
        type(error).__name__, str(error), out_of_memory=isinstance(error, MemoryError), disk_full=is_disk_full(error)
    )


def _proxy(pipe: Connection, service: str) -> Callable[..., object]:
    def ask_parent(*args: object) -> object:
        pipe.send(Call(service, args))
        answer = pipe.recv()
        if not isinstance(answer, Answer):
            raise ServiceError(f"service '{service}' answered with {type(answer).__name__}")
        if answer.error is not None:
            raise ServiceError(f"service '{service}': {answer.error}")
        return answer.value

    return ask_parent
