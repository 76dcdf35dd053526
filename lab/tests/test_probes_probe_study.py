"""Probe trials over real websockets: rows, resuming, and policies that die, with a stand-in for the scene."""

from dataclasses import replace
from pathlib import Path

import pytest

from asset2sim.catalog.own_files import read_own_files
from asset2sim.catalog.query import connect
from asset2sim.catalog.write import write_run
from lab.probes.policies import PROBES, PolicySpec, policy_spec
from lab.probes.probe_study import ProbeChoice, ProbeJob, chosen_tasks, jobs_of, probe_study, run_probes
from lab.probes.tasks import PAPER11
from lab.runner import latest_own, left_to_do
from lab.schemas.settings import ProbeSettings
from lab.schemas.tables import PROBE_TRIALS
from lab.tests import policy_servers as does
from lab.tests.probe_episodes import CRASHES
from lab.tests.test_probes_openpi import program
from schemas.errors import UnknownChoiceError, UsageError
from schemas.settings import RunSettings
from schemas.table import Row
from tests.factories import make_record
from tests.test_catalog_history import night

QUICK = ProbeSettings(connect_s=1.0, reconnect_s=0.5, first_answer_s=20.0, answer_s=0.5, trial_s=60.0)
RUN = RunSettings(workers=2)
BOX, LAPTOP = "100221", "9912"
TASKS = chosen_tasks(["paper11"])
SCRIPTED = PolicySpec("scripted")
STUDY = probe_study(QUICK)


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """An output in which a box and a laptop are refined, and a suitcase is not."""
    place = tmp_path / "out"
    place.mkdir()
    write_run(place, night(1), [make_record(name) for name in (BOX, LAPTOP, "103755")])
    for name in (BOX, LAPTOP):
        (place / "assets" / name).mkdir(parents=True)
        (place / "assets" / name / "overlay.json").write_text("{}", encoding="utf-8")
    return place


def done(jobs: list[ProbeJob], settings: ProbeSettings = QUICK, run: RunSettings = RUN) -> tuple[list[Row], int]:
    heard: list[Row] = []
    stand_in = "lab.tests.probe_episodes"
    jobs = [replace(job, episode=f"{stand_in}:run_episode", maker=f"{stand_in}:make_probe") for job in jobs]
    left = run_probes(jobs, run, settings, lambda _, row, left: heard.append(row))
    return heard, left


@pytest.mark.system
def test_trials_of_a_probe_are_rows_and_are_not_done_twice(out: Path) -> None:
    choice = ProbeChoice(TASKS, trials=2)
    jobs = jobs_of([out], SCRIPTED, choice)
    assert [(job.folder.name, job.task.name, job.seed) for job in jobs if job.trial == 1] == [
        (BOX, "box close", 1), (BOX, "box grasp", 1), (LAPTOP, "laptop fold", 1)
    ]  # fmt: skip
    assert left_to_do(STUDY, jobs) == jobs
    rows, left = done(jobs[:4])
    assert left == 0 and [row["outcome"] for row in rows] == ["done"] * 4
    trials = latest_own([out], PROBE_TRIALS)
    assert (
        len(trials) == 4 and trials["success"].all() and (trials["asked"] == 4).all() and (trials["steps"] == 32).all()
    )
    assert trials["ours"].all() and (trials["latency_s"] > 0.0).all() and (trials["distance"] <= 0.05).all()
    assert out.joinpath(trials["video"][0]).read_bytes() == b"film"
    assert set(trials["video"]) == {
        f"probes/scripted/{BOX}/{task}/{trial}/motion.mp4" for task in ("box-close", "box-grasp") for trial in (0, 1)
    }
    assert left_to_do(STUDY, jobs) == jobs[4:]
    assert left_to_do(STUDY, [replace(job, seed=7) for job in jobs[:4]]) != [], "another start is another trial"
    assert len(left_to_do(STUDY, [replace(job, run_id="next") for job in jobs[:4]])) == 4, (
        "the object was refined again"
    )
    assert len(left_to_do(STUDY, jobs_of([out], PolicySpec("noisy"), choice))) == 6
    with connect(out) as tables:
        assert tables.sql("SELECT count(*) FROM probe_trials WHERE success").fetchall() == [(4,)]


