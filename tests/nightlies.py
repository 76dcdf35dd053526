"""Nightlies as processes, for tests: what they refine takes seconds, or waits for a model that is silent."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from tests.assets import RAW, ROOT
from tests.model_server import Reply
from tests.processes import wait_until
from tests.scripted_server import Asked, competent, scripted

LIMIT_S = 900.0
"""Time that each step may take, s: a busy machine starts Prefect's server in 30."""
QUICK = ["--engines", "pybullet", "--no-interaction", "--no-views", "--workers", "2"]


@dataclass(frozen=True)
class Model:
    """A model that answers for ``box_wooden``, and for nothing else while ``silent`` is set."""

    options: list[str]
    silent: threading.Event


@contextmanager
def model() -> Iterator[Model]:
    """Serve such a model."""
    silent = threading.Event()

    def answer(asked: Asked) -> Reply:
        return Reply(delay_s=600.0) if silent.is_set() and asked.asset_id != "box_wooden" else competent(asked)

    with scripted(answer) as server:
        yield Model(["--model", "openai/scripted", "--api-base", server.api_base], silent)


@dataclass(frozen=True)
class Nightly:
    """The command line of a nightly, its environment, and the folder of its OUT, its log and its hook's output."""

    words: list[str]
    environment: dict[str, str]
    folder: Path

    @property
    def out(self) -> Path:
        return self.folder / "out"

    @property
    def log(self) -> str:
        """The output of the serving process so far."""
        return (self.folder / "log").read_text(encoding="utf-8")

    @property
    def told(self) -> list[str]:
        """What the hook was told, a line a night: exit code, assets that passed, report, error, warnings."""
        path = self.folder / "told"
        return path.read_text(encoding="utf-8").splitlines() if path.exists() else []

    def kept(self) -> int:
        """Number of record files that the running night has written."""
        return len(list((self.out / ".cache" / "records").glob("*")))

    def now(self, ready: Sequence[str], *more: str) -> "subprocess.CompletedProcess[str]":
        """Run the nightly with ``--now`` to its end, ``ready`` in Python's place."""
        return subprocess.run(
            [*ready, *self.words[1:], "--now", *more], cwd=ROOT, env=self.environment, text=True, capture_output=True,
            timeout=LIMIT_S,
        )  # fmt: skip


def make_nightly(folder: Path, environment: dict[str, str], *options: str) -> Nightly:
    """A nightly of some samples into ``folder/out``, whose hook writes to ``folder/told``."""
    said = ":".join(f"$ASSET2SIM_{name}" for name in ("EXIT", "OK", "REPORT", "ERROR", "WARNINGS"))
    words = [sys.executable, "-m", "flows.command", "nightly", str(RAW), "--out", str(folder / "out"), *QUICK]
    return Nightly([*words, *options, "--hook", f"echo \"{said}\" >> '{folder}/told'"], environment, folder)


@contextmanager
def served(nightly: Nightly, python: Sequence[str] = (sys.executable,)) -> Iterator["subprocess.Popen[bytes]"]:
    """The serving process, once it has said when it runs next; ``python`` are the first words of its command."""
    with (nightly.folder / "log").open("wb") as file:
        process = subprocess.Popen(
            [*python, *nightly.words[1:]], cwd=ROOT, env=nightly.environment, stdout=file, stderr=file,
            start_new_session=True,
        )  # fmt: skip
    try:
        assert wait_until(lambda: process.poll() is not None or "deployment run" in nightly.log, LIMIT_S), nightly.log
        assert process.poll() is None, nightly.log
        yield process
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
