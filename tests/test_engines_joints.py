"""A joint does in every engine what its URDF says: periods, decays, thresholds and limits that a hand can compute."""

import math
from pathlib import Path

import numpy as np
import pytest

from asset2sim.engines.child import in_child
from schemas.base import Vector3
from schemas.vocabulary import Engine
from tests.builders import ORIGIN, UrdfJoint, UrdfLink, ball_inertia, box, swing, write_urdf
from tests.engine_worlds import STEP, G, every_engine, held, on_plane, period, track

pytestmark = pytest.mark.system

BOB = UrdfLink("part", 1.0, (0.0, 0.0, -0.5), ball_inertia(1e-3))
"""A pendulum of 1 kg at 0.5 m: 0.251 kg·m² about its axis."""
WHEEL = UrdfLink("part", 1.0, ORIGIN, ball_inertia(0.01))
"""A part whose centre lies on its axis: gravity does nothing to it on a hinge."""
PULL = G * 0.5 * math.sin(1.0)
"""Gravity's torque on the pendulum at 1 rad, N·m."""


@every_engine
def test_a_pendulum_has_the_textbook_period(tmp_path: Path, engine: Engine) -> None:
    positions = track(engine, swing(tmp_path, BOB, axis=(0, 1, 0)), 0.1, 8.0)
    # 2π √(I / m g l), longer by A² / 16 at amplitude A.
    assert period(positions) == pytest.approx(2 * math.pi * math.sqrt(0.251 / (G * 0.5)) * (1 + 0.1**2 / 16), rel=0.005)
    assert np.abs(positions[-480:]).max() == pytest.approx(0.1, rel=0.02)  # and loses nothing


@every_engine
def test_a_spring_has_the_textbook_period_about_where_it_is_relaxed(tmp_path: Path, engine: Engine) -> None:
    positions = track(engine, swing(tmp_path, WHEEL, stiffness=1.0, reference=0.4), 0.7, 5.0)
    assert period(positions - 0.4) == pytest.approx(2 * math.pi * math.sqrt(0.01), rel=0.005)
    assert positions[-480:].max() == pytest.approx(0.7, abs=0.01)
    assert positions[-480:].min() == pytest.approx(0.1, abs=0.01)


@every_engine
def test_a_sliding_spring_sags_and_bounces_about_its_sag(tmp_path: Path, engine: Engine) -> None:
    positions = track(engine, swing(tmp_path, WHEEL, type="prismatic", stiffness=100.0), 0.0, 5.0)
    sag = G / 100.0
    assert period(positions + sag) == pytest.approx(2 * math.pi * math.sqrt(1.0 / 100.0), rel=0.005)
    assert positions.min() == pytest.approx(-2 * sag, rel=0.02)


@every_engine
@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_a_damped_joint_loses_speed_as_its_damping_says(tmp_path: Path, engine: Engine, kind: str) -> None:
    damping, moved = (0.1, 0.01) if kind == "revolute" else (10.0, 1.0)
    positions = track(engine, swing(tmp_path, WHEEL, type=kind, damping=damping), 0.0, 0.3, velocity=1.0, gravity=0.0)
    times = np.arange(len(positions)) * STEP
    # v = e^(-t/τ) with τ = I / c = 0.1 s: explicit and implicit steps differ from it by 2 % over one τ, 24 steps.
    np.testing.assert_allclose(positions[12:], 0.1 * (1.0 - np.exp(-times[12:] / (moved / damping))), rtol=0.04)
    speeds = np.diff(positions) / STEP
    assert speeds[24] / speeds[12] == pytest.approx(math.exp(-12 * STEP / 0.1), rel=0.02)


@every_engine
def test_a_joint_without_terms_turns_for_ever(tmp_path: Path, engine: Engine) -> None:
    turned = track(engine, swing(tmp_path, WHEEL, type="continuous"), 0.0, 5.0, velocity=2.0)
    assert turned[-1] == pytest.approx(10.0, rel=1e-4)


@every_engine
@pytest.mark.parametrize("share", [0.5, 0.95])
def test_friction_below_the_pull_lets_a_hinge_fall(tmp_path: Path, engine: Engine, share: float) -> None:
    positions = track(engine, swing(tmp_path, BOB, axis=(0, 1, 0), friction=share * PULL), 1.0, 0.25)
    # Over the first moment the net torque hardly changes: q falls by (1 - share) m g l sin q / I t² / 2.
    fallen = 0.5 * (1.0 - share) * PULL / 0.251 * (24 * STEP) ** 2
    assert 1.0 - positions[24] == pytest.approx(fallen, rel=0.06)


@every_engine
@pytest.mark.parametrize("share", [1.05, 3.0])
def test_friction_above_the_pull_holds_a_hinge(tmp_path: Path, engine: Engine, share: float) -> None:
    positions = track(engine, swing(tmp_path, BOB, axis=(0, 1, 0), friction=share * PULL), 1.0, 2.0)
    assert np.abs(positions - 1.0).max() < 2e-4


