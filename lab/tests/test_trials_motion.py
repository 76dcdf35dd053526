"""Recorded interactions in MuJoCo: a drawer pushed shut, a block lifted, parts that overlap, and what is out of reach;
work and energy beside what can be computed by hand."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="MuJoCo is not installed here")
from asset2sim.assets.authored import read_overlay
from asset2sim.gym.arm.franka import HOME, Arm, franka_spec, waiting
from asset2sim.gym.arm.planning import SETTLE_S, ToolPlan
from asset2sim.gym.arm.scene import base_at, build_stage
from asset2sim.gym.arm.tasks import Task, Verb, joint_of, tasks_of
from lab.runner import do_job
from lab.schemas.settings import TrialSettings
from lab.trials.actors import arm_faces
from lab.trials.film import film, film_frames, write_mp4
from lab.trials.physical_judge import judge
from lab.trials.record import record
from lab.trials.scene import pushed_stage
from lab.trials.study import STUDY, TrialJob
from lab.trials.trial import FILM, TRACK, missing, planned, run_trial
from tests.assets import joint, link, robot, shape
from tests.factories import make_joint
from tests.refined_things import DAMPING, FRICTION_N, OPEN_M, block, inertial, refined
from tests.refined_things import drawer as made_drawer

pytestmark = pytest.mark.system
CLOSE = Task("close", Verb.CLOSE)


@pytest.fixture
def drawer(tmp_path: Path) -> Path:
    return made_drawer(tmp_path / "thing")


def test_the_arm_reaches_points_in_front_of_it_and_says_where_it_cannot() -> None:
    arm, down = Arm(), np.array([0.0, 0.0, -1.0])
    for point in ([0.5, 0.0, 0.05], [0.45, 0.25, 0.2], [0.6, -0.2, 0.1]):
        found = arm.reach(np.array(point), down, HOME)
        tip, axes = arm.tool(found.joints)
        assert np.abs(tip - point).max() < 1e-3 and axes[:, 2] @ down > 0.999
    assert arm.reach(np.array([1.4, 0.0, 0.1]), down, HOME).off_m > 0.3


def test_the_servos_hold_the_arm_up_where_they_are_told(drawer: Path) -> None:
    stage = build_stage(drawer, franka_spec(), base_at(0.0, 1.0))
    plan = ToolPlan(stage.base, np.array([0.0, 1.0]), np.array([waiting(), waiting()]), ("settle", "rest"))
    assert np.abs(record(stage, plan, {}).tool[-1] - waiting()).max() < 2e-3


def test_a_drawer_is_pushed_shut_with_the_work_that_its_friction_and_damping_take(drawer: Path) -> None:
    overlay = read_overlay(drawer)
    assert tasks_of(overlay) == (CLOSE,)
    attempt, _ = planned(drawer, CLOSE, overlay.joints[0])
    assert attempt is not None and attempt.tool == "arm"
    track = record(attempt.stage, attempt.plan, attempt.stage.about.positions_at())
    assert track.finite and track.positions[-1, 0] == pytest.approx(0.0, abs=0.003)
    first = int(np.flatnonzero(track.touched)[0])
    assert track.times_s[first] > SETTLE_S and np.abs(track.positions[:first] - OPEN_M).max() < 1e-4
    speed = track.speeds[:, 0]
    lost = FRICTION_N * np.abs(np.diff(track.positions[:, 0])).sum() + DAMPING * np.trapezoid(speed**2, track.times_s)
    assert track.work_j.sum() == pytest.approx(lost, rel=0.1)
    assert track.given_j.sum() < 0.01 * lost
    assert track.depth_m.max() < 0.003


def test_a_trial_keeps_recording_and_row_and_its_film_plays(drawer: Path, tmp_path: Path) -> None:
    row = run_trial(drawer, CLOSE, tmp_path / "to", False, TrialSettings())
    assert (row["outcome"], row["reason"], row["tool"], row["score"]) == ("done", "", "arm", 5.0)
    assert (tmp_path / "to" / TRACK).is_file() and not (tmp_path / "to" / FILM).exists()


def test_a_film_shows_the_object_as_the_recording_has_it(drawer: Path, tmp_path: Path) -> None:
    av = pytest.importorskip("av", reason="av is not installed here")
    stage = pushed_stage(drawer)
    away = np.array([[0.4, 0.0, 0.2]] * 2)
    plan = ToolPlan(np.eye(4), np.array([0.0, 0.14]), away, ("settle", "rest"))
    track = record(stage, plan, {"slide": OPEN_M})
    shut = record(stage, plan, {"slide": 0.0})
    assert len(film_frames(track)) == 3
    pictures = list(film(drawer, track, np.eye(4), None))
    assert pictures[0].shape == (512, 512, 3)
    other = next(film(drawer, shut, np.eye(4), None))
    changed = (np.abs(pictures[0].astype(int) - other) > 20).any(axis=2)
    assert 500 < changed.sum() < 60_000
    assert write_mp4(iter(pictures), tmp_path / FILM) == 3
    with av.open(str(tmp_path / FILM)) as file:
        (stream,) = file.streams.video
        assert (stream.codec_context.name, stream.average_rate) == ("h264", 15)
        decoded = [frame.to_ndarray(format="rgb24") for frame in file.decode(stream)]
    assert len(decoded) == 3 and np.abs(decoded[0].astype(int) - pictures[0]).mean() < 3.0


def test_a_film_shows_the_action_and_not_the_waiting(drawer: Path) -> None:
    stage = pushed_stage(drawer)
    plan = ToolPlan(np.eye(4), np.array([0.0, 6.0]), np.array([[0.4, 0.0, 0.2]] * 2), ("settle", "rest"))
    track = record(stage, plan, {"slide": OPEN_M})
    waits = track.times_s[film_frames(track)]
    assert waits[0] == 0.0 and waits[-1] > 5.9, "nothing happens: all is shown"
    late: Any = (track.times_s > 3.0) & (track.times_s < 3.5)
    touch = replace(track, touched=late)
    shown = track.times_s[film_frames(touch)]
    assert shown[0] == pytest.approx(2.0, abs=0.08) and shown[-1] == pytest.approx(4.5, abs=0.08)
    slid = replace(touch, positions=OPEN_M - 0.05 * np.clip(track.times_s - 1.5, 0.0, 0.5)[:, None])
    shown = track.times_s[film_frames(slid)]
    assert shown[0] == pytest.approx(0.5, abs=0.08), "what moves before it is touched is seen"


def test_the_guards_of_learning_hold_for_what_is_recorded(drawer: Path) -> None:
    """The recorded push is the arm's; the same with the cabinet shoved, tipped, or the drawer untouched is not."""
    overlay = read_overlay(drawer)
    joint = joint_of(CLOSE, overlay)
    assert joint is not None
    attempt, _ = planned(drawer, CLOSE, joint)
    assert attempt is not None
    track = record(attempt.stage, attempt.plan, attempt.stage.about.positions_at())
    assert missing(track, CLOSE, joint, attempt.stage) == ""
    there_and_back = np.sin(np.linspace(0.0, np.pi, len(track.times_s)))
    turned, shoved = track.poses.copy(), track.poses.copy()
    shoved[:, :, 0, 3] += 0.06 * there_and_back[:, None]
    assert "shoved by 6 cm" in missing(replace(track, poses=shoved), CLOSE, joint, attempt.stage)
    angles = 0.3 * there_and_back[:, None]
    turned[:, :, 0, 0] = turned[:, :, 2, 2] = np.cos(angles)
    turned[:, :, 0, 2], turned[:, :, 2, 0] = np.sin(angles), -np.sin(angles)
    assert "tilted by 17°" in missing(replace(track, poses=turned), CLOSE, joint, attempt.stage)
    alone = replace(track, touched=np.zeros_like(track.touched))
    assert "of its way untouched" in missing(alone, CLOSE, joint, attempt.stage)


