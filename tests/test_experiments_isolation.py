"""Children that do one piece of work after another: what they may share, and what must end them."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from asset2sim.experiments.isolation import Ending, Outcome, child, children, run_isolated
from asset2sim.experiments.isolation.child import IDLE_LIMIT_S, MAX_GROWTH_MB
from asset2sim.runs.asking_attempt import refine_here
from flows import PIPELINE
from schemas.settings import EngineSettings, Settings
from schemas.vocabulary import Status
from tests import crashers
from tests.assets import sample
from tests.processes import gone, wait_until

pytestmark = pytest.mark.system

MEMORY_MB = 600


@pytest.fixture
def work(tmp_path: Path) -> Callable[..., Outcome]:
    def isolated(function: Callable[..., object], *args: object, fresh: bool = False, log: str = "log") -> Outcome:
        return run_isolated(
            function, args, time_limit_s=60.0, memory_limit_mb=MEMORY_MB, services={}, log_path=tmp_path / log,
            fresh=fresh,
        )  # fmt: skip

    return isolated


@pytest.fixture
def pid(work: Callable[..., Outcome]) -> int:
    """A child that has done something, and is the next that gets work."""
    return number(work(crashers.own_pid, fresh=True))


def number(outcome: Outcome) -> int:
    assert outcome.ending is Ending.RETURNED and isinstance(outcome.value, int), outcome
    return outcome.value


def test_a_child_is_given_more_work_unless_a_fresh_one_is_asked_for(work: Callable[..., Outcome], pid: int) -> None:
    assert number(work(crashers.own_pid)) == pid
    assert number(work(crashers.own_pid, fresh=True)) != pid


@pytest.mark.parametrize(
    ("function", "args"),
    [
        (crashers.leave_a_thread, ()),
        (crashers.leave_a_process, ()),
        (crashers.leave_a_file_open, ()),
        (crashers.leave_the_folder, ()),
        (crashers.leave_a_variable, ()),
        (crashers.leave_memory, (int(MAX_GROWTH_MB) + 50,)),
        (crashers.kill_fork_server, ()),
    ],
)
def test_work_that_leaves_traces_is_its_childs_last(
    work: Callable[..., Outcome], pid: int, function: Callable[..., object], args: tuple[object, ...]
) -> None:
    assert number(work(function, *args)) == pid
    assert wait_until(lambda: gone(pid), 60.0)
    assert number(work(crashers.own_pid)) != pid


def test_an_orphan_that_work_leaves_ends_with_its_child(work: Callable[..., Outcome], pid: int) -> None:
    value = work(crashers.leave_an_orphan).value
    assert isinstance(value, tuple) and value[0] == pid
    assert wait_until(lambda: gone(pid) and gone(value[1]), 60.0)


@pytest.mark.parametrize(
    ("function", "ending"),
    [
        (crashers.segfault, Ending.DIED),
        (crashers.raise_key_error, Ending.RAISED),
        (crashers.return_the_unpicklable, Ending.RAISED),
    ],
)
def test_a_child_that_fails_gets_no_more_work(
    work: Callable[..., Outcome], pid: int, function: Callable[..., object], ending: Ending
) -> None:
    assert work(function).ending is ending
    assert wait_until(lambda: gone(pid), 60.0)
    assert number(work(crashers.own_pid)) != pid


def test_the_memory_limit_is_that_of_each_piece_of_work(work: Callable[..., Outcome], pid: int) -> None:
    kept = int(MAX_GROWTH_MB) - 150
    assert number(work(crashers.leave_memory, kept)) == pid
    # As much as the limit leaves, however much is there already.
    assert work(crashers.eat_memory, MEMORY_MB - 100).ending is Ending.RETURNED
    assert number(work(crashers.own_pid)) == pid
    assert work(crashers.eat_memory, MEMORY_MB + 100).ending is Ending.OUT_OF_MEMORY


def test_each_piece_of_work_has_its_own_log(work: Callable[..., Outcome], pid: int, tmp_path: Path) -> None:
    assert number(work(crashers.leave_half_a_line, log="one")) == pid
    work(crashers.chatter_from_c, log="two")
    assert number(work(crashers.own_pid, log="three")) == pid
    assert (tmp_path / "one").read_text() == "half a line"
    assert (tmp_path / "two").read_text().splitlines() == ["a console line from C", "a line from Python"]
    assert not (tmp_path / "three").exists()


def test_a_child_that_refined_an_asset_is_given_more_work(tmp_path: Path) -> None:
    """All that refining uses, engines and renderer among it, leaves the process as it was."""
    ref = sample("box_wooden")
    settings = Settings(engine=EngineSettings(interact=False))
    children.end_idle()
    assert refine_here([ref], tmp_path, settings, PIPELINE)[0].status is Status.OK
    assert (tmp_path / "assets" / ref.asset_id / "views" / "front.png").exists()
    assert len(children._idle) == 1


def test_a_child_killed_while_it_is_idle_costs_nothing(work: Callable[..., Outcome], pid: int) -> None:
    os.kill(pid, signal.SIGKILL)
    assert number(work(crashers.own_pid)) != pid


def test_a_child_that_is_given_nothing_ends(pid: int) -> None:
    assert not wait_until(lambda: gone(pid), 0.2 * IDLE_LIMIT_S)
    assert wait_until(lambda: gone(pid), IDLE_LIMIT_S + 60.0)


def test_a_child_has_an_end(work: Callable[..., Outcome], pid: int) -> None:
    for _ in range(child.MAX_WORK_PER_CHILD - 1):
        assert number(work(crashers.own_pid)) == pid
    assert number(work(crashers.own_pid)) != pid


def test_work_at_the_same_time_is_in_children_of_their_own(work: Callable[..., Outcome], pid: int) -> None:
    endings: list[Outcome] = []

    def one(name: str) -> None:
        endings.append(work(crashers.sleep_for, 0.5, log=name))
        endings.append(work(crashers.own_pid, log=name))

    threads = [threading.Thread(target=one, args=(str(index),)) for index in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(300.0)
    assert {outcome.ending for outcome in endings} == {Ending.RETURNED}
    assert len(endings) == 6


INTERRUPTED_WHILE_IT_LOADS = """
import os, signal, time
from multiprocessing import forkserver
from asset2sim.experiments.isolation import children

