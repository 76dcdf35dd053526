"""A real nightly with a Prefect server of its own: served, shown its next run, triggered at once, and stopped."""

import asyncio
import os
import signal
import sys
import uuid
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from prefect._internal.concurrency.services import QueueService

from flows.run_report import moment
from flows.server.client import send_held
from flows.server.server import Serving, deployment_name, find_serving, serving
from schemas.errors import UsageError
from tests.nightlies import LIMIT_S, make_nightly, served
from tests.prefect_server import with_tables
from tests.processes import alive, wait_until

pytestmark = pytest.mark.system


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, prefect_tables: Path) -> Path:
    folder = with_tables(tmp_path / "prefect", prefect_tables)
    monkeypatch.setenv("PREFECT_HOME", str(folder))
    return folder


class Unanswered(QueueService[int]):
    """A service that sends to a server that never answers."""

    async def _handle(self, item: int) -> None:
        await asyncio.Event().wait()


def test_what_a_server_never_takes_is_given_up(caplog: pytest.LogCaptureFixture) -> None:
    service = Unanswered.instance()
    service.send(1)
    send_held(0.5)
    assert "took no logs or events for 0.5 s" in caplog.text
    assert service.drain() is False, "it has ended, so that the process can"
    send_held(0.5)
    assert caplog.text.count("took no logs") == 1


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


def test_a_nightly_with_a_server_of_its_own_is_served_triggered_and_stopped(home: Path, tmp_path: Path) -> None:
    mark = f"asset2sim-test-{uuid.uuid4().hex}"
    bare = {name: value for name, value in os.environ.items() if name != "PREFECT_API_URL"}
    environment = {**bare, "ASSET2SIM_TEST_MARK": mark, "PREFECT_RUNNER_POLL_FREQUENCY": "1"}
    nightly = make_nightly(tmp_path, environment, "--assets", "box_wooden")
    with served(nightly) as process:
        assert f"next run: {datetime.now(UTC):%Y}" in nightly.log and "02:00 UTC, in" in nightly.log
        command = f"prefect deployment run nightly/{deployment_name(nightly.out)}"
        assert "PREFECT_API_URL=http://127.0.0.1:" in nightly.log and command in nightly.log
        done = nightly.now([sys.executable])
        assert done.returncode == 0, done.stderr + nightly.log
        report = nightly.out / "report" / "index.html"
        assert "1 of 1 objects pass" in report.read_text(encoding="utf-8")
        assert f"1 of 1 ok, 0 new failures · report: {report}" in done.stdout
        assert nightly.told == [f"0:1:{report}::"]
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=LIMIT_S) == 0
    assert "Traceback" not in nightly.log, nightly.log
    assert wait_until(lambda: not alive(mark), 60.0)
