"""Sweeps: a free drawer, one stopped by a hull, by authored geometry, by another joint; and Φ over all pairs."""

import math
from pathlib import Path

import pytest

from asset2sim.checks.rig import CauseOf
from asset2sim.checks.sweep import sweep_records, sweep_verdict
from schemas.interaction import Sweep
from schemas.vocabulary import Engine, FailureMode, OverlapCause
from tasks.measure import overlap_pairs
from tests.builders import UrdfJoint
from tests.interaction_objects import (
    ENGINES,
    LIMITS,
    SETTINGS,
    Subject,
    authored_cause,
    bare,
    hull_cause,
    interaction,
    opened,
    solid,
    subject,
)

pytestmark = pytest.mark.system

DRAWER = UrdfJoint("slide", "prismatic", "base", "drawer", (1.0, 0.0, 0.0), (0.0, 0.0, 0.5), 0.0, 0.4, friction=1.0)


def cabinet(folder: Path, stop_at: float | None = None) -> Subject:
    """A drawer that slides 40 cm along x; a post stands so that it meets the drawer ``stop_at`` metres on its way."""
    links = [bare("base", 10.0), solid("drawer", (0.3, 0.3, 0.1))]
    joints = [DRAWER]
    if stop_at is not None:
        links.append(solid("post", (0.1, 0.1, 0.1)))
        # Not welded to the base: MuJoCo takes what is welded to a part's parent for the parent, and filters it.
        at = (0.15 + stop_at + 0.05, 0.0, 0.5)
        joints.append(UrdfJoint("give", "prismatic", "base", "post", (0.0, 0.0, 1.0), at, -1e-3, 1e-3, friction=1.0))
    return subject(folder, links, joints)


def rack(folder: Path, *, both: bool = False) -> Subject:
    """A rack behind a door: the door hangs in front of it while closed, and swings clear. ``both`` puts a post further
    on, below the door."""
    links = [bare("base", 10.0), solid("drawer", (0.3, 0.3, 0.1)), solid("door", (0.02, 0.4, 0.06), (0.0, 0.2, 0.0))]
    door = UrdfJoint("hinge", "revolute", "base", "door", (0.0, 0.0, 1.0), (0.18, -0.2, 0.52), -2.0, 0.0, friction=0.2)
    joints = [DRAWER, door]
    if both:
        links.append(solid("post", (0.1, 0.1, 0.03)))
        joints.append(UrdfJoint("glue", "fixed", "base", "post", xyz=(0.4, 0.0, 0.46)))
    return subject(folder, links, joints)


def swept(item: Subject, engine: Engine, cause: CauseOf) -> dict[str, Sweep]:
    with opened(item, engine) as world:
        records, _ = sweep_records(world, item.item, SETTINGS, LIMITS, cause)
    return {record.joint: record for record in records}


@pytest.mark.parametrize("engine", ENGINES)
def test_a_free_drawer_and_one_that_a_hull_stops(tmp_path: Path, engine: Engine) -> None:
    item = cabinet(tmp_path)
    record = swept(item, engine, hull_cause)["slide"]
    assert record.free_share == 1.0 and record.obstacles == ()
    assert sweep_verdict(record, item.overlay.joints[0], None, engine, LIMITS).passed
    item = cabinet(tmp_path, stop_at=0.2)
    record = swept(item, engine, hull_cause)["slide"]
    assert record.free_upper == pytest.approx(0.2, abs=0.006) and record.free_lower == 0.0
    (obstacle,) = record.obstacles
    assert {obstacle.link_a, obstacle.link_b} == {"drawer", "post"} and obstacle.depth_m > LIMITS.sweep_overlap_m
    verdict = sweep_verdict(record, item.overlay.joints[0], None, engine, LIMITS)
    assert not verdict.passed and verdict.value == pytest.approx(0.5, abs=0.02)
    assert "'drawer'" in verdict.reason and "'post'" in verdict.reason and "hull" in verdict.reason