@every_engine
def test_friction_holds_a_slider_above_its_weight_and_not_below(tmp_path: Path, engine: Engine) -> None:
    stays = track(engine, swing(tmp_path, WHEEL, type="prismatic", friction=1.05 * G), 0.0, 2.0)
    assert np.abs(stays).max() < 2e-4
    slipping = track(engine, swing(tmp_path, WHEEL, type="prismatic", friction=0.95 * G), 0.0, 1.0)
    assert slipping[-1] == pytest.approx(-0.5 * 0.05 * G, rel=0.05)


@every_engine
def test_friction_stops_a_coasting_wheel_after_v_squared_over_two_a(tmp_path: Path, engine: Engine) -> None:
    positions = track(engine, swing(tmp_path, WHEEL, friction=0.02), 0.0, 2.0, velocity=2.0)
    assert positions[-1] == pytest.approx(2.0**2 / (2 * 0.02 / 0.01), rel=0.02)
    assert positions[-1] == pytest.approx(positions[-60], abs=1e-6)


@every_engine
@pytest.mark.parametrize(("kind", "moved"), [("revolute", 0.01), ("prismatic", 1.0)])
def test_an_effort_moves_a_joint_only_past_its_friction(
    tmp_path: Path, engine: Engine, kind: str, moved: float
) -> None:
    urdf = swing(tmp_path, WHEEL, type=kind, friction=moved)
    assert np.abs(track(engine, urdf, 0.0, 1.0, effort=0.95 * moved, gravity=0.0)).max() < 2e-4
    # a = (effort - friction) / I = 1 per second squared.
    assert track(engine, urdf, 0.0, 1.0, effort=2.0 * moved, gravity=0.0)[-1] == pytest.approx(0.5, rel=0.02)
    assert track(engine, urdf, 0.0, 1.0, effort=-2.0 * moved, gravity=0.0)[-1] == pytest.approx(-0.5, rel=0.02)


@every_engine
def test_a_spring_with_friction_and_damping_rests_within_the_band_that_friction_holds(
    tmp_path: Path, engine: Engine
) -> None:
    urdf = swing(tmp_path, WHEEL, stiffness=1.0, friction=0.1, damping=0.01)
    positions = track(engine, urdf, 0.5, 5.0)
    # The first swing back obeys I q'' = -k q + f - c q': about q = f / k with γ = c / 2I and ω = √(k / I - γ²), so that
    # it turns at f/k - (q0 - f/k) e^(-γπ/ω).
    gamma = 0.5
    overshoot = 0.1 - 0.4 * math.exp(-gamma * math.pi / math.sqrt(100.0 - gamma**2))
    assert positions.min() == pytest.approx(overshoot, rel=0.02)
    assert abs(positions[-1]) <= 0.1 * 1.02
    assert positions[-1] == pytest.approx(positions[-240], abs=1e-4)
    assert abs(track(engine, urdf, 0.09, 2.0)[-1] - 0.09) < 2e-4  # released inside the band it stays


@every_engine
@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_a_joint_stops_at_its_limits(tmp_path: Path, engine: Engine, kind: str) -> None:
    urdf = swing(tmp_path, WHEEL, type=kind, lower=-0.2, upper=0.3, damping=0.02)
    load = G if kind == "prismatic" else 0.2
    for effort, limit in ((-load, -0.2), (load, 0.3)):
        positions = track(engine, urdf, 0.0, 2.0, effort=effort, gravity=0.0)
        assert positions[-1] == pytest.approx(limit, abs=2e-3)
        assert np.abs(positions).max() < abs(limit) + 0.02


@every_engine
@pytest.mark.parametrize("step", [STEP, 1.0 / 60.0])
def test_a_joint_that_is_thrown_beyond_its_limit_comes_back_to_it(tmp_path: Path, engine: Engine, step: float) -> None:
    urdf = swing(tmp_path, WHEEL, lower=-0.2, upper=0.3, damping=0.02, friction=0.1)
    with held(engine, urdf, step) as world:
        world.kick({"j": -20.0})
        world.push({"j": -0.2})
        world.step(round(2.0 / step))
        assert world.positions()[0] == pytest.approx(-0.2, abs=2e-3)


@every_engine
@pytest.mark.parametrize("axis", [(0, 0, 1), (0, 0, -1), (0, 1, 0), (1, 1, 1)])
def test_a_spring_returns_whichever_way_its_axis_points(tmp_path: Path, engine: Engine, axis: Vector3) -> None:
    urdf = swing(tmp_path, WHEEL, axis=axis, stiffness=1.0, damping=0.2, reference=-0.3)
    assert track(engine, urdf, 0.6, 3.0)[-1] == pytest.approx(-0.3, abs=1e-3)


