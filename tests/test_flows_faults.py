"""Every fault, injected for real into a run as a user starts it: its row comes out, all others do well, and no process
is left."""

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Hashable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from tests.assets import ROOT
from tests.dask_programs import await_workers, programs, start_scheduler, start_workers, worker_of
from tests.fault_runs import LIMIT_S, PLAIN, Place, assert_met, assert_nobody_left, dataset, findings, rows, start
from tests.faulty import noted, processes
from tests.processes import kill_marked
from tests.ready import CLIENT, MARK_BYTES

pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(shutil.which("unshare") is None, reason="processes and mounts are watched as on Linux"),
]


@pytest.fixture
def place(tmp_path: Path, prefect_server: str, ready: list[str]) -> Iterator[Place]:
    place = Place(tmp_path, prefect_server, ready)
    yield place
    kill_marked(place.mark)


def finished(run: "subprocess.Popen[str]") -> str:
    """What a run that ends well wrote on standard error."""
    _, errors = run.communicate(timeout=LIMIT_S)
    assert run.returncode == 0, errors
    return errors


def spoil(folder: Path, how: str) -> None:
    """Every mesh of the asset: ``garbage`` bytes, a ``directory`` in its place, or ``truncated`` in mid-line."""
    for path in folder.rglob("*.obj"):
        text = path.read_bytes()
        path.unlink()
        if how == "directory":
            path.mkdir()
        else:
            path.write_bytes(bytes(range(256)) if how == "garbage" else text[: len(text) // 3])


SPOILT = ("garbage", "directory", "truncated")
OK = {
    "fine": "box_wooden",
    "one-garbage": "box_wooden",
    "once-abort": "scissors_paper",
    "once-sleepy": "bucket_yellow",
    "once-engine": "box_wooden",
    "forkserver": "box_chest",
}
BAD = {
    **dict.fromkeys(("hang", "segfault", "hungry", "raise"), ""),
    **dict.fromkeys((*SPOILT, "cut", "engine"), "box_wooden"),
}


def test_each_fault_of_an_asset_is_its_row_and_the_dead_are_tried_once_more(place: Place) -> None:
    """A segfault, a hang in C, hunger for memory, broken meshes, a child killed from outside, a killed fork server."""
    dataset(place.data, BAD | OK)
    for how in SPOILT:
        spoil(place.data / how, how)
    sorted((place.data / "one-garbage").rglob("*.obj"))[0].write_bytes(bytes(range(256)))
    urdf = place.data / "cut" / "mobility.urdf"
    urdf.write_bytes(urdf.read_bytes()[:900])
    run = start(place, "--workers", "2", FAULTY_TIME_LIMIT_S=20, FAULTY_MEMORY_LIMIT_MB=2000)
    assert_met(run, place, "once-sleepy")
    os.kill(processes(place.out, "once-sleepy")[0], signal.SIGKILL)
    finished(run)
    found = rows(place.out)
    assert set(found) == {*BAD, *OK}
    assert {name: row["failure_mode"] for name, row in found.items() if row["status"] != "ok"} == {
        "hang": "timeout", "segfault": "engine_crash", "hungry": "out_of_memory", "raise": "engine_crash",
        "engine": "engine_crash",
        **dict.fromkeys(SPOILT, "missing_mesh"), "cut": "unreadable_asset",
    }  # fmt: skip
    for name, words in {
        "hang": "died twice: not done after 20 s", "segfault": "killed by SIGSEGV", "raise": "KeyError: 'joint_7'",
        "engine": "died twice: pybullet crashed",
        "hungry": "more than the 2000 MB", "cut": "mobility.urdf", **dict.fromkeys(SPOILT, "link 'link_0'"),
    }.items():  # fmt: skip
        assert words in found[name]["reason"], found[name]["reason"]
    tried = {name: len(processes(place.out, name)) for name in found}
    twice = {"hang", "segfault", "hungry", "engine", "once-abort", "once-sleepy", "once-engine"}
    assert tried == {name: 2 if name in twice else 1 for name in found}
    once = findings(place.out, "died_once")
    assert set(once) == {"once-abort", "once-sleepy", "once-engine"}
    assert "SIGABRT" in once["once-abort"] and "SIGKILL" in once["once-sleepy"]
    assert "SIGSEGV" in once["once-engine"]
    assert "in abort" in (place.out / "logs" / "once-abort.first.log").read_text()
    assert set(findings(place.out, "unreadable_mesh")) >= {"one-garbage"}
    assert_nobody_left(place.mark)


def test_a_run_stopped_while_it_tries_the_dead_again_ends_at_once_with_all_records(place: Place) -> None:
    """And while it runs, a second one on the same folder is refused in one line."""
    dataset(place.data, {"a": "", "once-abort-sleepy": "", "sleepy": "", "b": ""})
    run = start(place, "--workers", "1")
    assert_met(run, place, "sleepy")
    second = start(place)
    _, errors = second.communicate(timeout=LIMIT_S)
    assert second.returncode == 2
    # On a busy machine Prefect's threads may say something after it.
    refused = [line for line in errors.splitlines() if line.startswith("asset2sim: ")]
    assert len(refused) == 1 and refused[0].startswith("asset2sim: another run (process ") and "Traceback" not in errors
    os.kill(processes(place.out, "sleepy")[0], signal.SIGKILL)
    assert_met(run, place, "sleepy", 2)
    os.kill(run.pid, signal.SIGTERM)
    _, errors = run.communicate(timeout=LIMIT_S)
    assert run.returncode == 130 and "interrupted; 4 finished assets" in errors and "Traceback" not in errors
    found = rows(place.out)
    assert {name for name, row in found.items() if row["status"] == "ok"} == {"a", "b", "once-abort-sleepy"}
    assert found["sleepy"]["failure_mode"] == "engine_crash" and "SIGKILL" in found["sleepy"]["reason"]
    assert_nobody_left(place.mark)


FULL_DISK = """
set -e
mount -t tmpfs -o size=16m tmpfs "$OUT"
home=$(mktemp -d)
mkfifo "$home/pipe"
ASSET2SIM_TEST_MARK=$ROOM "$PYTHON" -m tests.ready "$home/socket" 0<>"$home/pipe" &
until [ -S "$home/socket" ]; do kill -0 $! && sleep 0.1; done
trap "kill $!" EXIT
run() {
    code=0
    "$PYTHON" -SEc "$CLIENT" "$home/socket" \\
        -m tests.faulty refine "$DATA" --out "$OUT" $PLAIN --workers 1 --assets $2 2> "$SAID/$1.errors" || code=$?
    echo $code > "$SAID/$1.code"
    cp -r "$OUT/catalog" "$SAID/$1.tables"
}
run one fine,filler
run two early,once-hog,late,filler
rm "$OUT/junk"
run three early,once-hog,late,filler
cp -r "$OUT/met" "$SAID"
"""
"""Runs on a disk of 16 MB, which only processes begun there see, that of ``tests.ready`` as well: an asset fills it for
a moment, one leaves it full, and there is room again."""
MOUNTING = ["unshare", "-m" if os.geteuid() == 0 else "-Urm"]


def may_mount(folder: Path) -> bool:
    done = subprocess.run([*MOUNTING, "mount", "-t", "tmpfs", "tmpfs", str(folder)], capture_output=True, timeout=60)
    return done.returncode == 0


def test_a_full_disk_costs_what_met_it_and_the_next_run_goes_on(place: Place, tmp_path: Path) -> None:
    if not may_mount(tmp_path):
        pytest.skip("this machine lets nobody mount a file system of their own")
    said = tmp_path / "said"
    said.mkdir()
    place.out.mkdir()
    dataset(place.data, {"fine": "box_wooden", "early": "", "once-hog": "", "late": "box_chest", "filler": ""})
    environment = place.environment(
        OUT=place.out, DATA=place.data, SAID=said, PYTHON=sys.executable, PLAIN=" ".join(PLAIN),
        CLIENT=CLIENT, ROOM="-" * MARK_BYTES,
    )  # fmt: skip
    ran = subprocess.run(
        [*MOUNTING, "bash", "-c", FULL_DISK], cwd=ROOT, env=environment, text=True, capture_output=True, timeout=LIMIT_S
    )
    assert ran.returncode == 0, (ran.stderr, [path.read_text() for path in said.glob("*.errors")])
    assert [(said / f"{name}.code").read_text().strip() for name in ("one", "two", "three")] == ["0", "1", "0"]
    first, third = (rows(tables(said, name)) for name in ("one", "three"))
    assert {name: row["failure_mode"] for name, row in first.items()} == {"fine": "none", "filler": "disk_full"}
    assert "No space left on device" in first["filler"]["reason"]
    last_line = (said / "two.errors").read_text().splitlines()[-1]
    assert last_line.startswith(f"asset2sim: the disk of {place.out} is full")
    assert "Traceback" not in (said / "two.errors").read_text()
    assert_same_files(said / "one.tables", said / "two.tables")
    assert {name: row["failure_mode"] for name, row in third.items()} == {
        **dict.fromkeys(("fine", "early", "once-hog", "late"), "none"), "filler": "disk_full",
    }  # fmt: skip
    # What had finished before the disk was full is not done again.
    assert len((said / "met" / "early").read_text().split()) == 1
    assert_nobody_left(place.mark)


def tables(said: Path, name: str) -> Path:
    """An output folder that holds the tables which a run left."""
    folder = said / f"{name}.out"
    shutil.copytree(said / f"{name}.tables", folder / "catalog")
    return folder


def assert_same_files(one: Path, two: Path) -> None:
    assert {path.name: path.read_bytes() for path in one.iterdir()} == {
        path.name: path.read_bytes() for path in two.iterdir()
    }


REAL = {"fine": "box_wooden", "once-sleepy": "bucket_yellow", "planted": "planted_missing_mesh", "box": "box_chest"}
SLOW = {f"slow-{number}": "" for number in range(4)}


def test_a_killed_worker_and_a_restarted_scheduler_cost_nothing_but_time(place: Place, tmp_path: Path) -> None:
    """The tables are those of a local run, and no asset has to be tried alone."""
    dataset(place.data, REAL | SLOW)
    alone = replace(place, folder=tmp_path / "alone")
    shutil.copytree(place.data, alone.data)
    noted(alone.out, "once-sleepy")  # its fault is over there
    local = start(alone, "--workers", "2")
    cluster = programs(place.environment(), tmp_path)
    scheduler, workers = start_scheduler(cluster), start_workers(cluster, 2)
    await_workers(cluster.address, 2, LIMIT_S)
    finished(local)
    run = start(place, "--scheduler", cluster.address)
    assert_met(run, place, "once-sleepy")
    os.kill(worker_of(processes(place.out, "once-sleepy")[0]), signal.SIGKILL)
    assert_met(run, place, "slow-1")
    scheduler.kill()
    assert scheduler.wait() and workers.wait(LIMIT_S) is not None
    start_scheduler(cluster)
    start_workers(cluster, 1)
    errors = finished(run)
    assert "went away; waiting 60 s for it" in errors and "is back" in errors and "Traceback" not in errors
    assert differing(place.out, alone.out) == {}
    assert findings(place.out, "died_once") == {}
    # Once more is done what the killed worker had in work, and what the two had that the scheduler took along.
    tried = {name: len(processes(place.out, name)) for name in REAL | SLOW}
    assert tried["once-sleepy"] >= 2 and sum(tried.values()) <= len(tried) + 1 + 2, tried
    kill_marked(place.mark)


def differing(one: Path, two: Path) -> dict[str, dict[Hashable, tuple[object, object]]]:
    """Asset id → the columns of ``assets`` in which two folders differ, but for times and what names the run."""
    first, second = rows(one), rows(two)
    assert list(first) == list(second)
    found: dict[str, dict[Hashable, tuple[object, object]]] = {}
    for name, row in first.items():
        for column, value in row.items():
            # A question that was paid for by a worker that is lost is answered from the cache the second time.
            named = column in ("run_id", "source_path", "content_hash", "cached_calls")
            named = named or str(column).startswith(("seconds", "processor_s"))
            if not named and str(value) != str(second[name][column]):
                found.setdefault(name, {})[column] = (value, second[name][column])
    return found
