"""Leaving objects alone in PyBullet: what rests, rolls, explodes and rings is recorded and judged as such."""

import math
from pathlib import Path

import numpy as np
import pytest

from asset2sim.arrays import Array
from asset2sim.engines.pybullet_object import loaded, stepper
from asset2sim.engines.pybullet_penetration import contact_points, contacts_at, penetration_probe
from asset2sim.engines.pybullet_rest import (
    BEYOND_MEASURE,
    SPEED_EVERY,
    TURN_FACTOR,
    Speeds,
    capped,
    measure,
    settle,
    stand,
    watch,
)
from asset2sim.metrics.penetration import penetration
from asset2sim.metrics.verdict import Verdict, judge, oscillating_joints
from schemas.measurement import Measurement
from schemas.settings import EngineSettings, Thresholds
from schemas.vocabulary import FailureMode
from tests.builders import ORIGIN, UrdfJoint, UrdfLink, ball_inertia, block_urdf, box, sphere, write_urdf

SETTINGS = EngineSettings(settle_s=1.0, test_s=1.0, drop_height_m=0.002)
STEP = SETTINGS.timestep_s
KNOB = UrdfLink("knob", 0.01, ORIGIN, ball_inertia(1e-4))
"""Something small on a joint: refined objects are articulated."""
BASE = UrdfLink("base", 20.0, ORIGIN, ball_inertia(0.5), ((box(0.3, 0.3, 0.2), ORIGIN),))
"""A heavy base of 0.2 m."""


def verdict(seen: Measurement, sliders: frozenset[str] = frozenset()) -> Verdict:
    return judge(seen, sliders, Thresholds())


def with_knob(folder: Path, body: UrdfLink) -> Path:
    return write_urdf(folder, [body, KNOB], [UrdfJoint("j", "revolute", body.name, "knob", friction=0.1)])


def ball(folder: Path, off_centre: float) -> Path:
    """A ball of 5 cm whose centre of mass lies beside its middle: it rolls if that is not 0."""
    shape = ((sphere(0.05), ORIGIN),)
    return with_knob(folder, UrdfLink("ball", 1.0, (off_centre, 0.0, 0.0), ball_inertia(1e-3), shape))


def mounted(folder: Path, part: UrdfLink, base: UrdfLink = BASE, **joint: object) -> Path:
    """A part on a joint ``j`` above a base that stands free."""
    fields: dict[str, object] = {"name": "j", "type": "revolute", "parent": "base", "child": part.name}
    return write_urdf(folder, [base, part], [UrdfJoint(**(fields | {"xyz": (0.0, 0.0, 0.3)} | joint))])  # type: ignore[arg-type]


def test_a_box_drops_and_rests(tmp_path: Path) -> None:
    urdf = with_knob(tmp_path, UrdfLink("body", 1.0, ORIGIN, ball_inertia(1.7e-3), ((box(0.1, 0.1, 0.1), ORIGIN),)))
    seen = measure(urdf, {}, 0.5, SETTINGS)
    assert verdict(seen).passed
    assert seen.drift_m < 1e-4 and seen.drift_rad < 1e-3 and seen.finite
    # Nothing is faster than the fall, v² = 2 g h.
    assert 0.0 < seen.peak_speed_m_s < 1.1 * math.sqrt(2 * 9.81 * SETTINGS.drop_height_m)
    assert (seen.engine, seen.timestep_s, seen.settle_s, seen.test_s) == ("pybullet", STEP, 1.0, 1.0)
    assert [motion.name for motion in seen.joints] == ["j"] and seen.joints[0].amplitude < 1e-6


def test_the_fall_is_as_fast_as_the_drop_is_high(tmp_path: Path) -> None:
    settings = SETTINGS.model_copy(update={"drop_height_m": 0.05})
    fastest, between_readings = math.sqrt(2 * 9.81 * 0.05), SPEED_EVERY * STEP * 9.81
    peak = measure(ball(tmp_path, 0.0), {}, 0.5, settings).peak_speed_m_s
    assert fastest - between_readings <= peak <= 1.02 * fastest