@every_engine
def test_the_authored_inertia_answers_a_torque(tmp_path: Path, engine: Engine) -> None:
    # About the turned axis (1, 1, 0)/√2 the moment is Ixx + Ixy = 0.015, where a diagonal alone would give 0.01.
    part = UrdfLink("part", 1.0, ORIGIN, (0.01, 0.005, 0.0, 0.01, 0.0, 0.012))
    turned = track(engine, swing(tmp_path, part, axis=(math.sqrt(0.5), math.sqrt(0.5), 0.0)), 0.0, 0.5, effort=0.03)
    # q = α t² / 2; a step of Δt adds Δt / t of it where the speed is taken first.
    assert turned[-1] == pytest.approx(0.5 * (0.03 / 0.015) * 0.5**2, rel=0.015)


@every_engine
def test_the_authored_mass_answers_a_force(tmp_path: Path, engine: Engine) -> None:
    part = UrdfLink("part", 2.5, (0.1, 0.0, 0.0), ball_inertia(0.01))
    urdf = swing(tmp_path, part, type="prismatic", axis=(1.0, 0.0, 0.0))
    assert track(engine, urdf, 0.0, 0.5, effort=5.0)[-1] == pytest.approx(0.5 * 2.0 * 0.5**2, rel=0.015)


@every_engine
def test_joints_of_a_chain_move_each_by_its_own_name(tmp_path: Path, engine: Engine) -> None:
    links = [UrdfLink(name) for name in ("root", "lid", "plate", "knob")]
    joints = [
        UrdfJoint("hinge", "revolute", "root", "lid"),
        UrdfJoint("glue", "fixed", "root", "plate"),
        UrdfJoint("slide", "prismatic", "plate", "knob", damping=0.5, friction=0.25),
    ]
    with held(engine, write_urdf(tmp_path, links, joints), gravity=0.0) as world:
        assert set(world.link_names) == {"root", "lid", "plate", "knob"}
        assert set(world.joint_names) == {"hinge", "slide"}
        assert world.engine is engine and world.timestep_s == pytest.approx(STEP)
        world.place({"slide": 0.2})
        world.kick({"hinge": 0.5})
        at = dict(zip(world.joint_names, world.positions(), strict=True))
        moving = dict(zip(world.joint_names, world.velocities(), strict=True))
        assert at == {"hinge": 0.0, "slide": pytest.approx(0.2)}
        assert moving == {"hinge": pytest.approx(0.5), "slide": 0.0}
        world.kick({"slide": 0.1})
        assert world.velocities()[world.joint_names.index("hinge")] == pytest.approx(0.5)
        world.place({})
        np.testing.assert_array_equal(world.velocities(), 0.0)
        np.testing.assert_array_equal(world.positions(), 0.0)


@every_engine
def test_fixed_joints_whose_axis_has_no_length_stand_where_their_origin_says(tmp_path: Path, engine: Engine) -> None:
    cubes = [UrdfLink(name, shapes=((box(0.1, 0.1, 0.1), ORIGIN),)) for name in ("base", "a", "b")]
    joints = [
        UrdfJoint(f"to_{name}", "fixed", "base", name, axis=ORIGIN, xyz=(x, 0.0, 0.0))
        for name, x in (("a", 0.3), ("b", -0.3))
    ]
    # SAPIEN died while it stepped this: both links stood at NaN.
    urdf = write_urdf(tmp_path, cubes, joints)

    def settled() -> float:
        with on_plane(engine, urdf) as world:
            world.place({})
            world.step(20)
            return float(world.link_speeds().max()) + world.lowest_m()

    assert abs(in_child(engine, settled, time_limit_s=20.0).value or 1.0) < 0.01


def test_what_runs_away_in_physx_is_seen_and_kills_it_not(tmp_path: Path) -> None:
    """PhysX dies of places that are no numbers, to which an explosion leads within a few steps."""
    pytest.importorskip("sapien", reason="SAPIEN is not installed")
    base = UrdfLink("base", 1.0, ORIGIN, ball_inertia(0.01), shapes=((box(0.1, 0.1, 0.1), ORIGIN),))
    hinge = UrdfJoint("j", "continuous", "base", "part", axis=(0, 1, 0))
    urdf = write_urdf(tmp_path, [base, BOB], [hinge])

    def speeds() -> tuple[float, float, bool]:
        with on_plane(Engine.SAPIEN, urdf) as world:
            world.place({"j": 0.1})
            world.push({"j": 1e30})
            world.step(20)
            fastest, where = float(world.link_speeds().max()), bool(np.isfinite(world.positions()).all())
            world.place({"j": 0.1})
            return fastest, float(world.link_speeds().max()), where

    assert in_child(Engine.SAPIEN, speeds, time_limit_s=60.0).value == (math.inf, 0.0, True)
