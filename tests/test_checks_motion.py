"""Drop, nudge, hold, release and reset: objects that pass each, and objects that fail each for a known reason."""

import math
from pathlib import Path

import numpy as np
import pytest

from asset2sim.checks.drop import drop, drop_verdict
from asset2sim.checks.hold import hold_records, hold_verdict
from asset2sim.checks.mechanism import span_of
from asset2sim.checks.nudge import nudge_records, nudge_verdict
from asset2sim.checks.release import release_records, release_verdict
from asset2sim.checks.reset import perturbed_starts, reset_from, reset_verdict, slip_given
from asset2sim.checks.set_down import point_clouds, set_down
from asset2sim.engines.world import World
from schemas.interaction import Interaction
from schemas.verdict import CheckVerdict
from schemas.vocabulary import Engine
from tests.builders import UrdfJoint
from tests.interaction_objects import ENGINES, LIMITS, SETTINGS, Subject, bare, opened, solid, subject

pytestmark = pytest.mark.system

LID_MASS, LID_REACH = 0.5, 0.15


def lid(
    folder: Path, *, friction: float = 0.0, damping: float = 0.02, start: float = 0.0, hold: bool = False
) -> Subject:
    """A lid of 30 cm lying level at 0 and standing at π/2: gravity pulls it down with 0.74 cos q N·m."""
    joint = UrdfJoint(
        "hinge", "revolute", "base", "lid", (0.0, -1.0, 0.0), (0.0, 0.0, 0.2), 0.0, 1.5, damping, friction
    )
    parts = [solid("base", (0.1, 0.1, 0.1), mass=5.0), solid("lid", (0.3, 0.2, 0.01), (LID_REACH, 0.0, 0.0), LID_MASS)]
    return subject(folder, parts, [joint], start={"hinge": start}, holds=["hinge"] if hold else [])


def key(folder: Path, *, hz: float = 8.0, ratio: float = 1.0, mass: float = 0.01) -> Subject:
    """A key of 3 mm travel downwards, on a spring of this frequency and damping ratio, preloaded to 1.5 times its
    weight."""
    stiffness = mass * (2 * math.pi * hz) ** 2
    damping = 2 * ratio * math.sqrt(stiffness * mass)
    joint = UrdfJoint("press", "prismatic", "base", "key", (0.0, 0.0, -1.0), (0.0, 0.0, 0.2), 0.0, 0.003, damping, 0.0,
                      stiffness, -1.5 * mass * 9.81 / stiffness)  # fmt: skip
    return subject(folder, [solid("base", (0.1, 0.1, 0.1)), bare("key", mass, moment=1e-6)], [joint])


def free_of(item: Subject) -> dict[str, tuple[float, float]]:
    return {joint.name: span_of(joint) for joint in item.overlay.joints}


def let_go(item: Subject, world: World) -> list[CheckVerdict]:
    records = release_records(world, item.item, free_of(item), SETTINGS, LIMITS)
    return [release_verdict(record, item.overlay.joints[0], world.engine, LIMITS) for record in records]


@pytest.mark.parametrize("engine", ENGINES)
def test_a_lid_that_gravity_closes_falls_shut_and_one_that_is_damped_too_much_does_not(
    tmp_path: Path, engine: Engine
) -> None:
    with opened(lid(tmp_path), engine) as world:
        (verdict,) = let_go(lid(tmp_path), world)
    assert verdict.passed and "gravity" in verdict.reason
    sticky = lid(tmp_path, damping=20.0)
    with opened(sticky, engine) as world:
        (verdict,) = let_go(sticky, world)
    assert not verdict.passed and "does not get there" in verdict.reason
    assert verdict.value is not None and verdict.value > 0.2


def test_a_lid_that_its_friction_holds_is_not_expected_to_fall(tmp_path: Path) -> None:
    item = lid(tmp_path, friction=0.6)
    with opened(item) as world:
        assert let_go(item, world) == []


@pytest.mark.parametrize("engine", ENGINES)
def test_a_key_returns_to_its_stop(tmp_path: Path, engine: Engine) -> None:
    item = key(tmp_path)
    with opened(item, engine) as world:
        (record,) = release_records(world, item.item, free_of(item), SETTINGS, LIMITS)
        (verdict,) = let_go(item, world)
    assert record.start == pytest.approx(0.0015) and record.target == 0.0
    assert verdict.passed and "spring" in verdict.reason


def test_a_spring_rests_where_it_balances_gravity(tmp_path: Path) -> None:
    stiffness = 40.0
    joint = UrdfJoint("bob", "prismatic", "base", "mass", (0.0, 0.0, 1.0), lower=-0.5, upper=0.5, damping=8.0,
                      stiffness=stiffness, reference=0.1)  # fmt: skip
    item = subject(tmp_path, [bare("base"), bare("mass", 0.5)], [joint])
    with opened(item) as world:
        (record,) = release_records(world, item.item, free_of(item), SETTINGS, LIMITS)
    assert record.target == pytest.approx(0.1 - 0.5 * 9.81 / stiffness, abs=1e-6)
    assert record.end == pytest.approx(record.target, abs=2e-3)
    assert record.start == pytest.approx(record.target + 0.5 * (0.5 - record.target))


