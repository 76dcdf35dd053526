"""Nightlies on a Prefect server of the user's own, with nights that are interrupted, killed and that overlap, and the
deployment of ``prefect.yaml`` to a work pool: everything real, on one server for all of them."""

import json
import os
import signal
import socket
import subprocess
import sys
import uuid
from collections.abc import Iterator
from pathlib import Path
from uuid import UUID

import fastapi
import pytest
import yaml
from packaging.version import Version
from prefect.client.orchestration import get_client
from prefect.client.schemas.actions import WorkPoolCreate
from prefect.client.schemas.objects import FlowRun
from prefect.settings import PREFECT_API_URL, temporary_settings
from prefect.states import Scheduled

from asset2sim.catalog.read import read_table
from asset2sim.catalog.run import MARK
from asset2sim.runs.request import RefineRequest
from asset2sim.storage.lock import lock_output
from flows.serve_nightly import run_deployed_night, run_night_here
from flows.server.client import find_deployment, wait_for
from flows.server.server import deployment_name
from schemas.errors import UsageError
from schemas.settings import RunSettings, Settings
from tests.assets import RAW, ROOT
from tests.nightlies import LIMIT_S, Model, Nightly, make_nightly, model, served
from tests.prefect_server import with_tables
from tests.processes import alive, free_port, wait_until

pytestmark = pytest.mark.system
TWO = ("--assets", "box_wooden,laptop_silver")
COMMANDS_WORK = Version(fastapi.__version__) < Version("0.151")


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory, prefect_tables: Path) -> Iterator[str]:
    """``prefect server start``, as a user does it: in a process and a folder of its own, on SQLite."""
    home = with_tables(tmp_path_factory.mktemp("server"), prefect_tables)
    port = free_port()
    bare = {name: value for name, value in os.environ.items() if name != "PREFECT_API_URL"}
    bare |= {"PREFECT_SERVER_ANALYTICS_ENABLED": "false", "PREFECT_SERVER_SERVICES_SCHEDULER_LOOP_SECONDS": "1"}
    command = [sys.executable, "-m", "prefect", "server", "start", "--host", "127.0.0.1", "--port", f"{port}"]
    with (home / "log").open("wb") as log:
        server = subprocess.Popen(
            command, cwd=home, stdout=log, stderr=log, start_new_session=True,
            env={**bare, "PREFECT_HOME": str(home)},
        )  # fmt: skip
    url = f"http://127.0.0.1:{port}/api"
    try:
        assert wait_until(lambda: answers(port), LIMIT_S), (home / "log").read_text(encoding="utf-8")
        wait_for(url)
        with temporary_settings({PREFECT_API_URL: url}):
            yield url
    finally:
        os.killpg(server.pid, signal.SIGKILL)
        server.wait()


def python_path() -> str:
    return os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])


def answers(port: int) -> bool:
    with socket.socket() as found:
        return found.connect_ex(("127.0.0.1", port)) == 0


@pytest.fixture
def environment(address: str, tmp_path: Path) -> dict[str, str]:
    mark = f"asset2sim-test-{uuid.uuid4().hex}"
    fast = {"PREFECT_RUNNER_POLL_FREQUENCY": "1", "PREFECT_WORKER_QUERY_SECONDS": "1"}
    mine = {"PREFECT_HOME": str(tmp_path / "home"), "PREFECT_API_URL": address, "ASSET2SIM_TEST_MARK": mark}
    return {**os.environ, **fast, **mine, "PYTHONPATH": python_path()}


@pytest.fixture(scope="module")
def fallible() -> Iterator[Model]:
    with model() as found:
        yield found


def trigger(name: str) -> UUID:
    """A night at once, as ``prefect deployment run`` asks for one."""
    found = find_deployment(name)
    assert found is not None
    with get_client(sync_client=True) as client:
        return client.create_flow_run_from_deployment(UUID(str(found.id)), state=Scheduled()).id


def night(run: UUID) -> FlowRun:
    with get_client(sync_client=True) as client:
        return client.read_flow_run(run)


def ended(run: UUID) -> str:
    """The name of the state in which a night ends."""

    def over() -> bool:
        state = night(run).state
        return state is not None and state.is_final()

    assert wait_until(over, LIMIT_S), night(run).state_name
    return str(night(run).state_name)


def outcomes(nightly: Nightly) -> list[str]:
    runs = read_table(nightly.out, "runs").sort_values("started_at")
    return [f"{row.outcome} {row.ok} of {row.assets}" for row in runs.itertuples()]


def run_pages() -> list[str]:
    """The pages that the server holds of all runs."""
    with get_client(sync_client=True) as client:
        return [str(artifact.data) for artifact in client.read_artifacts() if artifact.key == "report"]


