"""An engine in a forked child: its result comes back as it is, and a crash or a hang costs no more than its report."""

import faulthandler
import os
import signal
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from asset2sim.checks.rest import measure
from asset2sim.engines.child import ChildOutcome, in_child, in_children
from schemas.errors import AssetError
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine, FailureMode
from tests.builders import block_urdf
from tests.crashers import hang_holding_the_interpreter, segfault, vanish
from tests.engine_worlds import every_engine

pytestmark = pytest.mark.system

ENGINE = Engine.PYBULLET


def test_a_result_comes_back_whatever_was_passed() -> None:
    factor = 3
    assert in_child(ENGINE, lambda x: factor * x, 14, time_limit_s=60.0) == ChildOutcome(42)


def test_a_large_result_comes_back_whole() -> None:
    ended = in_child(ENGINE, lambda: np.arange(2_000_000), time_limit_s=60.0)
    assert ended.value is not None and ended.value.sum() == 1_999_999 * 1_000_000


class Garbled:
    """An answer that cannot be read back, as a process with a broken heap may send."""

    def __reduce__(self) -> tuple[type[int], tuple[str]]:
        return int, ("no number",)


def test_an_answer_that_cannot_be_read_costs_its_report_alone() -> None:
    ended = in_child(ENGINE, Garbled, time_limit_s=60.0)
    assert ended.died and str(ended.problem).startswith("pybullet died while it answered (invalid literal")


def test_what_the_child_changes_stays_in_it() -> None:
    kept = [1]
    assert in_child(ENGINE, kept.append, 2, time_limit_s=60.0).problem is None
    assert kept == [1]


def test_a_segfault_is_a_problem_that_names_engine_and_signal() -> None:
    def crash() -> None:
        faulthandler.disable()
        segfault()

    ended = in_child(Engine.MUJOCO, crash, time_limit_s=60.0)
    assert ended == ChildOutcome(None, "mujoco crashed: its process was killed by SIGSEGV", died=True)


def test_a_child_that_leaves_without_a_word_is_a_problem() -> None:
    ended = in_child(ENGINE, vanish, time_limit_s=60.0)
    assert ended == ChildOutcome(None, "pybullet ended its process with exit code 3 and without a result", died=True)


def test_a_hang_in_c_is_killed_in_time(capfd: pytest.CaptureFixture[str]) -> None:
    ended = in_child(Engine.SAPIEN, hang_holding_the_interpreter, time_limit_s=0.3)
    assert ended == ChildOutcome(None, "sapien was not done after 0.3 s, and was killed", timed_out=True, died=True)


def refuse() -> None:
    raise AssetError(FailureMode.ENGINE_REFUSED, "engine_refused", "MuJoCo refuses x.urdf")


def test_an_asset_error_is_a_problem_in_its_own_words() -> None:
    said = in_child(ENGINE, refuse, time_limit_s=60.0)
    assert said == ChildOutcome(None, "pybullet says: MuJoCo refuses x.urdf", refused=True)


def test_any_other_error_is_a_problem_and_leaves_a_traceback(capfd: pytest.CaptureFixture[str]) -> None:
    assert in_child(ENGINE, {}.pop, "lid", time_limit_s=60.0).problem == "pybullet failed: KeyError: 'lid'"
    assert "Traceback" in capfd.readouterr().err


def test_a_result_that_cannot_travel_is_a_problem(capfd: pytest.CaptureFixture[str]) -> None:
    problem = in_child(ENGINE, lambda: lambda: 1, time_limit_s=60.0).problem
    assert problem is not None and problem.startswith("pybullet failed: ")


def test_engines_share_a_child() -> None:
    every = (Engine.PYBULLET, Engine.MUJOCO, Engine.SAPIEN)
    found = in_children(dict.fromkeys(every, os.getpid), time_limit_s=60.0)
    assert list(found) == list(every) and len({ended.value for ended in found.values()}) == 1
    assert os.getpid() not in {ended.value for ended in found.values()}


@pytest.mark.parametrize("fault", [vanish, hang_holding_the_interpreter, refuse])
def test_what_stops_one_engine_costs_the_others_a_new_child_and_no_more(
    fault: Callable[[], None], capfd: pytest.CaptureFixture[str]
) -> None:
    calls = {Engine.PYBULLET: os.getpid, Engine.MUJOCO: fault, Engine.SAPIEN: os.getpid}
    found = in_children(calls, time_limit_s=2.0)
    assert list(found) == list(calls)
    assert found[Engine.MUJOCO] == in_child(Engine.MUJOCO, fault, time_limit_s=2.0)
    assert found[Engine.MUJOCO].problem is not None
    before, after = (found[engine] for engine in (Engine.PYBULLET, Engine.SAPIEN))
    assert before.problem is None and after.problem is None and before.value != after.value


def test_each_engine_has_the_whole_time_limit() -> None:
    calls = {engine: partial(time.sleep, 0.6) for engine in (Engine.PYBULLET, Engine.MUJOCO, Engine.SAPIEN)}
    found = in_children(calls, time_limit_s=1.5)
    assert all(ended.problem is None and 0.5 < ended.seconds < 1.5 for ended in found.values())


def children_of(pid: int) -> list[int]:
    """The processes that this one has started and not waited for; other tests may have left a server running."""
    return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def test_nothing_is_left_behind() -> None:
    before = set(os.listdir("/proc/self/fd")) if os.path.isdir("/proc/self/fd") else set()
    children = set(children_of(os.getpid()))
    pids: list[int] = []
    for function, limit_s in ((os.getpid, 60.0), (vanish, 60.0), (hang_holding_the_interpreter, 0.3)):
        ended = in_child(ENGINE, function, time_limit_s=limit_s)
        if ended.value is not None:
            pids.append(ended.value)
    assert set(children_of(os.getpid())) <= children
    with pytest.raises(ProcessLookupError):
        os.kill(pids[0], 0)
    if before:
        assert len(os.listdir("/proc/self/fd")) == len(before)


def nested(file: str) -> None:
    def inner() -> None:
        Path(file).write_text(str(os.getpid()), encoding="ascii")
        time.sleep(600.0)

    in_child(ENGINE, inner, time_limit_s=600.0)


def test_the_child_of_a_process_that_is_killed_goes_with_it(tmp_path: Path) -> None:
    if not Path("/proc/self").is_dir():
        pytest.skip("elsewhere than on Linux the process group does it")
    file = tmp_path / "pid"
    middle = os.fork()
    if middle == 0:
        nested(str(file))
        os._exit(0)
    deadline = time.monotonic() + 120.0
    while not (file.is_file() and file.read_text(encoding="ascii")) and time.monotonic() < deadline:
        time.sleep(0.02)
    inner = int(file.read_text(encoding="ascii"))
    os.kill(middle, signal.SIGKILL)
    os.waitpid(middle, 0)
    while Path(f"/proc/{inner}").is_dir() and time.monotonic() < deadline:
        if Path(f"/proc/{inner}/stat").read_text(encoding="ascii").split()[2] == "Z":
            break
        time.sleep(0.02)
    else:
        assert not Path(f"/proc/{inner}").is_dir()


@every_engine
def test_an_engine_measures_the_same_in_a_child_as_here(tmp_path: Path, engine: Engine) -> None:
    settings = EngineSettings(settle_s=0.5, test_s=0.2)
    urdf = block_urdf(tmp_path)
    here = measure(engine, urdf, {}, 0.5, settings)
    ended = in_child(engine, measure, engine, urdf, {}, 0.5, settings, time_limit_s=60.0)
    assert ended.problem is None and ended.value == here