def test_authored_geometry_in_the_way_is_told_and_does_not_fail(tmp_path: Path) -> None:
    item = cabinet(tmp_path, stop_at=0.2)
    record = swept(item, Engine.PYBULLET, authored_cause)["slide"]
    verdict = sweep_verdict(record, item.overlay.joints[0], None, "pybullet", LIMITS)
    assert verdict.passed and verdict.value == pytest.approx(0.5, abs=0.02)
    assert "authored geometry stops it" in verdict.reason and "'post'" in verdict.reason


def test_no_excuse_frees_a_joint_that_hardly_moves(tmp_path: Path) -> None:
    item = cabinet(tmp_path, stop_at=0.1)
    record = swept(item, Engine.PYBULLET, authored_cause)["slide"]
    verdict = sweep_verdict(record, item.overlay.joints[0], None, "pybullet", LIMITS)
    assert not verdict.passed and verdict.limit == LIMITS.sweep_excused_share
    assert verdict.value == pytest.approx(0.25, abs=0.02) and "moves too little" in verdict.reason


@pytest.mark.parametrize(("height", "share"), [(0.5, 1.0), (0.15, 0.7)])
def test_the_floor_ends_the_way_of_a_flap_that_hangs_low(tmp_path: Path, height: float, share: float) -> None:
    """A flap of 20 cm, hinged at its upper edge ``height`` over the floor, goes from level to upright downwards."""
    links = [
        solid("post", (0.3, 0.3, 0.6), (0.0, 0.0, 0.3), 5.0),
        solid("flap", (0.2, 0.2, 0.01), (0.1, 0.0, 0.0), 0.3),
    ]
    hinge = UrdfJoint("hinge", "revolute", "post", "flap", (0.0, 1.0, 0.0), (0.16, 0.0, height), 0.0, 1.2)
    record = interaction(Engine.MUJOCO, subject(tmp_path, links, [hinge]), only=FailureMode.JAM).sweeps[0]
    assert record.free_share == pytest.approx(share, abs=0.03)
    causes = [obstacle.cause for obstacle in record.obstacles]
    assert causes == ([] if share == 1.0 else [OverlapCause.FLOOR])


@pytest.mark.parametrize("higher", [0.0, 0.002])
def test_two_that_lie_on_one_are_moved_away_together(tmp_path: Path, higher: float) -> None:
    """A flap under two others, one perhaps ``higher``, opens once both are open; neither alone frees it."""
    links = [bare("base", 10.0), solid("under", (0.2, 0.3, 0.01), (0.1, 0.0, 0.0))]
    joints = [UrdfJoint("hinge", "revolute", "base", "under", (0.0, -1.0, 0.0), (0.0, 0.0, 0.5), 0.0, 1.5)]
    for side in (1.0, -1.0):
        links.append(solid(f"over{side:+.0f}", (0.2, 0.15, 0.01), (0.1, -0.075 * side, 0.0)))
        at = (0.0, 0.18 * side, 0.515 + (higher if side > 0.0 else 0.0))
        joints.append(
            UrdfJoint(f"hinge{side:+.0f}", "revolute", "base", links[-1].name, (side, 0.0, 0.0), at, -2.5, 0.0)
        )
    record = swept(subject(tmp_path, links, joints), Engine.PYBULLET, authored_cause)["hinge"]
    assert record.free_share > 0.9 and len(record.others) == 2


def test_the_cause_is_asked_for_where_it_jams(tmp_path: Path) -> None:
    asked: list[tuple[str, str, float]] = []

    def cause(a: str, b: str, positions: object) -> OverlapCause:
        assert isinstance(positions, dict)
        asked.append((a, b, positions["slide"]))
        return OverlapCause.HULL

    swept(cabinet(tmp_path, stop_at=0.2), Engine.PYBULLET, cause)
    a, b, position = asked[0]
    assert {a, b} == {"drawer", "post"} and position == pytest.approx(0.2, abs=0.01)
    # A hull is in the way: it is asked further on, to the end of the range, whether the meshes would be too.
    further = [q for _, _, q in asked[1:]]
    assert further == sorted(further) and further[0] > position and further[-1] == pytest.approx(0.4)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_rack_behind_a_closed_door_is_not_jammed(tmp_path: Path, engine: Engine) -> None:
    item = rack(tmp_path)
    record = swept(item, engine, hull_cause)["slide"]
    assert record.free_share == 1.0 and record.others == {"hinge": -2.0}
    verdict = sweep_verdict(record, item.overlay.joints[0], None, engine, LIMITS)
    assert verdict.passed and "'hinge'" in verdict.reason


