"""Functions that crash, hang or raise, for the tests of isolation; importable by name, to run in a child process."""

import ctypes
import errno
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from multiprocessing import parent_process
from pathlib import Path

from asset2sim.runs.asset_attempt import failed_record
from schemas.asset import AssetRecord, AssetRef
from schemas.errors import AssetError
from schemas.request import ModelAnswer, ModelRequest
from schemas.settings import Settings
from schemas.vocabulary import FailureMode, Status


def double(number: int) -> int:
    return 2 * number


def segfault() -> None:
    ctypes.string_at(0)


def abort() -> None:
    os.abort()


def vanish() -> None:
    os._exit(3)


def sleep_for(seconds: float) -> str:
    time.sleep(seconds)
    return "awake"


def hang_holding_the_interpreter() -> None:
    """Spin in C without ever giving up the interpreter lock: no Python signal handler and no thread gets to run."""
    ctypes.PyDLL(None).pause()
    while True:
        ctypes.PyDLL(None).pause()


def eat_memory(megabytes: int) -> int:
    return len(bytearray(megabytes * 1024 * 1024))


def raise_key_error() -> None:
    raise KeyError("joint_7")


def raise_asset_error() -> None:
    raise AssetError(FailureMode.MISSING_MESH, "missing_mesh", "link 'lid' needs lid.obj", link="lid")


def meet_a_full_disk() -> None:
    """A full disk, as a library reports it that hides the OSError behind an error of its own."""
    try:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "mesh.obj")
    except OSError:
        raise ValueError("cannot export the mesh")  # noqa: B904 - as libraries do


def return_the_unpicklable() -> Callable[[], None]:
    return lambda: None


def chatter_from_c() -> None:
    libc = ctypes.CDLL(None)
    libc.puts(b"a console line from C")
    libc.fflush(None)
    print("a line from Python")


def ask_twice(number: int, *, ask: Callable[[int], int]) -> int:
    return ask(number) + ask(number + 1)


def start_a_grandchild_and_hang(pid_file: str) -> None:
    grandchild = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
    with open(pid_file, "w", encoding="ascii") as file:
        file.write(f"{os.getpid()} {grandchild.pid}")
    time.sleep(600)


def own_pid() -> int:
    return os.getpid()


def kill_fork_server() -> int:
    os.kill(os.getppid(), signal.SIGKILL)
    return os.getpid()


KEPT: list[object] = []
"""Objects that a function leaves behind in its process."""


def leave_a_thread() -> int:
    thread = threading.Thread(target=time.sleep, args=(60.0,), daemon=True)
    thread.start()
    return os.getpid()


def leave_a_process() -> int:
    KEPT.append(subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"]))
    return os.getpid()


def leave_an_orphan() -> tuple[int, int]:
    """The ids of this process and of a grandchild whose parent has ended."""
    script = "import subprocess; print(subprocess.Popen(['sleep', '600'], stdout=subprocess.DEVNULL).pid)"
    done = subprocess.run([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, check=True)
    return os.getpid(), int(done.stdout)


def leave_a_file_open() -> int:
    KEPT.append(os.open(os.devnull, os.O_RDONLY))
    return os.getpid()


def leave_the_folder() -> int:
    os.chdir("/")
    return os.getpid()


def leave_a_variable() -> int:
    os.environ["A2S_LEFT_BEHIND"] = "1"
    return os.getpid()


def leave_memory(megabytes: int) -> int:
    KEPT.append(b"x" * (megabytes * 1024 * 1024))
    return os.getpid()


def leave_half_a_line() -> int:
    """Leave half a line in the buffer of C's standard output."""
    ctypes.CDLL(None).printf(b"half a line")
    return os.getpid()


def thread_count() -> int:
    return len(os.listdir("/proc/self/task"))


def loaded_modules() -> set[str]:
    return set(sys.modules)


def ignore_every_signal_and_hang() -> None:
    for name in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(name, signal.SIG_IGN)
    time.sleep(600)


def no_pipeline(
    ref: AssetRef, out: Path, settings: Settings, *, ask: Callable[[ModelRequest], ModelAnswer]
) -> AssetRecord:
    """A pipeline that does nothing and succeeds."""
    record = failed_record(ref, settings, FailureMode.NONE, "nothing was asked")
    return record.model_copy(update={"status": Status.OK, "findings": ()})


Ask = Callable[[ModelRequest], ModelAnswer]


def quick_or_sleepy(ref: AssetRef, out: Path, settings: Settings, *, ask: Ask) -> AssetRecord:
    """Succeed at once, or, for an asset called ``sleepy…``, sleep with a child process of its own."""
    if ref.asset_id.startswith("sleepy"):
        start_a_grandchild_and_hang(str(out / f"{ref.asset_id}.pids"))
    return no_pipeline(ref, out, settings, ask=ask)


def crash_if_told(ref: AssetRef, out: Path, settings: Settings, *, ask: Ask) -> AssetRecord:
    """Crash or hang if the asset's id asks for it, else succeed."""
    if ref.asset_id.startswith("segfault"):
        segfault()
    if ref.asset_id.startswith("hang"):
        hang_holding_the_interpreter()
    return no_pipeline(ref, out, settings, ask=ask)


def kill_the_worker(ref: AssetRef, out: Path, settings: Settings, *, ask: Ask) -> AssetRecord:
    """Kill the Dask worker, every time, for an asset called ``murderous…``."""
    worker = parent_process()
    assert worker is not None and worker.pid is not None
    if ref.asset_id.startswith("murderous"):
        os.kill(worker.pid, signal.SIGKILL)
        time.sleep(60.0)
    return no_pipeline(ref, out, settings, ask=ask)
