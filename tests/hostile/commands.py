"""Running ``asset2sim`` as a user does: one command in a process of its own, or many short ones, forked from one."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from tests.hostile.case import KEY

TIMED_OUT = 124
"""Exit code of a command that was killed because it ran too long."""
MODULE = "flows.command"

FORKING = """
import importlib, json, os, signal, sys, time, traceback
main = importlib.import_module({module!r}).main
importlib.import_module("asset2sim.runs.check_request")
for line in sys.stdin:
    words, folder, limit_s = json.loads(line)
    child = os.fork()
    if child == 0:
        os.setsid()
        for number, name in ((0, os.devnull), (1, folder + "/stdout"), (2, folder + "/stderr")):
            os.dup2(os.open(name, os.O_RDWR | os.O_CREAT, 0o644), number)
        code = 1
        try:
            code = main(words)
        except SystemExit as error:
            code = error.code
        except BaseException:
            traceback.print_exc()
        sys.stdout.flush(), sys.stderr.flush()
        os._exit(code if isinstance(code, int) else 1)
    end = time.monotonic() + limit_s
    while (found := os.waitpid(child, os.WNOHANG))[0] == 0 and time.monotonic() < end:
        time.sleep(0.005)
    if found[0] == 0:
        os.killpg(child, signal.SIGKILL)
        os.waitpid(child, 0)
    print({timed_out} if found[0] == 0 else os.waitstatus_to_exitcode(found[1]), flush=True)
"""
"""A program that runs command lines as children of a process in which the command is loaded already."""


@dataclass(frozen=True)
class Ended:
    """How a command ended."""

    code: int
    stdout: str
    stderr: str


def environment() -> dict[str, str]:
    """The environment of a command: with a key that nothing may write down."""
    return {**os.environ, "OPENAI_API_KEY": KEY, "HOSTILE_KEY": KEY, "COLUMNS": "200"}


def run_command(words: Sequence[str], limit_s: float) -> Ended:
    """Run one command line, and kill it with all that it started after ``limit_s``, s."""
    program = [sys.executable, "-m", MODULE, *words]
    with subprocess.Popen(
        program, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment(),
        start_new_session=True,
    ) as process:  # fmt: skip
        try:
            out, said = process.communicate(timeout=limit_s)
            return Ended(process.returncode, out.decode(errors="replace"), said.decode(errors="replace"))
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            out, said = process.communicate()
            return Ended(TIMED_OUT, out.decode(errors="replace"), said.decode(errors="replace"))


class Forked:
    """Runs short command lines, one after the other."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self._process = process

    def run(self, words: Sequence[str], folder: Path, limit_s: float) -> Ended:
        """Run one command line; what it prints is kept in ``folder``."""
        assert self._process.stdin is not None and self._process.stdout is not None
        folder.mkdir(parents=True)
        self._process.stdin.write(f"{json.dumps([list(words), str(folder), limit_s])}\n")
        self._process.stdin.flush()
        code = int(self._process.stdout.readline() or "1")
        texts = [(folder / name).read_text(encoding="utf-8", errors="replace") for name in ("stdout", "stderr")]
        return Ended(code, *texts)


@contextmanager
def forked_commands() -> Iterator[Forked]:
    """What runs short command lines within the block."""
    program = [sys.executable, "-c", FORKING.format(module=MODULE, timed_out=TIMED_OUT)]
    with subprocess.Popen(
        program, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment(), encoding="utf-8"
    ) as process:
        yield Forked(process)
        assert process.stdin is not None
        process.stdin.close()
