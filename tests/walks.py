"""The walks through the documentation: which blocks of commands each runs, in order, in a folder that looks like a
fresh checkout; nothing is done that is not written there. Each is a file of tests: they spread over processes."""

import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from tests.doc_blocks import PAGES, Block, blocks, checkout, run_block
from tests.processes import free_port

LIMIT_S = 400.0
INTERRUPT, INTERRUPT_EARLY = "INT 15 ", "INT 3 "
"""When nightly.md interrupts a run, s: of these few samples, it would be over by then on a quick machine."""
REAL = ("*--force*", "'refine data/raw --out data/refined'")
"""Patterns of the shell for what is never at hand: the command that nightly.md interrupts, which would be done, and the
first one of README.md, which shows that a program of its own does the same."""
PLANTED = ("planted_missing_mesh", "planted_not_xml")
SAMPLES = ("laptop_silver", "box_wooden", *PLANTED)
BLOCKS = {(block.page, block.number): block for page in PAGES for block in blocks(page)}

FIRST = ("README.md", "asset2sim refine data/raw --out data/refined --dry-run")
"""Where everybody begins."""
NIGHTLY = ("README.md", "make nightly")
LOADING = [
    ("README.md", "from asset2sim.load import describe, load"),
    ("load.md", "from asset2sim.load import describe, load"),
    ("load.md", "import mujoco"),
    ("load.md", "import numpy"),
]
DATA_PERSON = [
    ("README.md", "asset2sim failures"),
    ("catalog.md", "asset2sim failures"),
    ("report.md", "asset2sim report"),
    ("catalog.md", "from asset2sim.catalog.query import connect"),
    ("catalog.md", "import pandas"),
    ("catalog.md", "import intake"),
    ("catalog.md", "import mlflow"),
]
RESEARCHER = [
    ("data.md", "asset2sim refine data/raw --out refined --dry-run"),
    ("data.md", "printf 'asset_id,size_m"),
    ("data.md", "asset2sim check"),
    ("data.md", "asset2sim settings"),
]
MODELS = [
    ("models.md", "python -m tests.scripted_server"),
    ("models.md", "asset2sim record"),
    ("models.md", "asset2sim ask"),
    ("install.md", "asset2sim convert"),
]
ENGINEER = [
    ("nightly.md", "asset2sim refine data/raw --out nights --dry-run"),
    ("nightly.md", "asset2sim refine data/raw --out nights --min-success"),
]
WALKS = (FIRST, *LOADING, NIGHTLY, *DATA_PERSON, *RESEARCHER, *MODELS, *ENGINEER)
ELSEWHERE = {
    ("README.md", "make flow"): "`.ci/run` and the walks run what both targets run",
    ("README.md", "pip install"): "tests/wheel_alone.py: what pip installs checks and refines an object",
    ("README.md", "export GEMINI_API_KEY"): "a key: models.md's server stands for the provider",
    ("models.md", "export GEMINI_API_KEY"): "a key: models.md's server stands for the provider",
    ("nightly.md", "prefect work-pool"): "tests/test_flows_serve_nightly.py: prefect.yaml deploys to a work pool",
    ("nightly.md", "dask scheduler"): "tests/test_flows_faults.py: a scheduler and its workers, one killed",
    ("buckets.md", "export AWS_ACCESS_KEY_ID"): "tests/test_flows_remote.py: into a bucket of a server here",
    ("learn.md", "pip install"): "tests/test_gym_environment.py: needs what the extra installs",
    ("learn.md", "from asset2sim.gym import make_env"): "tests/test_gym_environment.py: runs these lines",
    ("learn.md", "asset2sim learn"): "lab/tests/test_gym_learn.py: the command over an output",
    ("learn.md", "from lab.learning.ppo import"): "lab/tests/test_gym_learn.py: loads a policy that it has trained",
    ("judged.md", "asset2sim rate"): "lab/tests/test_judged_rating_page.py: the page; lab/tests/test_judged_ratings.py",
    ("probes.md", "pip install"): "lab/tests/test_flows_probe.py: the command over an output",
    ("trials.md", "pip install"): "lab/tests/test_flows_record_motion.py: the command over an output",
    ("install.md", "asset2sim check"): "tests/test_tasks_check.py: the command on folders as they are",
    ("install.md", "docker build"): "tests/container_steps.py: the Dockerfile's steps; compose.yaml is not run",
    ("viewer.md", "asset2sim view"): "tests/test_viewer_page.py: the page is served, and a review shown by failures",
}
"""Blocks that no walk runs, and what runs the like."""


def block(page: str, start: str) -> Block:
    """The one block of a page that starts so."""
    (found,) = (item for item in BLOCKS.values() if item.page == page and item.text.startswith(start))
    return found


def command_at_hand(folder: Path, ready: Sequence[str]) -> Path:
    """A new folder with a program ``asset2sim`` that is ready, but for what is ``REAL``."""
    folder.mkdir()
    real = shlex.quote(str(Path(sys.executable).with_name("asset2sim")))
    program = folder / "asset2sim"
    program.write_text(
        f'#!/bin/sh\ncase "$*" in {"|".join(REAL)}) exec {real} "$@";; esac\n'
        f'exec {shlex.join(ready)} -m flows.command "$@"\n',
        encoding="utf-8",
    )
    program.chmod(0o755)
    return folder


class Checkout(NamedTuple):
    """A folder that looks like a checkout, and what commands in it find in their environment."""

    folder: Path
    environment: dict[str, str]

    def at_hand(self, ready: Sequence[str]) -> "Checkout":
        """The same where ``asset2sim`` is a command that is ready, but for ``REAL``."""
        programs = command_at_hand(self.folder.with_name("programs"), ready)
        path = f"{programs}{os.pathsep}{self.environment['PATH']}"
        return self._replace(environment={**self.environment, "PATH": path})

    def walk(self, *steps: tuple[str, str]) -> list[str]:
        """Run the blocks in order; what each printed."""
        replaced = {"8000": str(free_port()), INTERRUPT: INTERRUPT_EARLY}
        return [run_block(block(*step), self.folder, self.environment, replaced, LIMIT_S) for step in steps]


def fresh(place: Path, **more: str) -> Checkout:
    """A checkout as it was cloned, with some of the samples, below ``place``; ``more`` stands in its environment."""
    folder = checkout(place / "my checkout", SAMPLES)
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return Checkout(folder, {"PREFECT_HOME": str(place / "prefect"), "PYTHONPATH": str(folder), "PATH": path, **more})
