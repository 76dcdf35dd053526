"""Traces that work leaves in its process, which decides whether the process may be given more."""

import os
import threading
from dataclasses import dataclass
from pathlib import Path

from asset2sim.experiments.isolation.child_setup import MEGABYTE, memory

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