def test_a_balanced_ball_rests_and_a_lopsided_one_rolls(tmp_path: Path) -> None:
    assert verdict(measure(ball(tmp_path, 0.0), {}, 0.5, SETTINGS)).passed
    seen = measure(ball(tmp_path, 0.02), {}, 0.5, SETTINGS)
    assert seen.drift_m > 0.01 and seen.drift_rad > 0.1 and seen.finite
    assert verdict(seen).mode is FailureMode.DRIFT and "drifts" in verdict(seen).reason


@pytest.mark.parametrize("share", [0.5, 1.5])
def test_damping_below_the_bound_of_explicit_steps_is_stable(tmp_path: Path, share: float) -> None:
    assert verdict(measure(flap(tmp_path, share), {"j": -0.3}, 0.5, SETTINGS)).passed


@pytest.mark.parametrize("share", [3.0, 10.0])
def test_damping_beyond_it_explodes_and_is_judged_drift(tmp_path: Path, share: float) -> None:
    seen = measure(flap(tmp_path, share), {"j": -0.3}, 0.5, SETTINGS)
    assert not seen.finite or seen.peak_speed_m_s > Thresholds().peak_speed_m_s
    assert verdict(seen).mode is FailureMode.DRIFT and "explodes" in verdict(seen).reason


def flap(folder: Path, share: float) -> Path:
    """A light flap on a horizontal hinge whose damping is c = share · I / Δt, on a base that may give way."""
    part = UrdfLink("flap", 0.1, (0.2, 0.0, 0.0), ball_inertia(1e-4))
    damping = share * (1e-4 + 0.1 * 0.2**2) / STEP
    base = UrdfLink("base", 2.0, ORIGIN, ball_inertia(0.01), ((box(0.2, 0.2, 0.1), ORIGIN),))
    return mounted(folder, part, base, axis=(0.0, 1.0, 0.0), xyz=(0.0, 0.0, 0.2), damping=damping)


def test_an_undamped_spring_on_a_hinge_is_judged_oscillation(tmp_path: Path) -> None:
    wheel = UrdfLink("wheel", 0.1, ORIGIN, ball_inertia(0.01))
    seen = measure(mounted(tmp_path, wheel, stiffness=4.0), {"j": 0.3}, 0.5, SETTINGS)
    # ω = 20 rad/s: 6.4 reversals a second between ±0.3.
    (motion,) = seen.joints
    assert motion.sign_changes in (6, 7)
    assert motion.amplitude == pytest.approx(0.6, rel=0.02)
    assert seen.drift_m < 1e-4 and seen.settle_motion["j"] <= 0.61
    assert verdict(seen).mode is FailureMode.OSCILLATION and "'j'" in verdict(seen).reason


def test_the_same_spring_damped_comes_to_rest(tmp_path: Path) -> None:
    wheel = UrdfLink("wheel", 0.1, ORIGIN, ball_inertia(0.01))
    # Half of critical damping: 2 · 0.5 · √(k I) = 0.2.
    seen = measure(mounted(tmp_path, wheel, stiffness=4.0, damping=0.2), {"j": 0.3}, 0.5, SETTINGS)
    assert verdict(seen).passed
    assert seen.joints[0].amplitude < 1e-3
    assert seen.settle_motion["j"] == pytest.approx(0.3, rel=0.02)
    assert seen.joints[0].final_position == pytest.approx(0.0, abs=1e-3)