children.warm_up("slow_to_load")
server = forkserver._forkserver._forkserver_pid
while not os.path.exists("loading"):
    time.sleep(0.01)
os.kill(server, signal.SIGINT)
print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ()))
while not os.path.exists("loaded") and os.waitid(os.P_PID, server, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None:
    time.sleep(0.01)
"""


def test_ctrl_c_while_the_fork_server_loads_is_its_parents_affair(tmp_path: Path) -> None:
    (tmp_path / "slow_to_load.py").write_text(
        "import time, pathlib\npathlib.Path('loading').touch()\ntime.sleep(2)\npathlib.Path('loaded').touch()\n"
    )
    root = str(Path(__file__).parents[1])
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED_WHILE_IT_LOADS], cwd=tmp_path, capture_output=True, text=True, timeout=300,
        env={**os.environ, "PYTHONPATH": os.pathsep.join((str(tmp_path), root))},
    )  # fmt: skip
    assert (done.stdout, done.stderr, done.returncode) == ("False\n", "", 0)


WORK_AND_LEAVE = """
import atexit, sys
from pathlib import Path
atexit.register(lambda: print(len(children._idle), "idle"))  # first in, last out
from asset2sim.experiments.isolation import children, run_isolated
from tests import crashers
if __name__ == "__main__":
    run_isolated(
        crashers.own_pid, (), time_limit_s=60.0, memory_limit_mb=600, services={}, log_path=Path(sys.argv[1])
    )
    print(len(children._idle), "idle")
"""


def test_a_process_that_ends_does_not_wait_for_its_idle_children(tmp_path: Path) -> None:
    """Python's exit joins children, which end by themselves only after ``IDLE_LIMIT_S``."""
    script = tmp_path / "leave.py"
    script.write_text(WORK_AND_LEAVE)
    root = Path(__file__).parents[1]
    done = subprocess.run(
        [sys.executable, script, tmp_path / "log"], capture_output=True, text=True, check=True, timeout=120,
        env=os.environ | {"PYTHONPATH": str(root)}, cwd=root,
    )  # fmt: skip
    assert [line for line in done.stdout.splitlines() if line.endswith("idle")] == ["1 idle", "0 idle"]
