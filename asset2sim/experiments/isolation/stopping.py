"""Stopping every child of one owner at once, as Ctrl-C must. An owner is a run, named by its output folder."""

import os
import signal
import threading
from contextlib import suppress

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
