"""Leaving objects alone in every engine: what rests, rolls, explodes and rings is recorded and judged as such."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from asset2sim.checks.at_rest import measurement_verdict, oscillating_joints
from asset2sim.checks.rest import contacts_at, measure, observe
from asset2sim.checks.watch import BEYOND_MEASURE, EVERY_S, TURN_FACTOR, capped_reading, rotation_of, watch
from asset2sim.physics.arrays import Array
from schemas.interaction import Measurement
from schemas.settings import EngineSettings, Thresholds
from schemas.verdict import Verdict
from schemas.vocabulary import Engine, FailureMode
from tests.builders import ORIGIN, UrdfJoint, UrdfLink, ball_inertia, block_urdf, box, siblings, sphere, write_urdf
from tests.engine_worlds import every_engine, held

pytestmark = pytest.mark.system

SETTINGS = EngineSettings(settle_s=1.0, test_s=1.0, drop_height_m=0.002)
STEP = SETTINGS.timestep_s
KNOB = UrdfLink("knob", 0.01, ORIGIN, ball_inertia(1e-4))
"""Something small on a joint: refined objects are articulated."""
BASE = UrdfLink("base", 20.0, ORIGIN, ball_inertia(0.5), ((box(0.3, 0.3, 0.2), ORIGIN),))
"""A heavy base of 0.2 m."""
WHEEL = UrdfLink("wheel", 0.1, ORIGIN, ball_inertia(0.01))


def verdict(seen: Measurement, sliders: frozenset[str] = frozenset()) -> Verdict:
    return measurement_verdict(seen, sliders, Thresholds())


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


@every_engine
def test_a_box_drops_and_rests(tmp_path: Path, engine: Engine) -> None:
    urdf = with_knob(tmp_path, UrdfLink("body", 1.0, ORIGIN, ball_inertia(1.7e-3), ((box(0.1, 0.1, 0.1), ORIGIN),)))
    seen = measure(engine, urdf, {}, 0.5, SETTINGS)
    assert verdict(seen).passed
    assert seen.drift_m < 1e-4 and seen.drift_rad < 1e-3 and seen.finite
    # Nothing is faster than the fall, v² = 2 g h.
    assert 0.0 < seen.peak_speed_m_s < 1.1 * math.sqrt(2 * 9.81 * SETTINGS.drop_height_m)
    assert (seen.engine, seen.timestep_s, seen.settle_s, seen.test_s) == (engine.value, STEP, 1.0, 1.0)
    assert seen.engine_version[0].isdigit()
    assert [motion.name for motion in seen.joints] == ["j"] and seen.joints[0].amplitude < 1e-6


@every_engine
def test_the_fall_is_as_fast_as_the_drop_is_high(tmp_path: Path, engine: Engine) -> None:
    settings = SETTINGS.model_copy(update={"drop_height_m": 0.05})
    # PhysX foresees the contact, and is slowed by it a step early.
    fastest, between_readings = math.sqrt(2 * 9.81 * 0.05), (EVERY_S + STEP) * 9.81
    peak = measure(engine, ball(tmp_path, 0.0), {}, 0.5, settings).peak_speed_m_s
    assert fastest - between_readings <= peak <= 1.02 * fastest


@every_engine
def test_a_balanced_ball_rests_and_a_lopsided_one_rolls(tmp_path: Path, engine: Engine) -> None:
    assert verdict(measure(engine, ball(tmp_path, 0.0), {}, 0.5, SETTINGS)).passed
    seen = measure(engine, ball(tmp_path, 0.02), {}, 0.5, SETTINGS)
    assert seen.drift_m > 0.01 and seen.drift_rad > 0.1 and seen.finite
    assert verdict(seen).mode is FailureMode.DRIFT and "drifts" in verdict(seen).reason


@every_engine
@pytest.mark.parametrize("share", [0.5, 1.5])
def test_damping_below_the_bound_of_explicit_steps_is_stable(tmp_path: Path, engine: Engine, share: float) -> None:
    assert verdict(measure(engine, flap(tmp_path, share), {"j": -0.3}, 0.5, SETTINGS)).passed


@every_engine
@pytest.mark.parametrize("share", [3.0, 10.0])
def test_damping_beyond_it_explodes_only_where_it_is_explicit(tmp_path: Path, engine: Engine, share: float) -> None:
    seen = measure(engine, flap(tmp_path, share), {"j": -0.3}, 0.5, SETTINGS)
    explodes = not seen.finite or seen.peak_speed_m_s > Thresholds().peak_speed_m_s
    assert explodes is (engine is Engine.PYBULLET)
    if explodes:
        assert verdict(seen).mode is FailureMode.DRIFT and "explodes" in verdict(seen).reason


def flap(folder: Path, share: float) -> Path:
    """A light flap on a horizontal hinge whose damping is c = share · I / Δt, on a base that may give way."""
    part = UrdfLink("flap", 0.1, (0.2, 0.0, 0.0), ball_inertia(1e-4))
    damping = share * (1e-4 + 0.1 * 0.2**2) / STEP
    base = UrdfLink("base", 2.0, ORIGIN, ball_inertia(0.01), ((box(0.2, 0.2, 0.1), ORIGIN),))
    return mounted(folder, part, base, axis=(0.0, 1.0, 0.0), xyz=(0.0, 0.0, 0.2), damping=damping)


@every_engine
def test_an_undamped_spring_on_a_hinge_is_judged_oscillation(tmp_path: Path, engine: Engine) -> None:
    seen = measure(engine, mounted(tmp_path, WHEEL, stiffness=4.0), {"j": 0.3}, 0.5, SETTINGS)
    # ω = 20 rad/s: 6.4 reversals a second between ±0.3.
    (motion,) = seen.joints
    assert motion.sign_changes in (6, 7)
    assert motion.amplitude == pytest.approx(0.6, rel=0.02)
    assert seen.drift_m < 1e-4 and seen.settle_motion["j"] <= 0.61
    assert verdict(seen).mode is FailureMode.OSCILLATION and "'j'" in verdict(seen).reason


@every_engine
def test_the_same_spring_damped_comes_to_rest(tmp_path: Path, engine: Engine) -> None:
    # Half of critical damping: 2 · 0.5 · √(k I) = 0.2.
    seen = measure(engine, mounted(tmp_path, WHEEL, stiffness=4.0, damping=0.2), {"j": 0.3}, 0.5, SETTINGS)
    assert verdict(seen).passed
    assert seen.joints[0].amplitude < 1e-3
    assert seen.settle_motion["j"] == pytest.approx(0.3, rel=0.02)
    assert seen.joints[0].final_position == pytest.approx(0.0, abs=1e-3)


@every_engine
def test_a_slider_on_a_spring_is_judged_in_metres(tmp_path: Path, engine: Engine) -> None:
    cart = UrdfLink("cart", 0.1, ORIGIN, ball_inertia(1e-3))
    sag = 0.1 * 9.81 / 50.0
    seen = measure(engine, mounted(tmp_path, cart, type="prismatic", stiffness=50.0), {"j": 0.01 - sag}, 0.5, SETTINGS)
    assert 0.005 < seen.joints[0].amplitude < 0.05 and seen.joints[0].sign_changes >= 3
    assert verdict(seen, frozenset({"j"})).mode is FailureMode.OSCILLATION
    assert oscillating_joints(seen, frozenset(), Thresholds()) == ()  # too little for a hinge


@every_engine
def test_what_falls_while_settling_is_recorded_as_settle_motion(tmp_path: Path, engine: Engine) -> None:
    arm = UrdfLink("arm", 0.1, (0.1, 0.0, 0.0), ball_inertia(1e-4))
    # Level and free to fall: it hangs down, a quarter turn on, before the test begins.
    urdf = mounted(tmp_path, arm, axis=(0.0, 1.0, 0.0), damping=0.005)
    seen = measure(engine, urdf, {}, 0.5, EngineSettings(settle_s=4.0, test_s=0.5))
    assert seen.settle_motion["j"] == pytest.approx(math.pi / 2, abs=0.02)
    assert seen.joints[0].amplitude < 0.01


@every_engine
@pytest.mark.parametrize(("speed", "seconds"), [(0.9, 0.25), (1.1, 1.0)])
def test_settling_ends_once_all_is_still_and_lasts_while_a_joint_moves(
    tmp_path: Path, engine: Engine, speed: float, seconds: float
) -> None:
    # A centred wheel turns without any link's centre moving: the joint alone shows it.
    turning = speed * TURN_FACTOR * SETTINGS.still_speed
    with held(engine, mounted(tmp_path, WHEEL)) as world:
        world.kick({"j": turning})
        passed = watch(world, SETTINGS.settle_s, SETTINGS).seconds
        assert passed == pytest.approx(seconds, abs=EVERY_S)
        assert world.positions()[0] / turning == pytest.approx(seconds, abs=EVERY_S)


def test_the_peak_of_the_speeds_is_kept(tmp_path: Path) -> None:
    arm = UrdfLink("arm", 0.1, (0.1, 0.0, 0.0), ball_inertia(1e-4))
    with held(Engine.PYBULLET, mounted(tmp_path, arm, damping=0.05)) as world:
        world.kick({"j": 3.0})
        seen = watch(world, SETTINGS.settle_s, SETTINGS)
    assert seen.peak == pytest.approx(0.3)
    assert seen.final < 0.3


def test_the_matrix_of_an_orientation_is_scipys() -> None:
    for turn in Rotation.random(50, random_state=1):
        assert rotation_of(turn.as_quat()) == pytest.approx(turn.as_matrix().ravel(), abs=1e-12)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e12, -1e12])
def test_what_no_table_can_hold_is_capped_and_the_rest_kept(value: float) -> None:
    assert capped_reading(value) == math.copysign(BEYOND_MEASURE, value if abs(value) == 1e12 else 1.0)
    assert capped_reading(-0.25) == -0.25


@every_engine
def test_the_measurement_carries_phi_of_the_initial_state(tmp_path: Path, engine: Engine) -> None:
    urdf = siblings(tmp_path, 0.01)
    short = EngineSettings(settle_s=0.1, test_s=0.1)
    apart, over = (measure(engine, urdf, {"slide": q}, 0.5, short) for q in (0.05, 0.0))
    assert apart.penetration_m == 0.0 and apart.pairs == ()
    (pair,) = over.pairs
    assert pair.depth_m == pytest.approx(0.01, abs=2e-5)
    assert pair.penetration_m == pytest.approx(pair.n_points * 0.01, rel=0.01) == over.penetration_m
    assert (pair.link_a, pair.link_b) == ("left", "right")
    assert verdict(over).mode is FailureMode.PENETRATION


@every_engine
def test_phi_of_one_pose_does_not_depend_on_the_one_before(tmp_path: Path, engine: Engine) -> None:
    urdf = siblings(tmp_path, 0.01)
    alone = contacts_at(engine, urdf, {"slide": 0.0}, SETTINGS)
    with held(engine, urdf) as world:
        for position in (-0.02, 0.05, 0.0):
            world.place({"slide": position})
            points = world.contacts()
    depths = [sorted(point.separation_m for point in group) for group in (alone, points)]
    np.testing.assert_allclose(depths[1], depths[0], atol=2e-6)


@every_engine
def test_the_recording_has_one_row_a_step_and_the_shapes_that_it_states(tmp_path: Path, engine: Engine) -> None:
    seen = observe(engine, ball(tmp_path, 0.0), {"j": 0.1}, 0.5, 0.002, EngineSettings(settle_s=0.2, test_s=0.1))
    rows = round(0.1 / STEP) + 1
    shapes: list[Array] = [seen.root_positions, seen.root_orientations, seen.joint_positions]
    assert [item.shape for item in shapes] == [(rows, 3), (rows, 4), (rows, 1)]
    assert seen.joints == ("j",) and seen.settled.shape == (1,)
    np.testing.assert_array_equal(seen.settled, seen.joint_positions[0])


@every_engine
def test_a_rigid_object_is_measured(tmp_path: Path, engine: Engine) -> None:
    seen = measure(engine, block_urdf(tmp_path), {}, 0.5, EngineSettings(settle_s=0.5, test_s=0.5))
    assert seen.joints == () and seen.finite and seen.drift_m < 1e-4


@every_engine
def test_the_same_object_measures_the_same_twice(tmp_path: Path, engine: Engine) -> None:
    urdf = mounted(tmp_path, WHEEL, stiffness=4.0, friction=0.01)
    first, again = (measure(engine, urdf, {"j": 0.3}, 0.5, SETTINGS) for _ in range(2))
    assert first == again
