"""One object in PyBullet does what its URDF says: textbook periods, decays, thresholds, and no energy from nowhere."""

import math
from pathlib import Path

import numpy as np
import pytest

from asset2sim.arrays import Array
from asset2sim.engines.pybullet_object import PyBulletObject, loaded, stepper
from asset2sim.engines.pybullet_rest import stand
from schemas.base import Vector3
from schemas.errors import AssetError
from schemas.vocabulary import FailureMode
from tests.builders import (
    ORIGIN,
    UrdfJoint,
    UrdfLink,
    ball_inertia,
    block_urdf,
    box,
    joint_track,
    mesh,
    swing,
    write_urdf,
)

STEP = 1.0 / 240.0
G = 9.81
BOB = UrdfLink("part", 1.0, (0.0, 0.0, -0.5), ball_inertia(1e-3))
"""A pendulum of 1 kg at 0.5 m."""
WHEEL = UrdfLink("part", 1.0, ORIGIN, ball_inertia(0.01))
"""A part whose centre lies on its axis: gravity does nothing to it on a hinge."""


def track(urdf: Path, start: float, seconds: float, velocity: float = 0.0) -> Array:
    """The positions of the joint ``j`` of an object whose base is held, left alone from ``start``."""
    with loaded(urdf, fixed_base=True, timestep_s=STEP) as item:
        item.place({"j": start})
        item.client.resetJointState(item.body, item.joint_index["j"], start, velocity)
        return joint_track(item, seconds)


def period(positions: Array) -> float:
    """Mean time between falls through zero, s."""
    before, after = positions[:-1], positions[1:]
    falls = np.flatnonzero((before > 0.0) & (after <= 0.0))
    moments = falls + before[falls] / (before[falls] - after[falls])
    return float(np.diff(moments).mean()) * STEP


def test_a_pendulum_has_the_textbook_period(tmp_path: Path) -> None:
    positions = track(swing(tmp_path, BOB, axis=(0, 1, 0)), 0.1, 8.0)
    # 2π √(I / m g l), longer by A² / 16 at amplitude A.
    assert period(positions) == pytest.approx(2 * math.pi * math.sqrt(0.251 / (G * 0.5)) * (1 + 0.1**2 / 16), rel=0.005)
    assert np.abs(positions[-480:]).max() == pytest.approx(0.1, rel=0.02)  # and loses nothing


def test_a_spring_has_the_textbook_period_about_where_it_is_relaxed(tmp_path: Path) -> None:
    positions = track(swing(tmp_path, WHEEL, stiffness=1.0, reference=0.4), 0.7, 5.0)
    assert period(positions - 0.4) == pytest.approx(2 * math.pi * math.sqrt(0.01), rel=0.005)
    assert positions[-480:].max() == pytest.approx(0.7, abs=0.01)
    assert positions[-480:].min() == pytest.approx(0.1, abs=0.01)


def test_a_sliding_spring_sags_and_bounces_about_its_sag(tmp_path: Path) -> None:
    positions = track(swing(tmp_path, WHEEL, type="prismatic", stiffness=100.0), 0.0, 5.0)
    sag = G / 100.0
    assert period(positions + sag) == pytest.approx(2 * math.pi * math.sqrt(1.0 / 100.0), rel=0.005)
    assert positions.min() == pytest.approx(-2 * sag, rel=0.02)


def test_a_damped_hinge_loses_speed_as_its_damping_says(tmp_path: Path) -> None:
    damping, inertia, speed = 0.1, 0.01, 1.0
    speeds = np.diff(track(swing(tmp_path, WHEEL, damping=damping), 0.0, 0.5, speed)) / STEP
    steps = np.arange(1, len(speeds) + 1)
    # Explicit damping: each step keeps 1 - c Δt / I. The continuous e^(-t/τ) is within 2.5 % of it over one τ.
    np.testing.assert_allclose(speeds, speed * (1.0 - damping * STEP / inertia) ** steps, rtol=1e-6)
    one_tau = speeds[steps * STEP <= inertia / damping + 1e-9]
    np.testing.assert_allclose(one_tau, np.exp(-steps[: len(one_tau)] * STEP * damping / inertia), rtol=0.025)


def test_a_hinge_without_terms_turns_for_ever(tmp_path: Path) -> None:
    turned = track(swing(tmp_path, WHEEL, type="continuous"), 0.0, 5.0, 2.0)
    assert turned[-1] == pytest.approx(10.0, rel=1e-4)