def test_a_slider_on_a_spring_is_judged_in_metres(tmp_path: Path) -> None:
    cart = UrdfLink("cart", 0.1, ORIGIN, ball_inertia(1e-3))
    sag = 0.1 * 9.81 / 50.0
    seen = measure(mounted(tmp_path, cart, type="prismatic", stiffness=50.0), {"j": 0.01 - sag}, 0.5, SETTINGS)
    assert 0.005 < seen.joints[0].amplitude < 0.05 and seen.joints[0].sign_changes >= 3
    assert verdict(seen, frozenset({"j"})).mode is FailureMode.OSCILLATION
    assert oscillating_joints(seen, frozenset(), Thresholds()) == ()  # too little for a hinge


def test_what_falls_while_settling_is_recorded_as_settle_motion(tmp_path: Path) -> None:
    arm = UrdfLink("arm", 0.1, (0.1, 0.0, 0.0), ball_inertia(1e-4))
    # Level and free to fall: it hangs down, a quarter turn on, before the test begins.
    urdf = mounted(tmp_path, arm, axis=(0.0, 1.0, 0.0), damping=0.005)
    seen = measure(urdf, {}, 0.5, EngineSettings(settle_s=4.0, test_s=0.5))
    assert seen.settle_motion["j"] == pytest.approx(math.pi / 2, abs=0.02)
    assert seen.joints[0].amplitude < 0.01


@pytest.mark.parametrize(("speed", "seconds"), [(0.9, 0.25), (1.1, 1.0)])
def test_settling_ends_once_all_is_still_and_lasts_while_a_joint_moves(
    tmp_path: Path, speed: float, seconds: float
) -> None:
    # A centred wheel turns without any link's centre moving: the joint alone shows it, and tells the time that passed.
    turning = speed * TURN_FACTOR * SETTINGS.still_speed
    wheel = UrdfLink("wheel", 0.1, ORIGIN, ball_inertia(0.01))
    with loaded(mounted(tmp_path, wheel), fixed_base=True, timestep_s=STEP) as item:
        item.client.resetJointState(item.body, 0, 0.0, turning)
        settle(stepper(item), Speeds(item, [0]), SETTINGS)
        assert item.positions()[0] / turning == pytest.approx(seconds, abs=SPEED_EVERY * STEP)


def test_the_object_stands_its_height_over_the_plane_with_its_joints_placed(tmp_path: Path) -> None:
    leg = UrdfLink("leg", 0.1, ORIGIN, ball_inertia(1e-3), ((box(0.02, 0.02, 0.02), (0.0, 0.0, -0.5)),))
    # The leg reaches to 0.51 below its joint, which lies 0.3 over the base's middle; bent by 90° it is out of the way.
    urdf = mounted(tmp_path, leg, axis=(0.0, 1.0, 0.0))
    for position, lowest in ((0.0, 0.3 - 0.51), (math.pi / 2, -0.1)):
        with loaded(urdf, fixed_base=False, timestep_s=STEP) as item:
            stand(item, {"j": position}, 0.5, 0.05)
            height = item.client.getBasePositionAndOrientation(item.body)[0][2]
            assert height + lowest == pytest.approx(0.05, abs=1e-5)
            assert item.positions()[0] == pytest.approx(position)


def test_a_block_off_its_authored_origin_is_set_down_all_the_same(tmp_path: Path) -> None:
    body = UrdfLink("body", 1.0, (3.0, 0.0, 7.0), ball_inertia(1.7e-3), ((box(0.1, 0.1, 0.1), (3.0, 0.0, 7.0)),))
    assert verdict(measure(with_knob(tmp_path, body), {}, 0.5, SETTINGS)).passed


def test_link_speeds_are_seen_and_the_peak_is_kept(tmp_path: Path) -> None:
    arm = UrdfLink("arm", 0.1, (0.1, 0.0, 0.0), ball_inertia(1e-4))
    with loaded(mounted(tmp_path, arm), fixed_base=True, timestep_s=STEP) as item:
        speeds = Speeds(item, [0])
        item.client.resetJointState(item.body, 0, 0.0, 3.0)
        assert speeds.read() == pytest.approx(0.3)
        item.place({})
        assert speeds.read() == pytest.approx(0.0, abs=1e-9)
        assert speeds.peak == pytest.approx(0.3)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e12, -1e12])
