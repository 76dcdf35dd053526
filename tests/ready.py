"""Commands forked from a process that has loaded what they load, for tests of what a command does: a run started anew
takes 7 s of a core more, nearly all of them for imports. Fixture: ``ready``.

``[*ready, "-m", "flows.command", "refine", …]`` or ``[*ready, "script.py", …]`` stands for ``[sys.executable, …]``:
standard streams, environment, folder, exit code, Ctrl-C and SIGTERM are those of the real thing. That a program of its
own does the same is what test_project_walks shows.
"""

import atexit
import ctypes
import importlib
import json
import os
import runpy
import select
import signal
import socket
import subprocess
import sys
import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing import connection, forkserver, resource_tracker
from pathlib import Path
from typing import IO, Any

import pytest

from asset2sim.runs.plan.content_hash import shared_hash
from schemas.settings import Settings
from tests.assets import ROOT
from tests.of_all import folder_of_all, one_of_all
from tests.processes import MARK, wait_until

MODULES = (
    *("flows.command", "flows.refine_dataset", "flows.serve_nightly", "flows.show", "flows.local", "flows.hand_on"),
    *("mlflow.tracking", "mlflow.store.tracking.sqlalchemy_store", "distributed", "litellm", "tests.faulty"),
    *("asset2sim.runs.check_request", "asset2sim.report.site", "asset2sim.experiments.isolation.preload"),
)
"""Modules that commands load; the last are those of each command's fork server."""
MARK_BYTES = 64
"""Room for the mark of a test, by which strays are found."""
CLIENT = """
import array, json, os, signal, socket, sys
place, *words = sys.argv[1:]
link = socket.socket(socket.AF_UNIX)
link.connect(place)
told = json.dumps([words, os.getcwd(), dict(os.environ)]).encode()
link.sendmsg([len(told).to_bytes(4, "big")], [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", [0, 1, 2]))])
link.sendall(told)
pid = int.from_bytes(link.recv(4, socket.MSG_WAITALL), "big")
for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
    signal.signal(number, lambda number, _: os.kill(pid, number))
code = int.from_bytes(link.recv(4, socket.MSG_WAITALL), "big", signed=True)
if code < 0:
    code != -signal.SIGKILL and signal.signal(-code, signal.SIG_DFL)
    os.kill(os.getpid(), -code)
os._exit(code)
"""
"""A program that has a command line run by the process at a socket, and stands for it: it hands signals on, and ends as
the command does; killed, it takes the command along."""


getenv = ctypes.CDLL(None).getenv
getenv.restype = ctypes.c_void_p


@pytest.fixture(scope="session")
def ready(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[str]]:
    """The first words of a command line, in place of Python's."""
    with ready_in(folder_of_all(tmp_path_factory, "ready-of-all")) as words:
        yield words


@contextmanager
def ready_in(home: Path) -> Iterator[list[str]]:
    """The first words of a command line, within the block, of a process in a folder that others may use too."""
    home.mkdir(parents=True, exist_ok=True)
    with one_of_all(home, lambda alive: started(home, alive), answers) as place:
        yield [sys.executable, "-SEc", CLIENT, place]


def started(home: Path, alive: IO[bytes]) -> str:
    """The socket of a new process that has loaded everything."""
    place = home / "socket"
    place.unlink(missing_ok=True)
    with (home / "log").open("wb") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", "tests.ready", str(place)], cwd=ROOT, stdin=alive, stdout=log, stderr=log,
            start_new_session=True, env={**os.environ, MARK: "-" * MARK_BYTES},
        )  # fmt: skip
    assert wait_until(lambda: process.poll() is not None or answers(str(place)), 900.0)
    assert process.poll() is None, (home / "log").read_text(encoding="utf-8")
    return str(place)


def answers(place: str) -> bool:
    with socket.socket(socket.AF_UNIX) as link:
        return link.connect_ex(place) == 0