@pytest.mark.parametrize("share", [0.0, 0.5, 0.95])
def test_friction_below_the_pull_lets_a_hinge_fall(tmp_path: Path, share: float) -> None:
    pull = G * 0.5 * math.sin(1.0)
    positions = track(swing(tmp_path, BOB, axis=(0, 1, 0), friction=share * pull), 1.0, 0.25)
    # Over the first moment the net torque hardly changes: q falls by (1 - share) m g l sin q / I t² / 2.
    fallen = 0.5 * (1.0 - share) * pull / 0.251 * (24 * STEP) ** 2
    assert 1.0 - positions[24] == pytest.approx(fallen, rel=0.06)


@pytest.mark.parametrize("share", [1.05, 3.0])
def test_friction_above_the_pull_holds_a_hinge(tmp_path: Path, share: float) -> None:
    pull = G * 0.5 * math.sin(1.0)
    positions = track(swing(tmp_path, BOB, axis=(0, 1, 0), friction=share * pull), 1.0, 2.0)
    assert np.abs(positions - 1.0).max() < 1e-4


def test_friction_holds_a_slider_above_its_weight_and_not_below(tmp_path: Path) -> None:
    held = track(swing(tmp_path, WHEEL, type="prismatic", friction=1.05 * G), 0.0, 2.0)
    assert np.abs(held).max() < 1e-4
    slipping = track(swing(tmp_path, WHEEL, type="prismatic", friction=0.95 * G), 0.0, 1.0)
    assert slipping[-1] == pytest.approx(-0.5 * 0.05 * G, rel=0.05)


def test_friction_stops_a_coasting_wheel_after_v_squared_over_two_a(tmp_path: Path) -> None:
    positions = track(swing(tmp_path, WHEEL, friction=0.02), 0.0, 2.0, 2.0)
    assert positions[-1] == pytest.approx(2.0**2 / (2 * 0.02 / 0.01), rel=0.02)
    assert positions[-1] == pytest.approx(positions[-60], abs=1e-9)


def test_a_spring_with_friction_and_damping_rests_within_the_band_that_friction_holds(tmp_path: Path) -> None:
    terms = {"stiffness": 1.0, "friction": 0.1, "damping": 0.01}
    positions = track(swing(tmp_path, WHEEL, **terms), 0.5, 5.0)
    # The first swing back obeys I q'' = -k q + f - c q': about q = f / k with γ = c / 2I and ω = √(k / I - γ²), so that
    # it turns at f/k - (q0 - f/k) e^(-γπ/ω).
    gamma = 0.5
    overshoot = 0.1 - 0.4 * math.exp(-gamma * math.pi / math.sqrt(100.0 - gamma**2))
    assert positions.min() == pytest.approx(overshoot, rel=0.02)
    assert abs(positions[-1]) <= 0.1 * 1.02
    assert positions[-1] == pytest.approx(positions[-240], abs=1e-6)
    assert abs(track(swing(tmp_path, WHEEL, **terms), 0.09, 2.0)[-1] - 0.09) < 1e-4  # released inside the band it stays


def test_a_joint_stops_at_its_limit(tmp_path: Path) -> None:
    positions = track(swing(tmp_path, WHEEL, type="prismatic", lower=-0.2, upper=0.2), 0.0, 2.0)
    assert positions[-1] == pytest.approx(-0.2, abs=2e-3)


def slope(urdf: Path, angle: float, friction: float, step: float) -> tuple[float, float]:
    """Distance (m) and speed (m/s) down a slope, 1 s after a resting block's plane is tilted by turning gravity."""
    with loaded(urdf, fixed_base=False, timestep_s=step) as item:
        stand(item, {}, friction, 0.001)
        stepping = stepper(item)
        for _ in range(round(0.3 / step)):
            stepping.step()
        start = item.client.getBasePositionAndOrientation(item.body)[0][0]
        item.client.setGravity(G * math.sin(angle), 0.0, -G * math.cos(angle))
        for _ in range(round(1.0 / step)):
            stepping.step()
        end = item.client.getBasePositionAndOrientation(item.body)[0][0]
        return end - start, item.client.getBaseVelocity(item.body)[0][0]


@pytest.mark.parametrize("friction", [0.3, 0.6])
def test_a_block_stays_on_a_slope_that_friction_must_hold(tmp_path: Path, friction: float) -> None:
    urdf = block_urdf(tmp_path, (0.3, 0.3, 0.1))
    moved, speed = slope(urdf, math.atan(0.95 * friction), friction, 1e-3)
    assert abs(moved) < 1e-3 and abs(speed) < 1e-3


