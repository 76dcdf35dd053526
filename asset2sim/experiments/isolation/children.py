"""Child processes: the fork server that starts them, one per process, and a pool of idle ones: libraries are faster in
a process that has used them (on 30 real objects of about 1 s each, a fresh process took 100 ms longer)."""

import atexit
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import connection, resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerContext, ForkServerProcess

from asset2sim.experiments.isolation.child import child_main
from asset2sim.experiments.isolation.pipe_messages import Begun, ChildWork
from schemas.errors import UsageError

ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""One asset is one thread: the workers share the cores already, and a thread pool does not survive a fork."""

PIPELINE_VARIABLE = "ASSET2SIM_PRELOAD"
"""Environment variable that names the module which the fork server loads besides the engines."""

PROCESS_LOCK = threading.Lock()
"""Held to start, join or poll a child: two threads that poll one fork server child can lose its exit code."""


_server_environment = dict(ONE_THREAD)


def preload(pipeline: str) -> None:
    """Let the fork server load the module of a pipeline, ``module:function``, when it starts; the first one counts."""
    _server_environment.setdefault(PIPELINE_VARIABLE, pipeline.partition(":")[0])


def warm_up(pipeline: str) -> None:
    """Start the fork server, which loads the engines and the pipeline meanwhile. Returns at once."""
    preload(pipeline)
    with PROCESS_LOCK, _environment(_server_environment), _without_main(), _without_interrupts():
        from multiprocessing import forkserver

        _context()
        forkserver.ensure_running()


def start_child() -> tuple[ForkServerProcess, Connection]:
    """Fork a child that waits for work (see ``child_main``); returns it with the parent's end of its pipe."""
    refuse_daemon()
    context = _context()
    parent_end, child_end = context.Pipe()
    process = context.Process(target=child_main, args=(child_end,))
    try:
        with PROCESS_LOCK, _environment(_server_environment), _without_main(), _without_interrupts():
            process.start()
    finally:
        child_end.close()
    return process, parent_end


def refuse_daemon() -> None:
    """Raise ``UsageError`` in a process that may have no children, as a Dask worker under a nanny is by default."""
    if multiprocessing.current_process().daemon:
        raise UsageError(
            "this Dask worker is a daemonic process and may not start the child process in which an asset runs; "
            "start it with DASK_DISTRIBUTED__WORKER__DAEMON=False in its environment, or with --no-nanny"
        )


def _context() -> ForkServerContext:
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["asset2sim.experiments.isolation.preload"])
    return context


@contextmanager
def _environment(extra: dict[str, str]) -> Iterator[None]:
    """Set environment variables for the time of a block; the fork server takes a copy when it starts."""
    before = {name: os.environ[name] for name in extra if name in os.environ}
    os.environ.update(extra)
    try:
        yield
    finally:
        for name in extra:
            del os.environ[name]
        os.environ.update(before)


@contextmanager
def _without_main() -> Iterator[None]:
    """Hide where ``__main__`` came from: a child would import it again, Prefect and all, and needs nothing of it."""
    main = sys.modules["__main__"]
    spec, file = getattr(main, "__spec__", None), getattr(main, "__file__", None)
    main.__spec__ = None
    if file is not None:
        del main.__file__
    try:
        yield
    finally:
        main.__spec__ = spec
        if file is not None:
            main.__file__ = file


@contextmanager
def _without_interrupts() -> Iterator[None]:
    """Block Ctrl-C for the time of a block, and for ever in the fork server if it starts there: interrupted while it
    loads the engines it would print where it was. An interruption is the parent's to answer."""
    # Where it has to start its own helper first, that unblocks the signal again.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT,))
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


BEGIN_LIMIT_S = 10.0
"""Time in which an idle child must say that it has begun, s; its pipe is closed after that, so it does nothing."""

_lock = threading.Lock()
_idle: list["Child"] = []


@dataclass(frozen=True)
class Child:
    """A child process, and this end of the pipe to it."""

    process: ForkServerProcess
    pipe: Connection

    @property
    def pid(self) -> int:
        """Its process id, which is that of its process group, too."""
        assert self.process.pid is not None, "a started process has an id"
        return self.process.pid


def start_work(work: ChildWork, *, fresh: bool) -> Child:
    """Give the work to an idle child, or to a new one if ``fresh`` or there is none, and return it. Raises
    ``UsageError`` where this process may not have children."""
    while not fresh and (child := _take()) is not None:
        # It may have ended while it was idle, at this very moment even: then the work has not begun.
        if _has_begun(child, work):
            return child
        child.pipe.close()
    child = Child(*start_child())
    with suppress(ConnectionError):  # the supervisor sees that the child has ended
        child.pipe.send(work)
    return child


def return_to_pool(child: Child) -> None:
    """Return a child that left no traces to the pool; it ends after ``child.IDLE_LIMIT_S`` without work."""
    with _lock:
        _idle.append(child)


@atexit.register
def end_idle() -> None:
    """End the idle children. Python's exit waits for every child: for idle ones, 5 s at a command's end."""
    with _lock:
        while _idle:
            _idle.pop().pipe.close()  # which ends it


def _take() -> Child | None:
    """The child that was idle for the shortest time, if there is one."""
    with _lock:
        while _idle:
            child = _idle.pop()
            # Ready where the child or its fork server has ended; without the server its exit code would be lost.
            if not connection.wait([child.process.sentinel], timeout=0.0):
                return child
            child.pipe.close()  # which ends it
    return None


def _has_begun(child: Child, work: ChildWork) -> bool:
    try:
        child.pipe.send(work)
        return child.pipe.poll(BEGIN_LIMIT_S) and isinstance(child.pipe.recv(), Begun)
    except (EOFError, ConnectionError):
        return False