@pytest.mark.parametrize("engine", ENGINES)
def test_an_open_flap_holds_by_its_friction_and_falls_without(tmp_path: Path, engine: Engine) -> None:
    for friction, passes in ((1.1, True), (0.3, False)):
        item = lid(tmp_path, friction=friction, start=0.2, hold=True)
        with opened(item, engine) as world:
            verdict = hold_verdict(
                list(hold_records(world, item.item, SETTINGS, LIMITS)), item.overlay.joints[0], engine, LIMITS
            )
        assert verdict.passed is passes, verdict.reason


def test_a_joint_that_holds_everywhere_is_also_held_in_mid_range(tmp_path: Path) -> None:
    item = lid(tmp_path, friction=1.1, start=1.5, hold=True)
    with opened(item) as world:
        assert [record.position for record in hold_records(world, item.item, SETTINGS, LIMITS)] == [1.5, 0.75]
    item = lid(tmp_path, friction=0.4, start=1.5, hold=True)
    with opened(item) as world:
        assert [record.position for record in hold_records(world, item.item, SETTINGS, LIMITS)] == [1.5]


def test_a_rack_is_not_held_in_the_door_that_went_shut_again_for_another_rack(tmp_path: Path) -> None:
    """With the door ajar the lower rack runs into it and the upper one is free; shut, it is in the way of both."""
    links = [solid("base", (0.1, 0.1, 0.1), mass=5.0), solid("door", (0.02, 0.4, 0.6), (0.0, 0.0, 0.3))]
    links += [solid("low", (0.3, 0.3, 0.05)), solid("high", (0.3, 0.3, 0.05))]
    turn = UrdfJoint("turn", "revolute", "base", "door", (0.0, 1.0, 0.0), (0.2, 0.0, 0.2), 0.0, 1.5, friction=20.0)
    slides = [UrdfJoint(f"{name}_slide", "prismatic", "base", name, (1.0, 0.0, 0.0), (0.0, 0.0, height), 0.0, 0.3,
                        friction=5.0) for name, height in (("low", 0.25), ("high", 0.7))]  # fmt: skip
    item = subject(tmp_path, links, [turn, *slides], holds=["turn", "low_slide", "high_slide"])
    with opened(item) as world:
        records = hold_records(world, item.item, SETTINGS, LIMITS)
    assert max(record.moved for record in records) < 1e-3


@pytest.mark.parametrize("engine", ENGINES)
def test_a_damped_door_comes_to_rest_and_an_undamped_one_does_not(tmp_path: Path, engine: Engine) -> None:
    for damping, passes in ((0.1, True), (0.0, False)):
        joint = UrdfJoint("hinge", "continuous", "base", "door", damping=damping)
        item = subject(tmp_path, [bare("base"), bare("door", moment=0.01)], [joint])
        with opened(item, engine) as world:
            (record,) = nudge_records(world, item.item, SETTINGS, LIMITS)
        verdict = nudge_verdict(record, item.overlay.joints[0], engine, LIMITS)
        assert verdict.passed is passes, verdict.reason
    assert verdict.value == pytest.approx(1.0, abs=0.02)


def test_a_wheel_that_is_meant_to_coast_is_given_its_time(tmp_path: Path) -> None:
    joint = UrdfJoint("axle", "continuous", "base", "wheel", damping=0.01 / 1.5)
    item = subject(tmp_path, [bare("base"), bare("wheel", moment=0.01)], [joint])
    with opened(item) as world:
        (record,) = nudge_records(world, item.item, SETTINGS, LIMITS)
    assert record.seconds > SETTINGS.nudge_s
    assert nudge_verdict(record, item.overlay.joints[0], "pybullet", LIMITS).passed


def test_a_spring_that_the_step_cannot_bear_explodes_when_nudged(tmp_path: Path) -> None:
    wild = UrdfJoint("press", "prismatic", "base", "key", lower=-1e4, upper=1e4, stiffness=5.0 * 0.01 * 240.0**2)
    calm = UrdfJoint("rest", "prismatic", "base", "button", lower=0.0, upper=0.01, damping=0.5)
    item = subject(tmp_path, [bare("base"), bare("key", 0.01), bare("button", 0.01)], [wild, calm])
    with opened(item) as world:
        records = {record.joint: record for record in nudge_records(world, item.item, SETTINGS, LIMITS)}
    verdicts = {
        joint.name: nudge_verdict(records[joint.name], joint, "pybullet", LIMITS) for joint in item.overlay.joints
    }
    assert not verdicts["press"].passed and "explodes" in verdicts["press"].reason
    assert verdicts["rest"].passed


