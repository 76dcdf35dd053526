"""Opening efforts agree with theory in each engine: friction, gravity, springs; what cannot be moved is told."""

import math
from pathlib import Path

import pytest

from asset2sim.checks.opening import VISIBLE_M, openings
from asset2sim.checks.sweep import sweep_verdict
from schemas.interaction import Opening, Sweep
from schemas.overlay import JointPhysics
from schemas.vocabulary import Engine, FailureMode
from tests.builders import UrdfJoint
from tests.interaction_objects import ENGINES, LIMITS, SETTINGS, Subject, bare, opened, solid, subject
from tests.test_checks_motion import lid

pytestmark = pytest.mark.system

G = 9.81
WITHIN = 0.03
"""How far a measured effort may be from the closed form."""


def efforts(item: Subject, engine: Engine) -> dict[str, Opening]:
    with opened(item, engine) as world:
        return {record.joint: record for record in openings(world, item.item, SETTINGS)}


@pytest.mark.parametrize("engine", ENGINES)
def test_a_door_takes_its_friction_both_ways(tmp_path: Path, engine: Engine) -> None:
    joint = UrdfJoint("hinge", "revolute", "base", "door", lower=0.0, upper=1.5, damping=0.5, friction=0.4)
    item = subject(tmp_path, [bare("base"), bare("door", 2.0, (0.2, 0.0, 0.0), 0.05)], [joint], start={"hinge": 0.7})
    record = efforts(item, engine)["hinge"]
    assert record.opening == pytest.approx(0.4, rel=WITHIN)
    assert record.closing == pytest.approx(0.4, rel=WITHIN)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_lid_takes_its_weight_and_friction_to_open_and_less_to_close(tmp_path: Path, engine: Engine) -> None:
    item = lid(tmp_path, friction=0.5, start=0.9)
    load = 0.5 * G * 0.15 * math.cos(0.9)
    record = efforts(item, engine)["hinge"]
    assert record.opening == pytest.approx(0.5 + load, rel=WITHIN)
    assert record.closing == pytest.approx(0.5 - load, rel=0.1)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_light_cover_on_a_light_magazine_takes_its_weight_though_both_sink_into_their_ends_at_first(
    tmp_path: Path, engine: Engine
) -> None:
    up = (0.0, -1.0, 0.0)
    joints = [
        UrdfJoint(name, "revolute", parent, child, up, lower=0.0, upper=1.6, damping=2e-4, friction=1e-5)
        for name, parent, child in (("magazine", "base", "tray"), ("cover", "tray", "lid"))
    ]
    light = [bare("tray", 0.05, (0.03, 0.0, 0.0), 1e-5), bare("lid", 0.026, (0.005, 0.0, 0.0), 1e-5)]
    item = subject(tmp_path, [bare("base"), *light], joints, start={"magazine": 0.0, "cover": 0.0})
    assert efforts(item, engine)["cover"].opening == pytest.approx(0.026 * G * 0.005, rel=WITHIN)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_leaf_takes_its_friction_though_a_second_one_folds_as_it_is_pushed(tmp_path: Path, engine: Engine) -> None:
    """A bifold door took 0 N: the second leaf swings back, so that the first gains speed faster than both would."""
    joints = [
        UrdfJoint(
            "first", "revolute", "base", "near", (0.0, 0.0, 1.0), lower=0.0, upper=1.5, damping=0.5, friction=2.0
        ),
        UrdfJoint("second", "revolute", "near", "far", (0.0, 0.0, -1.0), (0.4, 0.0, 0.0), 0.0, 3.0, 0.07, 0.3),
    ]
    leaf = [bare(name, 9.3, (0.2, 0.0, 0.0), 0.12) for name in ("near", "far")]
    item = subject(tmp_path, [bare("base"), *leaf], joints, start={"first": 0.0, "second": 0.0})
    assert efforts(item, engine)["first"].opening == pytest.approx(2.3, rel=0.15), "its own, and of what folds"


@pytest.mark.parametrize("engine", ENGINES)
def test_a_key_takes_its_spring_less_its_weight(tmp_path: Path, engine: Engine) -> None:
    joint = UrdfJoint("press", "prismatic", "base", "key", (0.0, 0.0, -1.0), lower=0.0, upper=0.01, damping=0.5,
                      stiffness=20.0, reference=-0.01)  # fmt: skip
    record = efforts(subject(tmp_path, [bare("base"), bare("key", 0.01, moment=1e-6)], [joint]), engine)["press"]
    visible = min(VISIBLE_M, 0.02 * 0.01)
    assert record.opening == pytest.approx(20.0 * (0.01 + visible) - 0.01 * G, rel=WITHIN)
    assert record.closing is None and not record.stuck


