"""A real nightly: served, shown its next run, refused while another run is at work, triggered at once, and stopped."""

import os
import signal
import subprocess
import sys
import uuid
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from asset2sim.catalog.lock import lock_output
from asset2sim.cli.night import moment
from schemas.errors import UsageError
from tasks.serving import Serving, deployment_name, find_serving, serving
from tests.processes import alive, wait_until

ROOT = Path(__file__).resolve().parents[1]
SAMPLES = ROOT / "data" / "raw"
LIMIT_S = 120.0
"""Time that each step may take, s: a busy machine starts Prefect's server in 30."""


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "prefect"
    monkeypatch.setenv("PREFECT_HOME", str(folder))
    return folder


def test_who_serves_a_folder_is_known_as_long_as_it_does(tmp_path: Path, home: Path) -> None:
    out = tmp_path / "my out"
    assert find_serving(out) is None
    with serving(out, "http://127.0.0.1:1/api"):
        assert find_serving(out) == Serving(os.getpid(), "http://127.0.0.1:1/api")
        assert find_serving(tmp_path / "another") is None
        with pytest.raises(UsageError, match=f"process {os.getpid()}.*serves.*already"), serving(out, None):
            pass
    assert find_serving(out) is None
    with serving(out, None):
        assert find_serving(out) == Serving(os.getpid(), None)


def test_two_folders_of_one_name_have_two_deployments(tmp_path: Path) -> None:
    names = {deployment_name(tmp_path / part / "My Out!") for part in "ab"}
    assert len(names) == 2 and all(name.startswith("my-out-") for name in names)
    assert deployment_name(tmp_path / "a" / ".." / "c") == deployment_name(tmp_path / "c")


def test_the_next_run_is_shown_with_how_far_off_it_is() -> None:
    now = datetime(2026, 3, 1, 23, 30, tzinfo=UTC)
    assert moment(now + timedelta(minutes=150, seconds=10), now) == "2026-03-02 02:00 UTC, in 2 h 30 min"
    assert "none is planned" in moment(None)


@pytest.fixture
def environment(home: Path) -> dict[str, str]:
    mark = {"ASSET2SIM_TEST_MARK": f"asset2sim-test-{uuid.uuid4().hex}", "PREFECT_RUNNER_POLL_FREQUENCY": "1"}
    bare = {name: value for name, value in os.environ.items() if name != "PREFECT_API_URL"}
    return {**bare, "PREFECT_HOME": str(home), **mark}


@pytest.fixture
def command(tmp_path: Path) -> list[str]:
    hook = f"echo $ASSET2SIM_EXIT:$ASSET2SIM_OK:$ASSET2SIM_REPORT:$ASSET2SIM_ERROR >> '{tmp_path}/told'"
    nightly = [sys.executable, "-m", "flows.command", "nightly", str(SAMPLES), "--out", str(tmp_path / "out")]
    quick = ["--assets", "box_wooden", "--engines", "pybullet", "--no-interaction", "--no-views", "--workers", "1"]
    return [*nightly, *quick, "--hook", hook]


@pytest.fixture
def served(command: list[str], environment: dict[str, str], tmp_path: Path) -> Iterator[subprocess.Popen[bytes]]:
    """The nightly, once it has said when it runs next; what it says goes to the file ``log``."""
    log = tmp_path / "log"
    with log.open("wb") as file:
        process = subprocess.Popen(command, cwd=ROOT, env=environment, stdout=file, stderr=file, start_new_session=True)
    yield process
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


@pytest.mark.slow
@pytest.mark.skipif(not (SAMPLES / "manifest.csv").exists(), reason="the sample dataset is not here")
def test_a_nightly_is_served_triggered_and_stopped(
    served: subprocess.Popen[bytes], command: list[str], environment: dict[str, str], tmp_path: Path
) -> None:
    out, log = tmp_path / "out", tmp_path / "log"
    said = wait_until(lambda: served.poll() is not None or "deployment run" in log.read_text(encoding="utf-8"), LIMIT_S)
    text = log.read_text(encoding="utf-8")
    assert said and served.poll() is None, text
    assert f"next run: {datetime.now(UTC):%Y}" in text and "02:00 UTC, in" in text
    assert f"prefect deployment run nightly/{deployment_name(out)}" in text

    def now() -> subprocess.CompletedProcess[str]:
        words = [*command, "--now"]
        return subprocess.run(words, cwd=ROOT, env=environment, text=True, capture_output=True, timeout=LIMIT_S)

    with lock_output(out):
        refused = now()
    assert refused.returncode == 2, refused.stderr
    (line,) = [line for line in refused.stderr.splitlines() if not line.startswith("pybullet build time")]
    assert f"another run (process {os.getpid()}) is writing to {out}" in line
    done = now()
    assert done.returncode == 0, done.stderr + log.read_text(encoding="utf-8")
    (report,) = (out / "reports").iterdir()
    assert report.read_text(encoding="utf-8").count("# 1 of 1 ok, 0 new failures\n") == 1
    assert f"1 of 1 ok, 0 new failures · report: {report}" in done.stdout
    first, second = (tmp_path / "told").read_text(encoding="utf-8").splitlines()
    assert first.startswith("2:0::another run") and second == f"0:1:{report}:"
    served.send_signal(signal.SIGTERM)
    assert served.wait(timeout=30) == 0
    assert "Traceback" not in log.read_text(encoding="utf-8"), log.read_text(encoding="utf-8")
    assert wait_until(lambda: not alive(environment["ASSET2SIM_TEST_MARK"]), 15.0)
