"""Programs that run until they are interrupted, and end together or each by itself."""

import os
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress

from schemas.errors import Asset2SimError

STOP_LIMIT_S = 10.0
"""Time that a program gets to end by itself, s."""


class ProgramError(Asset2SimError):
    """A program ended by itself."""


def run_together(commands: Mapping[str, Sequence[str]], stop_limit_s: float = STOP_LIMIT_S) -> None:
    """Run programs, name → command line, until interrupted; raises ``ProgramError`` when one ends by itself. Neither
    they nor what they start survives this call: they are asked to end, and killed after ``stop_limit_s`` s."""
    # Sessions of their own: a program may start others, and Ctrl-C must reach none of them twice.
    running = {name: subprocess.Popen(command, start_new_session=True) for name, command in commands.items()}
    try:
        while True:
            for name, process in running.items():
                try:
                    code = process.wait(timeout=0.5)
                except subprocess.TimeoutExpired:
                    continue
                raise ProgramError(f"{name} ended with exit code {code}; what it said is above")
    finally:
        _stop(list(running.values()), stop_limit_s)


def run_side_by_side(commands: Mapping[str, Sequence[str]], stop_limit_s: float = STOP_LIMIT_S) -> None:
    """Run programs, name → command line, until interrupted or all have ended; one that ends by itself is said on
    standard error and leaves the others at work. Raises ``ProgramError`` when the last one has ended. Neither they nor
    what they start survives this call."""
    running = {name: subprocess.Popen(command, start_new_session=True) for name, command in commands.items()}
    left = dict(running)
    try:
        while left:
            for name, process in list(left.items()):
                with suppress(subprocess.TimeoutExpired):
                    code = process.wait(timeout=0.5)
                    del left[name]
                    on = f"; {', '.join(left)} goes on" if left else ""
                    sys.stderr.write(f"asset2sim: {name} ended with exit code {code}; what it said is above{on}\n")
                    sys.stderr.flush()
    finally:
        _stop(list(running.values()), stop_limit_s)
    raise ProgramError("nothing is served any more")


def _stop(processes: Sequence[subprocess.Popen[bytes]], limit_s: float) -> None:
    for process in processes:
        _signal(process, signal.SIGTERM)
    for process in processes:
        with suppress(subprocess.TimeoutExpired):
            process.wait(timeout=limit_s)
    # The whole group once more: a program may end before what it started.
    for process in processes:
        _signal(process, signal.SIGKILL)
        process.wait()


def _signal(process: subprocess.Popen[bytes], number: signal.Signals) -> None:
    with suppress(ProcessLookupError):
        os.killpg(process.pid, number)