def serve(listener: socket.socket) -> None:
    """Fork for every client until standard input ends. Returns in each fork, which is set up as it asks."""
    links: dict[int, socket.socket] = {}
    while True:
        watched: list[Any] = [0, listener, *links.values()]
        heard, _, _ = select.select(watched, [], [], 0.02 if links else None)
        if 0 in heard:
            os._exit(0)
        for pid in [pid for pid, link in links.items() if over(pid, link, gone=link in heard)]:
            links.pop(pid).close()
        if listener in heard:
            link = listener.accept()[0]
            head, streams, _, _ = socket.recv_fds(link, 4, 3)
            if not head:  # one that asks whether anybody listens
                continue
            told = link.recv(int.from_bytes(head, "big"), socket.MSG_WAITALL)
            pid = os.fork()
            if pid == 0:
                for held in (listener, *links.values(), link):
                    held.close()
                return set_up(streams, *json.loads(told))
            for stream in streams:
                os.close(stream)
            links[pid] = link
            link.sendall(pid.to_bytes(4, "big"))


def over(pid: int, link: socket.socket, *, gone: bool) -> bool:
    """Whether a fork has ended; its client is told how, and takes it along where it is gone."""
    if gone:
        with suppress(ProcessLookupError):
            os.killpg(pid, signal.SIGKILL)
    ended, status = os.waitpid(pid, os.WNOHANG)
    if ended:
        with suppress(OSError):
            link.sendall(os.waitstatus_to_exitcode(status).to_bytes(4, "big", signed=True))
    return bool(ended)


def set_up(streams: list[int], words: list[str], folder: str, environment: dict[str, str]) -> None:
    """Make this fork what a new process of the command line would be."""
    import dask
    from prefect.context import refresh_global_settings_context

    from asset2sim.models.gateway import environment as gateway
    from flows.server.server import prepare_environment

    os.setsid()
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
        os.close(stream)
    encoding = environment.get("PYTHONIOENCODING", "utf-8")
    sys.stdin = os.fdopen(0, encoding=encoding, closefd=False)
    sys.stdout = os.fdopen(1, "w", encoding=encoding, closefd=False)
    sys.stderr = os.fdopen(2, "w", 1, encoding, "backslashreplace", closefd=False)
    # The system shows what a process began with: there the mark is written over what keeps its room.
    ctypes.memmove(getenv(MARK.encode()), environment.get(MARK, "").ljust(MARK_BYTES, "-").encode(), MARK_BYTES)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    sys.argv = words
    # What was read when it was loaded.
    gateway._load_env_files_once.cache_clear()
    prepare_environment()
    refresh_global_settings_context()
    dask.config.refresh()
    fork_server()


def fork_server() -> None:
    """Give this process its fork server: a fork of it, in which the engines are loaded."""
    from asset2sim.experiments.isolation.children import ONE_THREAD

    server: Any = forkserver._forkserver
    resource_tracker.ensure_running()
    with socket.socket(socket.AF_UNIX) as listener:
        server._forkserver_address = connection.arbitrary_address("AF_UNIX")  # type: ignore[attr-defined]
        listener.bind(server._forkserver_address)
        listener.listen()
        alive, server._forkserver_alive_fd = os.pipe()
        server._forkserver_pid = os.fork()
        if server._forkserver_pid:
            os.close(alive)
            return
        os.close(server._forkserver_alive_fd)
        os.environ.update(ONE_THREAD)
        signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT,))
        with suppress(SystemExit):
            forkserver.main(listener.detach(), alive, [])
        os._exit(0)


def run() -> int:
    """Run the module of ``-m MODULE …``, or a script. Returns the exit code."""
    if sys.argv[0] != "-m":
        runpy.run_path(sys.argv[0], run_name="__main__")
        return 0
    sys.argv.pop(0)
    return int(importlib.import_module(sys.argv[0]).main())


def main() -> None:
    """Serve at a socket; in a fork, run what was asked for and end as a program ends."""
    for name in MODULES:
        importlib.import_module(name)
    shared_hash(Settings(), "")  # hashes the sources, once for all
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(sys.argv[1])
        listener.listen()
        serve(listener)
    code = 1
    try:
        code = run()
    except SystemExit as error:
        code = error.code if isinstance(error.code, int) else int(error.code is not None)
    except BaseException as error:
        traceback.print_exc()
        code = -signal.SIGINT if isinstance(error, KeyboardInterrupt) else 1
    threading._shutdown()  # type: ignore[attr-defined]
    atexit._run_exitfuncs()
    with suppress(OSError):
        sys.stdout.flush()
        sys.stderr.flush()
    if code < 0:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGINT)
    os._exit(code)


if __name__ == "__main__":
    main()
