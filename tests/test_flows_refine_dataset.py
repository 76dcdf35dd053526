"""The whole run through Prefect and Dask, as a user starts it, and what Ctrl-C and a kill leave behind."""

import os
import shutil
import signal
import subprocess
import sys
import uuid
from collections.abc import Iterator
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from asset2sim.runs.plan.records import RECORDS_FOLDER
from tests.assets import RAW, ROOT
from tests.prefect_server import with_tables
from tests.processes import MARK, alive, wait_until

pytestmark = pytest.mark.system

LIMIT_S = 900
LEAST_QUICK = 4
"""Quick assets of six that are done when both workers sleep: what Dask is given at once it starts in any order."""

START = """
import functools, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell starts what runs in its background without it
import flows.command
import flows.refine_dataset as module
module.refine_dataset = functools.partial(module.refine_dataset, pipeline="tests.crashers:quick_or_sleepy")
sys.exit(flows.command.main(sys.argv[1:]))
"""
"""The command with a pipeline whose assets take no time, or all of it."""


@pytest.fixture(scope="module")
def prefect_home(tmp_path_factory: pytest.TempPathFactory, prefect_tables: Path) -> Path:
    """One Prefect database for the module: making one takes seconds."""
    return with_tables(tmp_path_factory.mktemp("prefect"), prefect_tables)


@pytest.fixture
def mark() -> str:
    return f"asset2sim-test-{uuid.uuid4().hex}"


@pytest.fixture
def environment(prefect_home: Path, mark: str) -> dict[str, str]:
    return {**os.environ, "PREFECT_HOME": str(prefect_home), MARK: mark}


def statuses(out: Path) -> dict[str, str]:
    table = pq.read_table(out / "catalog" / "assets.parquet")
    return dict(zip(table["asset_id"].to_pylist(), table["status"].to_pylist(), strict=True))


@pytest.fixture
def dataset(tmp_path: Path) -> Path:
    """Assets that are done at once, then two that never are. Their folders are never opened."""
    data = tmp_path / "data"
    data.mkdir()
    ids = [*(f"quick-{number}" for number in range(6)), "sleepy-1", "sleepy-2", "late-1"]
    rows = "".join(f"{asset_id},{asset_id}\n" for asset_id in ids)
    (data / "manifest.csv").write_text(f"asset_id,path\n{rows}", encoding="utf-8")
    return data


@pytest.fixture
def running(dataset: Path, tmp_path: Path, environment: dict[str, str]) -> Iterator[subprocess.Popen[str]]:
    """A run that has two children asleep, each with a child of its own."""
    out = tmp_path / "out"
    command = [sys.executable, "-c", START, "refine", str(dataset), "--out", str(out), "--workers", "2"]
    process = subprocess.Popen(
        command,
        cwd=ROOT,
        env=environment,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
    )
    asleep = [out / f"sleepy-{number}.pids" for number in (1, 2)]

    def at_work() -> bool:
        kept = list((out / RECORDS_FOLDER).glob("*.json"))  # of the quick ones
        return len(kept) >= LEAST_QUICK and all(path.exists() for path in asleep)

    started = wait_until(lambda: process.poll() is not None or at_work(), LIMIT_S)
    assert started, "the run did not get to its assets"
    assert process.poll() is None, process.communicate()
    yield process
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def test_an_interrupted_run_publishes_what_finished_and_leaves_no_process(
    running: subprocess.Popen[str], tmp_path: Path, mark: str
) -> None:
    # To the whole group, as a service manager does; Ctrl-C is a command of nightly.md (test_project_walk_nights).
    os.killpg(running.pid, signal.SIGTERM)
    output, errors = running.communicate(timeout=LIMIT_S)
    assert running.returncode == 130, errors
    published = statuses(tmp_path / "out")
    assert f"interrupted; {len(published)} finished assets are in the catalog" in errors
    assert "Traceback" not in errors
    assert len(published) >= LEAST_QUICK and set(published.values()) == {"ok"}
    assert published.keys() <= {f"quick-{number}" for number in range(6)}
    assert all(name in output for name in published)
    assert pq.read_table(tmp_path / "out" / "catalog" / "runs.parquet")["outcome"].to_pylist() == ["interrupted"]
    assert wait_until(lambda: not alive(mark), 60.0), alive(mark)


def test_a_killed_run_leaves_no_process(running: subprocess.Popen[str], tmp_path: Path, mark: str) -> None:
    running.kill()
    running.communicate(timeout=LIMIT_S)
    assert wait_until(lambda: not alive(mark), 60.0), alive(mark)
    assert not (tmp_path / "out" / "catalog").exists()


def test_a_sample_and_a_missing_one_end_to_end(
    tmp_path: Path, environment: dict[str, str], prefect_server: str, mark: str, ready: list[str]
) -> None:
    rows = (RAW / "manifest.csv").read_text(encoding="utf-8").splitlines()
    data = tmp_path / "my data"
    asset_id, _, folder, *_ = rows[1].split(",")
    shutil.copytree(RAW / folder, data / folder)
    lost = "lost,Box,Box/lost,sample,A box."
    (data / "manifest.csv").write_text("\n".join([*rows[:2], lost]) + "\n", encoding="utf-8")
    out = tmp_path / "my out"
    words = ["refine", str(data), "--out", str(out), "--workers", "2", "--strict"]
    done = subprocess.run(
        [*ready, "-m", "flows.command", *words], cwd=ROOT, env={**environment, "PREFECT_API_URL": prefect_server},
        text=True, capture_output=True, timeout=LIMIT_S,
    )  # fmt: skip
    assert done.returncode == 1, done.stderr
    assert statuses(out) == {asset_id: "ok", "lost": "failed"}
    assert asset_id in done.stdout and "lost" in done.stdout
    names = {path.name for path in (out / "assets" / asset_id).iterdir()}
    assert {"mobility.urdf", "overlay.json", "measurement.json", "views"} <= names
    assert (out / "mlflow.db").exists()
    assert wait_until(lambda: not alive(mark), 60.0), alive(mark)
