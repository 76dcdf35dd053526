"""Children that crash, hang, eat memory and leave strays: each must cost one result, and nothing else."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from asset2sim.experiments.isolation import Ending, Outcome, accept_children, run_isolated, stop_children
from asset2sim.runs.asset_attempt import StoppedError, attempt_in_child, failed_record, record_of_dead_child
from schemas.asset import AssetRecord, AssetRef
from schemas.request import ModelAnswer, ModelCall, ModelRequest
from schemas.settings import RunSettings, Settings
from schemas.vocabulary import FailureMode, Status
from tests import crashers
from tests.assets import ROOT
from tests.processes import gone, wait_until

pytestmark = pytest.mark.system


@pytest.fixture(autouse=True)
def children_are_accepted_again() -> Iterator[None]:
    yield
    accept_children("")


def isolated(
    log: Path,
    function: Callable[..., object],
    *args: object,
    time_limit_s: float = 60.0,
    fresh: bool = False,
    **services: Callable[..., object],
) -> Outcome:
    return run_isolated(
        function, args, time_limit_s=time_limit_s, memory_limit_mb=600, services=services, log_path=log, fresh=fresh
    )


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return tmp_path / "logs" / "asset.log"


def test_a_value_comes_back_and_a_silent_child_leaves_no_log(log: Path) -> None:
    outcome = isolated(log, crashers.double, 21)
    assert (outcome.ending, outcome.value) == (Ending.RETURNED, 42)
    assert not log.exists()


@pytest.mark.parametrize(
    ("function", "words"),
    [(crashers.segfault, "killed by SIGSEGV"), (crashers.abort, "killed by SIGABRT"), (crashers.vanish, "exit code 3")],
)
def test_a_crash_is_an_outcome_that_says_how_and_the_log_says_where(
    log: Path, function: Callable[..., object], words: str
) -> None:
    outcome = isolated(log, function)
    assert outcome.ending is Ending.DIED and words in outcome.reason
    assert function is not crashers.segfault or "in segfault" in log.read_text(encoding="utf-8")


@pytest.mark.parametrize("function", [crashers.hang_holding_the_interpreter, crashers.ignore_every_signal_and_hang])
def test_a_hang_is_cut_off_and_the_log_says_where(log: Path, function: Callable[..., object]) -> None:
    outcome = isolated(log, function, time_limit_s=2.0)
    assert outcome.ending is Ending.TIMED_OUT
    assert f"in {function.__name__}" in log.read_text(encoding="utf-8")


def test_memory_beyond_the_limit_is_refused_and_below_it_is_given(log: Path) -> None:
    outcome = isolated(log, crashers.eat_memory, 2000)
    assert outcome.ending is Ending.OUT_OF_MEMORY
    assert "600 MB" in outcome.reason
    assert isolated(log, crashers.eat_memory, 100).value == 100 * 1024 * 1024


def test_an_exception_comes_back_as_text_with_its_traceback(log: Path) -> None:
    outcome = isolated(log, crashers.raise_key_error)
    assert outcome.ending is Ending.RAISED
    assert outcome.reason == "KeyError: 'joint_7'"
    assert "in raise_key_error" in log.read_text(encoding="utf-8")
    assert isolated(log, crashers.raise_asset_error).reason == "AssetError: link 'lid' needs lid.obj"


def test_a_full_disk_is_an_ending_of_its_own_and_a_failed_record_that_says_so(log: Path, tmp_path: Path) -> None:
    outcome = isolated(log, crashers.meet_a_full_disk)
    assert outcome.ending is Ending.DISK_FULL and "No space left on device" in log.read_text(encoding="utf-8")
    record = record_of_dead_child(REF, tmp_path, Settings(), outcome, (CALL,))
    assert record.failure_mode is FailureMode.DISK_FULL and record.calls == (CALL,)
    assert record.reason == "a disk is full: ValueError: cannot export the mesh"


def test_a_log_that_cannot_be_written_costs_its_lines_only(tmp_path: Path) -> None:
    (tmp_path / "logs").write_text("a file where the folder of logs should be")
    assert isolated(tmp_path / "logs" / "asset.log", crashers.double, 4).value == 8


def test_a_result_that_cannot_travel_is_an_outcome(log: Path) -> None:
    outcome = isolated(log, crashers.return_the_unpicklable)
    assert outcome.ending is Ending.RAISED
    assert "pickle" in outcome.reason


def test_chatter_goes_to_the_log_and_not_to_the_terminal(log: Path, capfd: pytest.CaptureFixture[str]) -> None:
    isolated(log, crashers.chatter_from_c)
    assert capfd.readouterr() == ("", "")
    assert log.read_text(encoding="utf-8").splitlines() == ["a console line from C", "a line from Python"]


def test_services_run_in_the_parent_on_time_of_their_own(log: Path) -> None:
    seen: list[int] = []

    def ask(number: int) -> int:
        time.sleep(1.0)
        seen.append(os.getpid())
        return 10 * number

    outcome = isolated(log, crashers.ask_twice, 3, time_limit_s=1.9, ask=ask)
    assert outcome.value == 70
    assert seen == [os.getpid()] * 2
    assert outcome.seconds >= 0.8, "longer than its limit, by the parent's time"


def test_a_service_that_raises_is_told_to_the_child(log: Path) -> None:
    def ask(number: int) -> int:
        raise ValueError(f"no answer to {number}")

    outcome = isolated(log, crashers.ask_twice, 3, ask=ask)
    assert outcome.reason == "ServiceError: service 'ask': ValueError: no answer to 3"


def test_a_killed_child_takes_its_own_children_with_it(log: Path, tmp_path: Path) -> None:
    pids = tmp_path / "pids"
    outcome = isolated(log, crashers.start_a_grandchild_and_hang, str(pids), time_limit_s=4.0)
    assert outcome.ending is Ending.TIMED_OUT
    child, grandchild = map(int, pids.read_text(encoding="ascii").split())
    assert wait_until(lambda: gone(child) and gone(grandchild), 60.0)


@pytest.mark.parametrize("killer", [signal.SIGKILL, signal.SIGTERM])
def test_children_and_grandchildren_die_with_a_killed_parent(tmp_path: Path, killer: signal.Signals) -> None:
    pids, log = tmp_path / "pids", tmp_path / "log"
    script = (
        "from pathlib import Path\nfrom asset2sim.experiments.isolation import run_isolated\n"
        "from tests import crashers\n"
        f"run_isolated(crashers.start_a_grandchild_and_hang, ({str(pids)!r},), time_limit_s=600, memory_limit_mb=600,"
        f" services={{}}, log_path=Path({str(log)!r}))"
    )
    parent = subprocess.Popen([sys.executable, "-c", script], cwd=ROOT)
    assert wait_until(lambda: pids.exists() and len(pids.read_text(encoding="ascii").split()) == 2, 120.0)
    parent.send_signal(killer)
    parent.wait(timeout=60)
    child, grandchild = map(int, pids.read_text(encoding="ascii").split())
    assert wait_until(lambda: gone(child) and gone(grandchild), 60.0)


def test_stopping_kills_what_runs_and_refuses_what_comes(log: Path) -> None:
    outcomes: list[Outcome] = []
    thread = threading.Thread(
        target=lambda: outcomes.append(isolated(log, crashers.sleep_for, 600.0, time_limit_s=600.0))
    )
    thread.start()
    time.sleep(0.5)
    stop_children("somebody else")
    assert not outcomes
    stop_children("")
    thread.join(timeout=120.0)
    assert [outcome.ending for outcome in outcomes] == [Ending.STOPPED]
    assert isolated(log, crashers.double, 1).ending is Ending.STOPPED
    accept_children("")
    assert isolated(log, crashers.double, 1).value == 2


def test_many_threads_keep_their_childrens_endings_apart(tmp_path: Path) -> None:
    """Two threads that poll the same child can lose its exit code; each must see its own child's."""
    endings: dict[int, list[str]] = {}

    def work(number: int) -> None:
        function = crashers.segfault if number % 2 else crashers.vanish
        endings[number] = [isolated(tmp_path / f"{number}.log", function).reason for _ in range(10)]

    threads = [threading.Thread(target=work, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=300.0)
    for number, reasons in endings.items():
        assert len(reasons) == 10
        assert all(("SIGSEGV" if number % 2 else "exit code 3") in reason for reason in reasons)


def test_a_child_has_one_thread_the_engines_and_no_heavy_libraries(log: Path) -> None:
    assert isolated(log, crashers.thread_count).value == 1
    loaded = isolated(log, crashers.loaded_modules).value
    assert isinstance(loaded, set)
    assert {"pybullet", "trimesh", "yourdfpy"} <= loaded
    assert not loaded & {"litellm", "prefect", "mlflow", "distributed"}


def test_fresh_children_are_forks_of_one_process_that_has_loaded_everything(log: Path) -> None:
    """So a fresh child costs milliseconds."""
    parents = {isolated(log, os.getppid, fresh=True).value for _ in range(20)}
    assert len(parents) == 1 and parents != {os.getpid()}


REF = AssetRef(asset_id="box-1", path="/nowhere/box-1", category="Box")


def fine(ref: AssetRef, out: Path, settings: Settings, *, ask: Callable[[ModelRequest], ModelAnswer]) -> AssetRecord:
    record = failed_record(ref, settings, FailureMode.NONE, "")
    return record.model_copy(update={"status": Status.OK, "calls": ask(QUESTION).calls})


def ask_and_crash(
    ref: AssetRef, out: Path, settings: Settings, *, ask: Callable[[ModelRequest], ModelAnswer]
) -> AssetRecord:
    ask(QUESTION)
    crashers.segfault()
    raise AssertionError("a segmentation fault does not come back")


def hang(ref: AssetRef, out: Path, settings: Settings, *, ask: Callable[[ModelRequest], ModelAnswer]) -> AssetRecord:
    time.sleep(600.0)
    raise AssertionError("too late")


def forget_the_record(
    ref: AssetRef, out: Path, settings: Settings, *, ask: Callable[[ModelRequest], ModelAnswer]
) -> None:
    return None


QUESTION = ModelRequest(purpose="synthesize", system="s", text="t")
CALL = ModelCall(
    purpose="synthesize", model="m", attempt=1, prompt_tokens=3, completion_tokens=4, cost_usd=0.5, latency_s=0.1,
    cached=False, outcome="ok", prompt_hash="h",
)  # fmt: skip


def answer(request: ModelRequest) -> ModelAnswer:
    return ModelAnswer(content=request.text, calls=(CALL,))


def quick_settings() -> Settings:
    return Settings(run=RunSettings(asset_time_limit_s=1.0, asset_memory_limit_mb=600))


def test_an_assets_record_comes_back_whole(tmp_path: Path) -> None:
    found = attempt_in_child(f"{__name__}:fine", REF, tmp_path, Settings(), answer)
    assert (found.record.status, found.record.ref, found.record.calls) == (Status.OK, REF, (CALL,)) and not found.died


def test_a_crash_is_a_failed_record_that_keeps_its_model_calls(tmp_path: Path) -> None:
    found = attempt_in_child(f"{__name__}:ask_and_crash", REF, tmp_path, Settings(), answer)
    record = found.record
    assert (record.status, record.failure_mode, record.calls) == (Status.FAILED, FailureMode.ENGINE_CRASH, (CALL,))
    assert "SIGSEGV" in record.reason and "logs/box-1.log" in record.reason and "SIGSEGV" in found.died
    assert "box-1" in record.findings[0].message


def test_a_hang_is_a_failed_record(tmp_path: Path) -> None:
    found = attempt_in_child(f"{__name__}:hang", REF, tmp_path, quick_settings(), answer)
    assert found.record.failure_mode is FailureMode.TIMEOUT and "1 s" in found.record.reason and "1 s" in found.died


@pytest.mark.parametrize(
    ("pipeline", "said"), [(f"{__name__}:forget_the_record", "NoneType"), ("tests.no_such_module:refine", "")]
)
def test_a_pipeline_without_an_answer_is_a_failed_record_and_its_process_did_not_die(
    tmp_path: Path, pipeline: str, said: str
) -> None:
    found = attempt_in_child(pipeline, REF, tmp_path, Settings(), answer)
    assert found.record.failure_mode is FailureMode.ENGINE_CRASH and said in found.record.reason and not found.died


def test_a_stopped_asset_has_no_record(tmp_path: Path) -> None:
    stop_children(str(tmp_path))
    with pytest.raises(StoppedError):
        attempt_in_child(f"{__name__}:fine", REF, tmp_path, Settings(), answer)