@pytest.mark.parametrize(("friction", "tangent"), [(0.3, 0.36), (0.6, 0.8), (0.0, 0.2)])
def test_a_block_slides_down_a_steeper_one_as_coulomb_says(tmp_path: Path, friction: float, tangent: float) -> None:
    angle = math.atan(tangent)
    moved, speed = slope(block_urdf(tmp_path, (0.3, 0.3, 0.1)), angle, friction, 1e-3)
    acceleration = G * (math.sin(angle) - friction * math.cos(angle))
    assert speed == pytest.approx(acceleration, rel=0.05)
    assert moved == pytest.approx(acceleration / 2.0, rel=0.05)


FLYER = (
    UrdfLink("base", 2.0, ORIGIN, (0.02, 0.0, 0.0, 0.03, 0.0, 0.04)),
    UrdfLink("part", 1.0, (0.2, 0.0, 0.0), (0.005, 0.0, 0.0, 0.01, 0.0, 0.012)),
)


def momentum(item: PyBulletObject, links: tuple[UrdfLink, UrdfLink]) -> tuple[Array, float, float]:
    """(3,) linear momentum, spin about z around the centre of mass of a flat motion, and kinetic energy, SI units."""
    client, body = item.client, item.body
    base, turning = (np.array(v) for v in client.getBaseVelocity(body))
    state = client.getLinkState(body, 0, computeLinkVelocity=1)
    places = np.array([client.getBasePositionAndOrientation(body)[0], state[0]])
    speeds, spins = np.array([base, state[6]]), np.array([turning[2], state[7][2]])
    masses, moments = np.array([link.mass for link in links]), np.array([link.inertia[5] for link in links])
    linear: Array = masses @ speeds
    around = places - masses @ places / masses.sum()
    angular = float(moments @ spins + masses @ np.cross(around, speeds)[:, 2])
    return linear, angular, float(masses @ (speeds**2).sum(axis=1) + moments @ spins**2) / 2.0


@pytest.mark.parametrize("friction", [0.0, 0.02])
def test_in_free_flight_friction_alone_takes_energy_and_nothing_takes_momentum(tmp_path: Path, friction: float) -> None:
    joint = UrdfJoint("j", "continuous", "base", "part", xyz=(0.1, 0.0, 0.0), friction=friction)
    with loaded(write_urdf(tmp_path, FLYER, [joint]), fixed_base=False, timestep_s=1e-3) as item:
        item.client.setGravity(0.0, 0.0, 0.0)
        item.client.resetBaseVelocity(item.body, [1.0, 0.5, 0.0], [0.0, 0.0, 1.0])
        item.client.resetJointState(item.body, 0, 0.0, 4.0)
        stepping, travelled = stepper(item), 0.0
        stepping.step()
        before = momentum(item, FLYER)
        for _ in range(1000):
            stepping.step()
            travelled += abs(float(item.velocities()[0])) * 1e-3
        after = momentum(item, FLYER)
    np.testing.assert_allclose(after[0], before[0], rtol=0.003)
    assert after[1] == pytest.approx(before[1], rel=0.01)
    # PyBullet's own damping of 0.04 would have taken 8 % of the energy in this second.
    assert before[2] - after[2] == pytest.approx(friction * travelled, rel=0.05, abs=0.005 * before[2])


def test_a_thrown_block_neither_slows_nor_stops_turning(tmp_path: Path) -> None:
    with loaded(block_urdf(tmp_path), fixed_base=False, timestep_s=STEP) as item:
        item.client.setGravity(0.0, 0.0, 0.0)
        item.client.resetBaseVelocity(item.body, [1.0, 0.0, 0.0], [0.0, 3.0, 0.0])
        stepping = stepper(item)
        for _ in range(480):
            stepping.step()
        linear, angular = item.client.getBaseVelocity(item.body)
    np.testing.assert_allclose([linear[0], angular[1]], [1.0, 3.0], rtol=1e-6)


def test_a_spring_in_free_flight_pushes_both_sides_alike(tmp_path: Path) -> None:
    joint = UrdfJoint("j", "prismatic", "base", "part", (1.0, 0.0, 0.0), (0.1, 0.0, 0.0), stiffness=24.0)
    with loaded(write_urdf(tmp_path, FLYER, [joint]), fixed_base=False, timestep_s=STEP) as item:
        item.client.setGravity(0.0, 0.0, 0.0)
        item.place({"j": 0.1})
        stepping, positions = stepper(item), []
        for _ in range(480):
            stepping.step()
            positions.append(float(item.positions()[0]))
            assert np.linalg.norm(momentum(item, FLYER)[0]) < 1e-6
    # The reduced mass of 2 and 1 kg is 2/3 kg: ω = 6 rad/s.
    assert period(np.array(positions)) == pytest.approx(2 * math.pi / 6.0, rel=0.005)


