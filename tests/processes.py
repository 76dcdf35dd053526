"""Finding, killing and waiting for other processes on this machine, and ports for new ones."""

import contextlib
import os
import signal
import socket
import time
from collections.abc import Callable
from pathlib import Path

MARK = "ASSET2SIM_TEST_MARK"
"""The variable with a word in the environment of everything that a test starts, by which strays are found."""


def alive(mark: str) -> list[str]:
    """The command lines of running processes that carry the mark in their environment."""
    return list(marked(mark).values())


def marked(mark: str) -> dict[int, str]:
    """Process id → command line of running processes that carry the mark in their environment."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if mark.encode() in (folder / "environ").read_bytes():
                words = (folder / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
                found[int(folder.name)] = words
        except (FileNotFoundError, ProcessLookupError, PermissionError):
            continue
    return found


def gone(pid: int) -> bool:
    """Whether a process has ended; one that nobody has reaped yet counts as ended."""
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()[0] == "Z"
    except FileNotFoundError:
        return True


def kill_marked(mark: str) -> None:
    """Kill what a test has left running."""
    for pid in marked(mark):
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


def wait_until(condition: Callable[[], bool], seconds: float) -> bool:
    """Whether the condition comes true within that time."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.1)
    return condition()


def free_port() -> int:
    """A free TCP port of 127.0.0.1."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        return int(free.getsockname()[1])
