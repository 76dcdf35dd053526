"""Main loop of a child process: set its group, limits and log, then run one function after another and send back each
result; it dies with its parent."""

import contextlib
import ctypes
import faulthandler
import fcntl
import os
import pickle
import pkgutil
import resource
import signal
import sys
import threading
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from multiprocessing import connection, parent_process
from multiprocessing.connection import Connection
from pathlib import Path

from asset2sim.experiments.isolation.pipe_messages import Answer, Begun, Call, ChildWork, Raised, Returned
from schemas.errors import Asset2SimError, is_disk_full

MEGABYTE = 1024 * 1024
PR_SET_CHILD_SUBREAPER = 36
"""Linux: this process is the parent of its descendants that lose theirs."""


def lead_own_group() -> None:
    """Leave the terminal's process group: Ctrl-C goes to the parent alone, and the parent can kill the whole group."""
    os.setsid()
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def die_with_parent() -> None:
    """Have this process group killed when the parent process goes, however it goes.

    The fork server is no help here: it lives on while any child does. On Linux the kernel does it, by a signal on the
    pipe whose other end only the parent holds, so a hang in C that never gives up the interpreter dies too.
    """
    parent = parent_process()
    if parent is None:
        raise RuntimeError("die_with_parent() is for child processes")
    sentinel = parent.sentinel
    if hasattr(fcntl, "F_SETSIG"):
        fcntl.fcntl(sentinel, fcntl.F_SETOWN, -os.getpgrp())
        fcntl.fcntl(sentinel, fcntl.F_SETSIG, signal.SIGKILL)
        fcntl.fcntl(sentinel, fcntl.F_SETFL, fcntl.fcntl(sentinel, fcntl.F_GETFL) | os.O_ASYNC)
        if connection.wait([sentinel], timeout=0):
            os.killpg(0, signal.SIGKILL)
    else:
        threading.Thread(target=_kill_group_after, args=(sentinel,), daemon=True).start()


def _kill_group_after(sentinel: int) -> None:
    connection.wait([sentinel])
    os.killpg(0, signal.SIGKILL)


def adopt_orphans() -> None:
    """Become the parent of descendants that lose theirs, so that they count as children. Linux only."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1)


def memory() -> tuple[int, int] | None:
    """(address space, resident memory) of this process, bytes; None where the system does not tell."""
    statm = Path("/proc/self/statm")
    if not statm.exists():
        return None
    space, resident = statm.read_text(encoding="ascii").split()[:2]
    return int(space) * resource.getpagesize(), int(resident) * resource.getpagesize()


def limit_memory(megabytes: int) -> None:
    """Let this process add at most ``megabytes`` of address space to what it has; more fails to allocate. Linux only.

    Address space, not resident memory, because Linux enforces no limit on the latter. The share that the engines' code
    takes is already there when the limit is set, hence the addition.
    """
    present = memory()
    if present is None:
        return
    wanted = present[0] + megabytes * MEGABYTE
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (wanted if hard == resource.RLIM_INFINITY else min(wanted, hard), hard))


def forbid_core_files() -> None:
    """Write no core file on a crash: they are large, and land wherever the run was started."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def log_to(path: Path) -> None:
    """Send everything that this process prints, C code included, to a file, with a traceback on a crash or SIGUSR1;
    nowhere if there is no room for a file."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND, 0o644)
    except OSError:
        descriptor = os.open(os.devnull, os.O_WRONLY)
    _print_to(descriptor)
    faulthandler.enable(file=2)
    faulthandler.register(signal.SIGUSR1, file=2)


def close_log() -> None:
    """Flush standard output and error, and discard what is printed from here on."""
    _flush()
    _print_to(os.open(os.devnull, os.O_WRONLY))
    _flush()  # discard what a full disk did not take: a later log would get it


def _flush() -> None:
    """Empty the buffers of Python's and of C's output."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError):
            stream.flush()
    ctypes.CDLL(None).fflush(None)


def _print_to(descriptor: int) -> None:
    """Redirect standard output and error to this descriptor, and close it."""
    os.dup2(descriptor, 1)
    os.dup2(descriptor, 2)
    os.close(descriptor)


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
    lead_own_group()
    die_with_parent()
    forbid_core_files()
    adopt_orphans()
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
    log_to(Path(work.log_path))
    limit_memory(work.memory_limit_mb)
    pipe.send(Begun())
    last_word = _attempt(pipe, work)
    close_log()
    if isinstance(last_word, Returned):
        last_word = replace(last_word, clean=may_do_more and is_unchanged_since(before))
    try:
        pipe.send(last_word)
    except (pickle.PicklingError, AttributeError, TypeError, MemoryError) as error:
        pipe.send(_raised(error))
        return False
    return isinstance(last_word, Returned) and last_word.clean


def _attempt(pipe: Connection, work: ChildWork) -> Returned | Raised:
    """Call ``function(*args, **proxies)``, a proxy for each service, whose calls the parent answers."""
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
