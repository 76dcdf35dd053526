"""Set-up of a child process: its own process group, limits, a log file, and death with its parent."""

import contextlib
import ctypes
import faulthandler
import fcntl
import os
import resource
import signal
import sys
import threading
from multiprocessing import connection, parent_process
from pathlib import Path

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