@pytest.mark.parametrize("engine", ENGINES)
def test_a_drawer_and_a_knob_on_it_each_take_their_own(tmp_path: Path, engine: Engine) -> None:
    x = (1.0, 0.0, 0.0)
    joints = [
        UrdfJoint("slide", "prismatic", "base", "drawer", x, upper=0.4, lower=0.0, friction=2.0, damping=4.0),
        UrdfJoint("turn", "continuous", "drawer", "knob", x, friction=0.02, damping=0.01),
    ]
    found = efforts(
        subject(tmp_path, [bare("base"), bare("drawer", 3.0), bare("knob", 0.05, moment=1e-4)], joints), engine
    )
    assert found["slide"].opening == pytest.approx(2.0, rel=WITHIN)
    assert found["turn"].opening == pytest.approx(0.02, rel=WITHIN)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_selector_takes_its_friction_and_the_most_of_its_detent(tmp_path: Path, engine: Engine) -> None:
    """0.01 N·m of friction and a click of 0.02: its friction alone moves it visibly, and it springs back."""
    click = (-0.4, 0.0, -0.02, 0.02, math.radians(30.0))
    joint = UrdfJoint("turn", "continuous", "base", "knob", friction=0.01, damping=0.002, bias=click)
    record = efforts(subject(tmp_path, [bare("base"), bare("knob", 0.05, moment=1e-4)], [joint]), engine)["turn"]
    assert record.opening == pytest.approx(0.03, rel=WITHIN) and record.closing == pytest.approx(0.03, rel=WITHIN)


@pytest.mark.parametrize("damping", [0.0, 0.05, 2.0])
def test_the_effort_does_not_depend_on_the_damper(tmp_path: Path, damping: float) -> None:
    joint = UrdfJoint("hinge", "revolute", "base", "door", lower=0.0, upper=1.5, damping=damping, friction=0.1)
    record = efforts(subject(tmp_path, [bare("base"), bare("door", moment=0.05)], [joint]), Engine.PYBULLET)["hinge"]
    assert record.opening == pytest.approx(0.1, rel=0.05) and record.closing is None


def test_what_falls_by_itself_takes_nothing_that_way(tmp_path: Path) -> None:
    record = efforts(lid(tmp_path, start=0.9), Engine.PYBULLET)["hinge"]
    load = 0.5 * G * 0.15 * math.cos(0.9)
    assert record.closing == pytest.approx(0.0, abs=0.05 * load)
    assert record.opening == pytest.approx(load, rel=0.05)


def test_a_heavy_door_is_not_stuck_that_its_limit_moves_slowly(tmp_path: Path) -> None:
    """1 N·m beyond its friction on 10 kg·m² is 0.1 rad/s²: 5 cm at the edge of a metre in a second, not in a third."""
    joint = UrdfJoint("hinge", "revolute", "base", "door", lower=-1.0, upper=1.0, friction=5.0, damping=0.5)
    item = subject(tmp_path, [bare("base"), bare("door", 30.0, moment=10.0)], [joint])
    item.urdf.write_text(item.urdf.read_text(encoding="utf-8").replace('effort="100"', 'effort="6"'), encoding="utf-8")
    record = efforts(item, Engine.PYBULLET)["hinge"]
    assert not record.stuck and record.opening == pytest.approx(5.0, rel=0.2)


def test_a_wedged_door_is_found_stuck_and_fails(tmp_path: Path) -> None:
    posts = [solid(f"post{i}", (0.05, 0.05, 0.05)) for i in range(2)]
    links = [bare("base"), solid("door", (0.4, 0.02, 0.4), (0.2, 0.0, 0.0)), *posts]
    joints = [UrdfJoint("hinge", "revolute", "base", "door", lower=-0.5, upper=0.5, friction=0.01)]
    joints += [UrdfJoint(f"glue{i}", "fixed", "base", f"post{i}", xyz=(0.3, 0.07 * i - 0.035, 0.0)) for i in range(2)]
    item = subject(tmp_path, links, joints)
    item.urdf.write_text(item.urdf.read_text(encoding="utf-8").replace('effort="100"', 'effort="2"'), encoding="utf-8")
    record = efforts(item, Engine.PYBULLET)["hinge"]
    assert record.stuck and record.opening is None and record.effort_limit == 2.0
    clear = Sweep(joint="hinge", lower=-0.5, upper=0.5, free_share=1.0)
    verdict = sweep_verdict(clear, joint_of(item), record, "pybullet", LIMITS)
    assert verdict.test is FailureMode.JAM and not verdict.passed and "stuck" in verdict.reason


def joint_of(item: Subject) -> JointPhysics:
    return item.overlay.joints[0]