def test_a_key_is_nudged_no_faster_than_its_travel_allows(tmp_path: Path) -> None:
    item = key(tmp_path)
    with opened(item) as world:
        (record,) = nudge_records(world, item.item, SETTINGS, LIMITS)
    assert record.speed == pytest.approx(0.003 / 0.25)
    assert nudge_verdict(record, item.overlay.joints[0], "pybullet", LIMITS).passed


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("hz", [240.0, 60.0])
def test_a_dropped_block_lands_at_the_speed_of_its_fall(tmp_path: Path, engine: Engine, hz: float) -> None:
    item = subject(tmp_path, [solid("block", (0.2, 0.2, 0.1))], [])
    with opened(item, engine, plane=True, hz=hz) as world:
        record = drop(world, {}, SETTINGS)
    assert record.peak_speed_m_s == pytest.approx(np.sqrt(2 * 9.81 * 0.05), rel=0.2)
    assert drop_verdict(record, engine, LIMITS).passed and record.seconds < 1.5


def test_a_drop_that_ends_in_the_plane_or_in_motion_fails(tmp_path: Path) -> None:
    item = subject(tmp_path, [solid("block", (0.2, 0.2, 0.1))], [])
    with opened(item, plane=True) as world:
        record = drop(world, {}, SETTINGS)
    sunk = drop_verdict(record.model_copy(update={"sink_m": 0.02}), "pybullet", LIMITS)
    assert not sunk.passed and "20 mm deep" in sunk.reason
    rolling = drop_verdict(record.model_copy(update={"final_speed_m_s": 0.3}), "pybullet", LIMITS)
    assert not rolling.passed and rolling.value == 0.3


@pytest.mark.parametrize("engine", ENGINES)
def test_a_squat_box_stands_every_reset_and_a_top_heavy_pole_tips(tmp_path: Path, engine: Engine) -> None:
    for size, passes in (((0.3, 0.3, 0.2), True), ((0.02, 0.02, 0.6), False)):
        item = subject(tmp_path, [solid("block", size)], [])
        with opened(item, engine, plane=True) as world:
            _, resting, support = set_down(world, item.item, point_clouds(item.urdf), SETTINGS)
            records = [
                reset_from(world, item.item, *start, resting, support, SETTINGS, LIMITS)
                for start in perturbed_starts(SETTINGS)[:3]
            ]
        verdicts = [reset_verdict(record, i, Interaction(engine=engine), LIMITS) for i, record in enumerate(records)]
        assert all(verdict.passed is passes for verdict in verdicts), [verdict.reason for verdict in verdicts]
    assert verdicts[0].value is not None and verdicts[0].value > 1.0
    assert "from where it rests undisturbed" in verdicts[0].reason


def test_a_reset_sees_a_door_that_must_stay_and_does_not(tmp_path: Path) -> None:
    for friction, slips in ((6.0, False), (0.6, True)):
        item = lid(tmp_path, friction=friction, start=0.75, hold=True)
        with opened(item, plane=True) as world:
            _, resting, support = set_down(world, item.item, point_clouds(item.urdf), SETTINGS)
            record = reset_from(world, item.item, *perturbed_starts(SETTINGS)[0], resting, support, SETTINGS, LIMITS)
        verdict = reset_verdict(record, 0, Interaction(engine=Engine.PYBULLET), LIMITS)
        # A friction of a tenth over the load cannot brake a fall of 2 cm: the lid of a real box would fall shut.
        assert verdict.passed and ("cannot brake this fall" in verdict.reason) is slips, record
        assert (record.slip_given > LIMITS.reset_joint_share) is slips
    firm = record.model_copy(update={"slip_given": 0.02})
    failed = reset_verdict(firm, 0, Interaction(engine=Engine.PYBULLET), LIMITS)
    assert not failed.passed and "which must hold, moves over" in failed.reason
    further = record.model_copy(update={"slip_given": record.joint_motion / (1.01 * LIMITS.reset_slip_margin)})
    assert further.slip_given > LIMITS.reset_joint_share
    failed = reset_verdict(further, 0, Interaction(engine=Engine.PYBULLET), LIMITS)
    assert not failed.passed, "no fall takes it further than its energy does"


def test_what_rests_on_its_stop_is_braked_by_its_load_too(tmp_path: Path) -> None:
    given = {}
    for start in (0.0, 0.75):
        item = lid(tmp_path, friction=0.9, start=start, hold=True)
        with opened(item, plane=True) as world:
            _, _, support = set_down(world, item.item, point_clouds(item.urdf), SETTINGS)
        given[start] = slip_given(item.item, item.item.joints[0].name, *perturbed_starts(SETTINGS)[0], support)
    assert given[0.0] < 0.4 * given[0.75], "shut, its weight holds it down"


def test_starts_are_the_corners_and_the_same_every_time() -> None:
    found = perturbed_starts(SETTINGS)
    assert found == perturbed_starts(SETTINGS) and len(found) == len(set(found)) == 8
    assert {shift for shift, _ in found} == {
        (x, y, z) for x in (0.02, -0.02) for y in (0.02, -0.02) for z in (0.02, -0.02)
    }
    assert np.array([shift for shift, _ in found[::2]]).sum(axis=0) == pytest.approx([0, 0, 0])
    assert np.array([tilt for _, tilt in found[::2]]).sum(axis=0) == pytest.approx([0, 0, 0])
    more = perturbed_starts(SETTINGS.model_copy(update={"resets": 12}))
    assert more[:8] == found and more[8][0] == (0.01, 0.01, 0.01)