def test_what_no_table_can_hold_is_capped(value: float) -> None:
    assert capped(value) == BEYOND_MEASURE


def test_what_a_table_can_hold_is_kept() -> None:
    assert capped(-0.25) == -0.25


def siblings(folder: Path, reach: float) -> Path:
    """Two boxes of 0.1 m on one root that overlap by ``reach`` along x with ``slide`` at zero."""
    shape = ((box(0.1, 0.1, 0.1), ORIGIN),)
    links = [UrdfLink("root"), UrdfLink("left", shapes=shape), UrdfLink("right", shapes=shape)]
    joints = [
        UrdfJoint("glue", "fixed", "root", "left"),
        UrdfJoint("slide", "prismatic", "root", "right", axis=(1.0, 0.0, 0.0), xyz=(0.1 - reach, 0.0, 0.0)),
    ]
    return write_urdf(folder, links, joints)


def test_phi_of_two_overlapping_boxes_is_their_depth_at_every_contact_point(tmp_path: Path) -> None:
    points = contacts_at(siblings(tmp_path, 0.01), {}, SETTINGS)
    assert points and {frozenset((point.link_a, point.link_b)) for point in points} == {frozenset(("left", "right"))}
    np.testing.assert_allclose([point.separation_m for point in points], -0.01, atol=1e-6)
    assert penetration(points) == pytest.approx(0.01 * len(points))


def test_phi_follows_the_joint_and_is_zero_once_apart(tmp_path: Path) -> None:
    with penetration_probe(siblings(tmp_path, 0.01), SETTINGS) as item:
        phis = [penetration(contact_points(item, {"slide": q})) for q in (-0.01, 0.0, 0.005, 0.02)]
    assert phis[0] > phis[1] > phis[2] > 0.0 and phis[3] == 0.0


def test_a_link_and_its_parent_are_not_in_contact(tmp_path: Path) -> None:
    shape = ((box(0.1, 0.1, 0.1), ORIGIN),)
    links = [UrdfLink("root", shapes=shape), UrdfLink("part", shapes=shape)]
    urdf = write_urdf(tmp_path, links, [UrdfJoint("j", "revolute", "root", "part")])
    assert contacts_at(urdf, {}, SETTINGS) == []


def test_the_measurement_carries_phi_of_the_initial_state(tmp_path: Path) -> None:
    urdf = siblings(tmp_path, 0.01)
    apart, over = (measure(urdf, {"slide": q}, 0.5, EngineSettings(settle_s=0.1, test_s=0.1)) for q in (0.05, 0.0))
    assert apart.penetration_m == 0.0 and apart.pairs == ()
    assert over.pairs[0].depth_m == pytest.approx(0.01, abs=1e-6)
    assert {over.pairs[0].link_a, over.pairs[0].link_b} == {"left", "right"}
    assert verdict(over).mode is FailureMode.PENETRATION


def test_the_recording_has_one_row_a_step_and_the_shapes_that_it_states(tmp_path: Path) -> None:
    seen = watch(ball(tmp_path, 0.0), {"j": 0.1}, 0.5, 0.002, EngineSettings(settle_s=0.2, test_s=0.1))
    rows = round(0.1 / STEP) + 1
    shapes: list[Array] = [seen.root_positions, seen.root_orientations, seen.joint_positions]
    assert [item.shape for item in shapes] == [(rows, 3), (rows, 4), (rows, 1)]
    assert seen.joints == ("j",) and seen.settled.shape == (1,)
    np.testing.assert_array_equal(seen.settled, seen.joint_positions[0])


def test_a_rigid_object_is_measured(tmp_path: Path) -> None:
    seen = measure(block_urdf(tmp_path), {}, 0.5, EngineSettings(settle_s=0.5, test_s=0.5))
    assert seen.joints == () and seen.finite and seen.drift_m < 1e-4