@pytest.mark.system
def test_a_policy_killed_midway_is_a_row_and_the_run_goes_on(out: Path, tmp_path: Path) -> None:
    with program("obey", str(tmp_path / "seen.npz")) as port:
        spec = PolicySpec("pi0.5-DROID", host="127.0.0.1", port=port)
        wrong = [replace(PAPER11["box close"], name=name) for name in (does.SLOW, does.NAN, does.DIE)]
        tasks = [PAPER11["box close"], *wrong, PAPER11["laptop fold"]]
        jobs = jobs_of([out], spec, ProbeChoice(tasks, trials=1))
        heard, left = done(jobs, QUICK.model_copy(update={"first_answer_s": 1.0}), RunSettings(workers=1))
    assert left == 0 and [row["outcome"] for row in heard] == [
        "not done",
        "policy timed out",
        "answer refused",
        "policy died",
        "policy unreachable",
    ]
    assert "ConnectionRefused" in str(heard[3]["reason"]) and heard[3]["asked"] == 1
    assert all(row["reason"] and row["success"] is None for row in heard[1:])
    assert heard[0]["success"] is False and heard[0]["protocol"] == "openpi" and heard[0]["ours"] is False
    assert len(left_to_do(STUDY, jobs)) == 4, "they are done again"


@pytest.mark.system
def test_a_run_that_finds_nobody_three_times_ends_and_says_how_much_is_left(out: Path) -> None:
    jobs = jobs_of([out], PolicySpec("gone", host="127.0.0.1", port=1), ProbeChoice(TASKS, trials=5))
    rows, left = done(jobs, QUICK.model_copy(update={"connect_s": 0.2}))
    assert len(rows) == 3 and left == 12 and {row["outcome"] for row in rows} == {"policy unreachable"}
    assert len(read_own_files(out, PROBE_TRIALS)) == 3 and len(left_to_do(STUDY, jobs)) == 15


@pytest.mark.system
def test_a_crash_and_a_probe_without_a_way_are_results_of_the_object(out: Path) -> None:
    reasons = {CRASHES: "killed by SIGKILL", "unplanned": "there is no way to it"}
    (job,) = jobs_of([out], SCRIPTED, ProbeChoice([PAPER11["laptop fold"]], trials=1))
    rows, left = done([replace(job, folder=out / "assets" / name) for name in reasons])
    assert left == 0 and len(rows) == 2
    for row in rows:
        assert (row["outcome"], row["success"]) == ("failed", False)
        assert reasons[str(row["asset_id"])] in str(row["reason"])


def test_what_cannot_be_asked_for_is_said_in_one_line(out: Path) -> None:
    with pytest.raises(UnknownChoiceError, match="box close"):
        chosen_tasks(["box clos"])
    with pytest.raises(UnknownChoiceError, match=BOX):
        jobs_of([out], SCRIPTED, ProbeChoice(TASKS, asset_ids=("100222",)))
    with pytest.raises(UnknownChoiceError, match="asset2sim"):
        jobs_of([out], SCRIPTED, ProbeChoice(TASKS, methods=("ivw",)))
    with pytest.raises(UsageError, match="no refined object"):
        jobs_of([out], SCRIPTED, ProbeChoice(chosen_tasks(["suitcase close"])))


def test_a_policy_is_an_address_or_a_probe_of_ours_whose_name_no_other_has() -> None:
    found = policy_spec("openpi://robot:8001", "pi0.5-DROID", "joint_position", "right")
    assert found == PolicySpec("pi0.5-DROID", "openpi", "robot", 8001, "joint_position", "right") and not found.ours
    assert policy_spec("gr00t://[::1]", None, "joint_velocity", "left").port == 5555
    assert policy_spec("openpi://h", None, "joint_velocity", "left").folder == "openpi-h"
    assert all(policy_spec(name, None, "joint_velocity", "left", Path(__file__)).ours for name in PROBES)
    for text, name in (("scripted", "pi0.5-DROID"), ("openpi://h", "cloned"), ("http://h", None), ("openpi://", None),
                       ("openpi://h:99999", None), ("openpi://h/path", None), ("pi0", None),
                       ("cloned", None)):  # fmt: skip
        with pytest.raises(UsageError):
            policy_spec(text, name, "joint_velocity", "left")
