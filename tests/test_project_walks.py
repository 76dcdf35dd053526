"""Three people walk through the documentation: each block of commands that it shows is run, in order, in a folder that
looks like a fresh checkout; nothing is done that is not written there."""

import json
import socket
from pathlib import Path
from typing import NamedTuple

import pandas as pd
import pytest

from tests.doc_blocks import PAGES, Block, blocks, checkout, run_block

LIMIT_S = 400.0
INTERRUPT, INTERRUPT_EARLY = "INT 15 ", "INT 8 "
"""When nightly.md interrupts a run, s: of these few samples, it would be over by then on a quick machine."""
SAMPLES = ("laptop_silver", "box_wooden", "planted_missing_mesh", "planted_not_xml")
BLOCKS = {(block.page, block.number): block for page in PAGES for block in blocks(page)}
FIRST = ("README.md", "asset2sim refine data/raw --out data/refined --dry-run")
"""Where all three begin, once for all."""
RESEARCHER = [
    ("README.md", "from asset2sim.load import describe, load"),
    ("data.md", "asset2sim refine data/raw --out refined --dry-run"),
    ("data.md", "printf 'asset_id,size_m"),
    ("data.md", "asset2sim check"),
    ("data.md", "asset2sim settings"),
    ("load.md", "from asset2sim.load import describe, load"),
    ("load.md", "import mujoco"),
    ("load.md", "import numpy"),
    ("models.md", "python -m tests.scripted_server"),
    ("models.md", "asset2sim record"),
    ("models.md", "asset2sim ask"),
    ("install.md", "asset2sim convert"),
]
NIGHTLY = ("README.md", "make nightly")
ENGINEER = [
    ("nightly.md", "asset2sim refine data/raw --out nights --dry-run"),
    ("nightly.md", "asset2sim refine data/raw --out nights --min-success"),
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
    (found,) = (item for item in BLOCKS.values() if item.page == page and item.text.startswith(start))
    return found


def free_port() -> str:
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        return str(sock.getsockname()[1])


class Checkout(NamedTuple):
    """A folder that looks like a checkout, and what commands in it find in their environment."""

    folder: Path
    environment: dict[str, str]

    def walk(self, *steps: tuple[str, str], **more: str) -> list[str]:
        """Run the blocks in order; what each printed. ``more`` is added to the environment."""
        replaced, environment = {"8000": free_port(), INTERRUPT: INTERRUPT_EARLY}, self.environment | more
        return [run_block(block(*step), self.folder, environment, replaced, LIMIT_S) for step in steps]


@pytest.fixture(scope="module")
def refined(tmp_path_factory: pytest.TempPathFactory) -> Checkout:
    """A checkout after the README's first commands, which start a Prefect server of their own."""
    place = tmp_path_factory.mktemp("walks")
    folder = checkout(place / "my checkout", SAMPLES)
    made = Checkout(folder, {"PREFECT_HOME": str(place / "prefect"), "PYTHONPATH": str(folder)})
    made.walk(FIRST)
    return made


def test_every_block_is_run_by_a_walk_or_says_what_runs_the_like() -> None:
    known = {block(*step)[:2] for step in (FIRST, *RESEARCHER, NIGHTLY, *ENGINEER, *DATA_PERSON, *ELSEWHERE)}
    assert set(BLOCKS) == known
    for reason in ELSEWHERE.values():
        for word in reason.replace(":", " ").split():
            assert not word.startswith("tests/") or Path(__file__).parents[1].joinpath(word).is_file(), word


@pytest.mark.system
def test_the_researcher(refined: Checkout, prefect_server: str) -> None:
    folder, said = refined.folder, refined.walk(*RESEARCHER, PREFECT_API_URL=prefect_server)
    overlay = json.loads((folder / "one/assets/laptop_silver/overlay.json").read_text(encoding="utf-8"))
    assert "0.3" in json.dumps(overlay), "30 cm wide"
    assert "joint_0" in said[0]
    assert pd.read_parquet(folder / "asked/catalog/model_calls.parquet")["model"].eq("openai/scripted").all()
    asked, again = (folder / name / "assets/laptop_silver/overlay.json" for name in ("asked", "again"))
    assert again.read_bytes() == asked.read_bytes()
    assert (folder / "mine/questions/laptop_silver/front.png").is_file()
    converted = {path.suffix for path in (folder / "data/converted/assets/box_wooden").iterdir()}
    assert {".urdf", ".xml"} < converted and converted & {".usd", ".usda", ".usdc"}


@pytest.mark.system
def test_the_engineer(refined: Checkout, prefect_server: str) -> None:
    """The first night starts a Prefect server of its own, the next ones use one that stays."""
    (night,) = refined.walk(NIGHTLY)
    assert "unchanged" in night
    folder, said = refined.folder, refined.walk(*ENGINEER, PREFECT_API_URL=prefect_server)
    assert (folder / "alert.txt").read_text(encoding="utf-8").startswith("done") or "ok" in said[0]
    assert "exit code 3" in said[1] and "exit code 130" in said[1]
    assets = pd.read_parquet(folder / "nights/catalog/assets.parquet")
    assert set(assets["asset_id"]) == set(SAMPLES)


@pytest.mark.system
def test_the_data_person(refined: Checkout) -> None:
    folder, said = refined.folder, refined.walk(*DATA_PERSON)
    assert "asset_id,mass_kg" in (folder / "masses.csv").read_text(encoding="utf-8")
    assert (folder / "data/refined/report/objects/laptop_silver/before.webp").is_file()
    assert "[kg]" in said[3] or "comment" in said[3]
    assert "laptop_silver" in said[5]
    assert "FINISHED" in said[6]