def test_the_arm_is_drawn_with_all_its_links() -> None:
    faces, poses = arm_faces()
    assert {"panda_link1", "panda_hand", "panda_leftfinger"} <= set(faces.links) and len(poses) > 10


def test_a_block_is_lifted_into_the_bowl(tmp_path: Path) -> None:
    folder = block(tmp_path / "thing", 0.05, 0.2)
    row = run_trial(folder, Task("grasp", Verb.GRASP), tmp_path / "to", False, TrialSettings())
    assert (row["outcome"], row["reason"]) == ("done", "")
    assert not row["energy_appeared"] and not row["moved_before_contact"]


def test_a_block_too_wide_for_the_hand_is_unreachable_and_no_error(tmp_path: Path) -> None:
    folder = block(tmp_path / "thing", 0.2, 1.0)
    row = run_trial(folder, Task("grasp", Verb.GRASP), tmp_path / "to", False, TrialSettings())
    assert row["outcome"] == "unreachable" and "score" not in row


def test_parts_that_overlap_burst_apart_and_the_judge_says_so(tmp_path: Path) -> None:
    doors = [
        joint(name, "revolute", "body", part, xyz=f"{x} 0 {z}", axis="0 1 0", limit="-1.5 1.5")
        for name, part, x, z in (("left", "one", -0.05, 0.2), ("right", "two", 0.05, 0.212))
    ]
    plate = shape("0.12 0.1 0.02") + inertial(0.2, 0.1)
    urdf = robot(
        link("body", shape("0.2 0.2 0.1", xyz="0 0 0.05") + inertial(3.0, 0.2)), link("one", plate), link("two", plate),
        *doors,
    )  # fmt: skip
    changes = {"lower": -1.5, "upper": 1.5, "closed": -1.0, "open": 1.5, "holds": True, "friction": 0.2}
    terms = [make_joint(name, initial_position=0.0).model_copy(update=changes) for name in ("left", "right")]
    folder = refined(tmp_path / "thing", urdf, terms, {"body": 3.0, "one": 0.2, "two": 0.2})
    stage = pushed_stage(folder)
    plan = ToolPlan(np.eye(4), np.array([0.0, 1.0]), np.array([[0.6, 0.0, 0.3]] * 2), ("settle", "rest"))
    assert stage.moving_kg == pytest.approx(0.4)
    found = judge(record(stage, plan, stage.about.positions_at()), stage.moving_kg, (), (), TrialSettings())
    assert found.moved_before_contact and found.energy_appeared