def test_the_authored_inertia_is_used_and_not_the_shapes(tmp_path: Path) -> None:
    # A box of 0.1 m would have 0.0017 kg·m²; the file says 0.02 about z, and a spring feels it.
    part = UrdfLink("part", 1.0, ORIGIN, (0.01, 0.0, 0.0, 0.015, 0.0, 0.02), ((box(0.1, 0.1, 0.1), ORIGIN),))
    urdf = swing(tmp_path, part, stiffness=2.0)
    assert period(track(urdf, 0.2, 5.0)) == pytest.approx(2 * math.pi * math.sqrt(0.02 / 2.0), rel=0.005)


def test_an_authored_product_of_inertia_couples_the_axes(tmp_path: Path) -> None:
    # About the turned axis (1, 1, 0)/√2 the moment is Ixx + Ixy = 0.015, where a diagonal alone would give 0.01.
    part = UrdfLink("part", 1.0, ORIGIN, (0.01, 0.005, 0.0, 0.01, 0.0, 0.012))
    urdf = swing(tmp_path, part, axis=(math.sqrt(0.5), math.sqrt(0.5), 0.0), stiffness=1.5)
    assert period(track(urdf, 0.2, 5.0)) == pytest.approx(2 * math.pi * math.sqrt(0.015 / 1.5), rel=0.005)


def chain(folder: Path) -> Path:
    links = [UrdfLink(name) for name in ("root", "lid", "plate", "knob")]
    joints = [
        UrdfJoint("hinge", "revolute", "root", "lid"),
        UrdfJoint("glue", "fixed", "root", "plate"),
        UrdfJoint("slide", "prismatic", "plate", "knob", damping=0.5, friction=0.25),
    ]
    return write_urdf(folder, links, joints)


def test_joints_and_links_keep_their_names(tmp_path: Path) -> None:
    with loaded(chain(tmp_path), fixed_base=True, timestep_s=STEP) as item:
        assert set(item.link_names.values()) == {"root", "lid", "plate", "knob"}
        assert item.link_names[-1] == "root"
        moved = {name: item.link_names[index] for name, index in item.joint_index.items()}
        assert moved == {"hinge": "lid", "slide": "knob"}
        assert (item.dynamics["slide"].damping, item.dynamics["slide"].friction) == (0.5, 0.25)


def test_placing_names_some_joints_and_zeroes_the_rest_at_rest(tmp_path: Path) -> None:
    with loaded(chain(tmp_path), fixed_base=True, timestep_s=STEP) as item:
        item.client.resetJointState(item.body, item.joint_index["hinge"], 1.0, 5.0)
        item.place({"slide": 0.2})
        at = dict(zip(item.joint_index, item.positions(), strict=True))
        assert at == {"hinge": 0.0, "slide": pytest.approx(0.2)}
        np.testing.assert_array_equal(item.velocities(), 0.0)


def test_a_file_that_pybullet_refuses_is_an_asset_error_with_what_it_printed(tmp_path: Path) -> None:
    urdf = write_urdf(tmp_path, [UrdfLink("part", shapes=((mesh("gone.obj"), ORIGIN),))])
    refusal = pytest.raises(AssetError, match=r"refuses object\.urdf and says: .*Link.*part")
    with refusal as caught, loaded(urdf, fixed_base=True, timestep_s=STEP):
        pass
    assert caught.value.mode is FailureMode.ENGINE_CRASH


def test_clients_are_apart_and_end_with_their_block(tmp_path: Path) -> None:
    urdf = swing(tmp_path, WHEEL)
    with loaded(urdf, fixed_base=True, timestep_s=STEP) as first:
        with loaded(urdf, fixed_base=True, timestep_s=STEP) as second:
            first.place({"j": 0.5})
            assert second.positions()[0] == 0.0
        assert first.positions()[0] == 0.5
    assert not first.client.isConnected()


@pytest.mark.parametrize("axis", [(0, 0, 1), (0, 0, -1)])
def test_a_spring_returns_whichever_way_its_axis_points(tmp_path: Path, axis: Vector3) -> None:
    positions = track(swing(tmp_path, WHEEL, axis=axis, stiffness=1.0, damping=0.2, reference=-0.3), 0.6, 3.0)
    assert positions[-1] == pytest.approx(-0.3, abs=1e-3)
