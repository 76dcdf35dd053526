"""The fork server that starts the children: one per process, without the caller's ``__main__``."""

import multiprocessing
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerContext, ForkServerProcess

from asset2sim.runs.isolation.child import child_main
from schemas.errors import UsageError

ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""One asset is one thread: the workers share the cores already, and a thread pool does not survive a fork."""

PROCESS_LOCK = threading.Lock()
"""Held to start, join or poll a child: two threads that poll one fork server child can lose its exit code."""


def warm_up() -> None:
    """Start the fork server and let it load the engines while the caller does something else. Returns at once."""
    with PROCESS_LOCK, _environment(ONE_THREAD), _without_main():
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
        with PROCESS_LOCK, _environment(ONE_THREAD), _without_main():
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
    context.set_forkserver_preload(["asset2sim.runs.isolation.preload"])
    return context


@contextmanager
def _environment(extra: dict[str, str]) -> Iterator[None]:
    """Set environment variables for the time of a block; the fork server takes a copy when it starts."""
    before = {name: os.environ.get(name) for name in extra}
    os.environ.update(extra)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


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