def test_what_breaks_in_a_child_is_a_row(drawer: Path, tmp_path: Path) -> None:
    (drawer / "overlay.json").write_text("{", encoding="utf-8")
    (row,) = do_job(STUDY, TrialJob(tmp_path, drawer, CLOSE, "direct", "none", None, False), "")["trials"]
    assert row["outcome"] == "failed" and "overlay" in str(row["reason"]).lower() + "overlay"
    assert row["method"] == "direct" and row["recorded_at"] is not None


def test_a_task_that_starts_solved_is_not_done(tmp_path: Path, drawer: Path) -> None:
    overlay = json.loads((drawer / "overlay.json").read_text())
    overlay["joints"][0]["initial_position"] = 0.001
    (drawer / "overlay.json").write_text(json.dumps(overlay), encoding="utf-8")
    row = run_trial(drawer, CLOSE, tmp_path / "to", False, TrialSettings())
    assert row["outcome"] == "solved at start" and not (tmp_path / "to" / TRACK).exists()


def test_a_shut_drawer_with_a_knob_is_pulled_open(tmp_path: Path) -> None:
    knob = shape("0.05 0.02 0.02", "visual collision", "0.035 0 0").replace("<visual>", '<visual name="knob">')
    urdf = robot(
        link("body", shape("0.2 0.2 0.16", xyz="0 0 0.08") + inertial(3.0, 0.2)),
        link("front", shape("0.02 0.18 0.1") + knob + inertial(0.3, 0.1)),
        joint("slide", "prismatic", "body", "front", xyz="0.112 0 0.09", axis="1 0 0", limit="0 0.12"),
    )
    changes = {"upper": 0.12, "open": 0.12, "friction": FRICTION_N, "damping": DAMPING, "holds": True}
    terms = make_joint("slide", "prismatic", 0.0).model_copy(update=changes)
    folder = refined(tmp_path / "thing", urdf, [terms], {"body": 3.0, "front": 0.3})
    row = run_trial(folder, Task("open", Verb.OPEN), tmp_path / "to", False, TrialSettings())
    assert (row["outcome"], row["reason"], row["tool"]) == ("done", "", "arm")
    assert row["end"] == pytest.approx(0.04, abs=0.006) and row["work_j"] == pytest.approx(FRICTION_N * 0.04, rel=0.5)