def test_what_is_in_the_way_at_either_end_is_moved_halfway(tmp_path: Path) -> None:
    """A leaf that lies across the way at both ends of its half turn, and hangs below it between them."""
    links = [bare("base", 10.0), solid("drawer", (0.3, 0.3, 0.1)), solid("leaf", (0.02, 0.2, 0.06), (0.0, 0.1, 0.0))]
    leaf = UrdfJoint("hinge", "revolute", "base", "leaf", (1.0, 0.0, 0.0), (0.18, 0.0, 0.44), -math.pi, 0.0)
    record = swept(subject(tmp_path, links, [DRAWER, leaf]), Engine.PYBULLET, authored_cause)["slide"]
    assert record.free_share == 1.0 and record.others == {"hinge": pytest.approx(-math.pi / 2.0)}


def test_a_rack_that_something_else_stops_too_is_jammed_there(tmp_path: Path) -> None:
    item = rack(tmp_path, both=True)
    record = swept(item, Engine.PYBULLET, hull_cause)["slide"]
    assert set(record.others) == {"hinge"} and record.free_upper == pytest.approx(0.2, abs=0.006)
    assert not sweep_verdict(record, item.overlay.joints[0], None, "pybullet", LIMITS).passed


def test_an_overlap_that_is_there_from_the_start_is_no_jam(tmp_path: Path) -> None:
    links = [bare("base", 10.0), solid("drawer", (0.3, 0.3, 0.1)), solid("rail", (0.8, 0.3, 0.1))]
    joints = [DRAWER, UrdfJoint("glue", "fixed", "base", "rail", xyz=(0.2, 0.0, 0.408))]
    record = swept(subject(tmp_path, links, joints), Engine.PYBULLET, hull_cause)["slide"]
    assert record.free_share == 1.0


def test_a_wheel_is_swept_over_one_turn(tmp_path: Path) -> None:
    links = [bare("base", 10.0), solid("wheel", (0.3, 0.05, 0.05), (0.15, 0.0, 0.0)), solid("post", (0.1, 0.1, 0.1))]
    joints = [
        UrdfJoint("axle", "continuous", "base", "wheel"),
        UrdfJoint("glue", "fixed", "base", "post", xyz=(-0.3, 0, 0)),
    ]
    record = swept(subject(tmp_path, links, joints), Engine.PYBULLET, hull_cause)["axle"]
    assert record.upper - record.lower == pytest.approx(6.283, abs=1e-3)
    assert 0.85 < record.free_share < 0.95 and len(record.obstacles) == 2


def test_all_pairs_hold_parent_and_child_but_not_what_is_welded(tmp_path: Path) -> None:
    links = [solid("base", (0.2, 0.2, 0.2)), solid("lid", (0.2, 0.2, 0.2)), solid("plate", (0.2, 0.2, 0.2)),
             solid("knob", (0.05, 0.05, 0.05))]  # fmt: skip
    joints = [
        UrdfJoint("hinge", "revolute", "base", "lid", xyz=(0.0, 0.0, 0.19)),
        UrdfJoint("glue", "fixed", "base", "plate", xyz=(0.19, 0.0, 0.0)),
        UrdfJoint("turn", "continuous", "lid", "knob", xyz=(0.0, 0.0, 0.5)),
    ]
    item = subject(tmp_path, links, joints)
    found = overlap_pairs(item.urdf, {}, authored_cause, SETTINGS)
    names = {(pair.pair.link_a, pair.pair.link_b): pair for pair in found}
    assert names["base", "lid"].related and names["base", "lid"].pair.depth_m == pytest.approx(0.01, abs=2e-3)
    assert not names["lid", "plate"].related and names["lid", "plate"].cause is OverlapCause.AUTHORED
    assert ("base", "plate") not in names and not any("knob" in pair for pair in names)
