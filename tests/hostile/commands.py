"""Running ``asset2sim`` as a user does, one command line at a time."""

import os
import signal
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass

from tests.hostile.case import KEY

TIMED_OUT = 124
"""Exit code of a command that was killed because it ran too long."""
MODULE = "flows.command"


@dataclass(frozen=True)
class Ended:
    """How a command ended."""

    code: int
    stdout: str
    stderr: str


def environment() -> dict[str, str]:
    """The environment of a command: with a key that nothing may write down."""
    return {**os.environ, "OPENAI_API_KEY": KEY, "HOSTILE_KEY": KEY, "COLUMNS": "200"}


def run_command(start: Sequence[str], words: Sequence[str], limit_s: float) -> Ended:
    """Run one command line, ``start`` in Python's place, and kill it with all that it started after ``limit_s``, s."""
    with subprocess.Popen(
        [*start, "-m", MODULE, *words], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        env=environment(), start_new_session=True,
    ) as process:  # fmt: skip
        try:
            out, said = process.communicate(timeout=limit_s)
            return Ended(process.returncode, out.decode(errors="replace"), said.decode(errors="replace"))
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            out, said = process.communicate()
            return Ended(TIMED_OUT, out.decode(errors="replace"), said.decode(errors="replace"))