def test_nights_that_overlap_are_interrupted_and_killed(
    environment: dict[str, str], fallible: Model, tmp_path: Path, ready: list[str]
) -> None:
    file = tmp_path / "settings.yaml"
    file.write_text("model: {timeout_s: 100}", encoding="utf-8")
    nightly = make_nightly(tmp_path, environment, *TWO, *fallible.options, "--settings", str(file))
    name, mark = deployment_name(nightly.out), environment["ASSET2SIM_TEST_MARK"]
    fallible.silent.set()
    with served(nightly, ready) as process:
        assert f"prefect deployment run nightly/{name}" in nightly.log and "PREFECT_API_URL=" not in nightly.log
        first = trigger(name)
        assert wait_until(lambda: nightly.kept() == 1, LIMIT_S), nightly.log
        with pytest.raises(UsageError, match="is at work; wait until it ends"):
            run_deployed_night(RefineRequest(data=RAW, out=nightly.out))
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=LIMIT_S) == 0
    assert wait_until(lambda: not alive(mark), 60.0), alive(mark)
    assert (ended(first), outcomes(nightly)) == ("Cancelled", ["interrupted 1 of 1"]), nightly.log
    (page,) = (text for text in run_pages() if "**interrupted: 1 of 2 assets were not seen to**" in text)
    missed = "1 night was left out, since this run was at work when the time came"
    assert missed in page and nightly.told == [f"130:1::interrupted:{missed}"]

    with served(nightly) as process:
        second = trigger(name)
        assert wait_until((nightly.out / MARK).exists, LIMIT_S), nightly.log
        os.kill(int((nightly.out / ".lock").read_text()), signal.SIGKILL)
        assert ended(second) == "Crashed"
        assert wait_until(lambda: len(nightly.told) == 2, LIMIT_S), nightly.log
        assert nightly.told[1].startswith("1:0::") and "SIGKILL" in nightly.told[1]
        fallible.silent.clear()
        file.write_text("model: {timeout_s: 101}", encoding="utf-8")
        third = trigger(name)
        assert ended(third) == "Completed", nightly.log
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to the whole group
        assert process.wait(timeout=LIMIT_S) == 0
    assert wait_until(lambda: not alive(mark), 60.0), alive(mark)
    assert outcomes(nightly) == ["interrupted 1 of 1", "finished 2 of 2"]
    settings = read_table(nightly.out, "runs").sort_values("started_at")["settings_json"].map(json.loads)
    assert [found["model"]["timeout_s"] for found in settings] == [100.0, 101.0], (
        "as the file was when each night began"
    )
    assert any("ended without a report: it broke down, was killed" in page for page in run_pages())
    assert "ended without a report" in nightly.told[2] and "Traceback" not in nightly.log


def test_a_night_at_once_where_none_is_served_and_what_its_exit_code_says(
    environment: dict[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str], ready: list[str]
) -> None:
    nightly = make_nightly(tmp_path, environment, "--assets", "planted_not_xml")
    done = nightly.now(ready, "--strict")
    assert done.returncode == 1 and "0 of 1 ok, 1 new failure" in done.stdout, done.stderr
    assert nightly.told[0].startswith(f"1:0:{tmp_path / 'out' / 'report' / 'index.html'}:")

    hook = RunSettings(hook=nightly.words[-1])
    request = RefineRequest(
        data=RAW, out=nightly.out, asset_ids=("planted_not_xml",), settings=Settings(run=hook), strict=True
    )
    capsys.readouterr()
    with lock_output(nightly.out):
        assert run_night_here(request) == 2
    assert capsys.readouterr().err.startswith(f"asset2sim: another run (process {os.getpid()}) is writing to")
    assert nightly.told[1].startswith("2:0::another run")
    (nightly.out / "catalog" / "assets.parquet").write_bytes(b"no table")
    assert run_night_here(request) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "assets.parquet cannot be read" in line and nightly.told[2].startswith("1:0::table 'assets'")


@pytest.mark.skipif(not COMMANDS_WORK, reason="Prefect's server refuses its own commands with this FastAPI")
def test_prefect_yaml_deploys_to_a_work_pool_whose_worker_leaves_the_report(
    environment: dict[str, str], ready: list[str], tmp_path: Path
) -> None:
    content = yaml.safe_load((ROOT / "prefect.yaml").read_text(encoding="utf-8"))
    mine = {"data": str(RAW), "out": str(tmp_path / "out"), "asset_ids": ["box_wooden"]}
    parameters = content["deployments"][0]["parameters"]
    parameters |= mine
    parameters["settings"] |= {"views": {"write": False}, "engine": {"verify": ["pybullet"], "interact": False}}
    content["pull"] = [{"prefect.deployments.steps.set_working_directory": {"directory": str(ROOT)}}]
    (tmp_path / "prefect.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")

    def prefect(*words: str) -> None:
        command = [*ready, str(Path(sys.executable).with_name("prefect")), "--no-prompt", *words]
        done = subprocess.run(command, cwd=ROOT, env=environment, text=True, capture_output=True, timeout=LIMIT_S)
        assert done.returncode == 0, (done.stdout + done.stderr)[:2000]

    with get_client(sync_client=True) as client:
        client.create_work_pool(WorkPoolCreate(name="nights", type="process"))
    prefect("deploy", "--prefect-file", str(tmp_path / "prefect.yaml"), "--name", "nightly")
    run = trigger("nightly")
    prefect("worker", "start", "--pool", "nights", "--run-once")
    assert ended(run) == "Completed", night(run).state
    assert "1 of 1 objects pass" in (tmp_path / "out" / "report" / "index.html").read_text(encoding="utf-8")
    assert any("# 1 of 1 ok, 0 new failures" in page for page in run_pages())
    assert wait_until(lambda: not alive(environment["ASSET2SIM_TEST_MARK"]), 60.0)
