"""A key of 1 g on a stiff preloaded spring does in every engine, at fine and coarse steps, what a hand can compute."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from asset2sim.engines.world import World
from asset2sim.validation.holding import friction_armature
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Engine
from tests.builders import ORIGIN, UrdfJoint, UrdfLink, ball_inertia, box, swing, write_urdf
from tests.engine_worlds import G, every_engine, held, on_plane, period, recorded

pytestmark = pytest.mark.system

MASS, ARMATURE, STIFFNESS, TRAVEL, PRELOAD = 1e-3, 0.06, 55.0, 3.6e-3, 0.5
KEY = UrdfLink("part", MASS, ORIGIN, ball_inertia(1e-8))
SPRUNG: dict[str, object] = {"type": "prismatic", "axis": (0, 0, -1), "stiffness": STIFFNESS, "armature": ARMATURE}
STEPS = pytest.mark.parametrize("step", [1.0 / 240.0, 1.0 / 60.0], ids=["240Hz", "60Hz"])


def position(world: World) -> float:
    return float(world.positions()[world.joint_names.index("j")])


def key(folder: Path) -> Path:
    """A key that its spring presses up against its stop, with the damping that its own 1 g bears."""
    stops = {"lower": 0.0, "upper": TRAVEL, "reference": -PRELOAD / STIFFNESS, "damping": 0.03}
    return swing(folder, KEY, **SPRUNG, **stops)


@every_engine
def test_armature_slows_a_spring_and_weighs_nothing(tmp_path: Path, engine: Engine) -> None:
    with held(engine, swing(tmp_path, KEY, **SPRUNG, lower=-1.0, upper=1.0)) as world:
        world.place({"j": 0.003})
        positions = recorded(world, 4.0, lambda: position(world))
    sag = MASS * G / STIFFNESS
    assert period(positions - sag) == pytest.approx(2.0 * math.pi * math.sqrt((MASS + ARMATURE) / STIFFNESS), rel=0.01)
    assert positions[-120:].max() - sag == pytest.approx(0.003 - sag, rel=0.03), "it loses nothing"
    assert positions.mean() == pytest.approx(sag, abs=1e-4)


@every_engine
def test_armature_resists_a_hinge_as_inertia_does(tmp_path: Path, engine: Engine) -> None:
    wheel = UrdfLink("part", 1.0, ORIGIN, ball_inertia(0.01))
    with held(engine, swing(tmp_path, wheel, armature=0.03, damping=0.04), gravity=0.0) as world:
        world.kick({"j": 1.0})
        positions = recorded(world, 1.0, lambda: position(world))
    assert positions[-1] == pytest.approx(1.0 - math.exp(-1.0), rel=0.02), "v = exp(-t c / (I + a))"


@every_engine
@STEPS
def test_a_key_starts_and_bottoms_at_its_forces(tmp_path: Path, engine: Engine, step: float) -> None:
    with held(engine, key(tmp_path), step=step) as world:
        world.place({})
        world.step(round(0.5 / step))
        assert abs(position(world)) < 0.05 * TRAVEL

        def pressed(force: float) -> float:
            """About where the key swings once this force, N, presses it."""
            world.push({"j": force})
            world.step(round(1.0 / step))
            return float(recorded(world, 1.0, lambda: position(world)).mean())

        own = MASS * G
        assert pressed(PRELOAD - own - 0.02) < 0.05 * TRAVEL
        middle = pressed(0.6 - own)
        assert middle == pytest.approx((0.6 - PRELOAD) / STIFFNESS, rel=0.15)
        assert pressed(PRELOAD + STIFFNESS * TRAVEL - own + 0.02) == pytest.approx(TRAVEL, rel=0.05)


@every_engine
def test_a_key_returns_as_its_preload_accelerates_it(tmp_path: Path, engine: Engine) -> None:
    with held(engine, key(tmp_path)) as world:
        world.place({"j": TRAVEL})
        positions = recorded(world, 0.5, lambda: position(world))
        assert np.abs(world.velocities()).max() < 1e-3, "and stays on its stop"
    # A quarter of an oscillation about -PRELOAD / k, cut off where a tenth of the travel is left.
    rate, amplitude = math.sqrt(STIFFNESS / (MASS + ARMATURE)), TRAVEL + (PRELOAD - MASS * G) / STIFFNESS
    expected = math.acos(1.0 - 0.9 * TRAVEL / amplitude) / rate
    assert np.argmax(positions <= 0.1 * TRAVEL) / 240.0 == pytest.approx(expected, abs=1.5 / 240.0)


@every_engine
@STEPS
@pytest.mark.parametrize("velocity", [0.02, 0.5])
def test_a_nudged_key_comes_to_rest(tmp_path: Path, engine: Engine, step: float, velocity: float) -> None:
    with held(engine, key(tmp_path), step=step) as world:
        world.place({})
        world.kick({"j": velocity})
        speeds = recorded(world, 2.0, lambda: float(np.abs(world.velocities()).max()))
        assert speeds.max() <= 1.5 * velocity + 0.3 and speeds[-1] < 1e-3
        assert abs(position(world)) < 0.05 * TRAVEL


@every_engine
@STEPS
def test_a_weight_stands_on_a_sprung_foot(tmp_path: Path, engine: Engine, step: float) -> None:
    # 1 kg on a foot whose spring resists with 5 to 15 N over 5 mm: pushed by contact alone, of which no adapter knows.
    # The foot weighs 0.2 kg: through one of a few grams Bullet's solver does not carry a kilogram.
    body = UrdfLink("body", 1.0, ORIGIN, ball_inertia(2e-3), ((box(0.1, 0.1, 0.05), (0.0, 0.0, 0.05)),))
    foot = replace(KEY, name="foot", mass=0.2, inertia=ball_inertia(2e-4), shapes=((box(0.1, 0.1, 0.01), ORIGIN),))
    travel, stiffness = 5e-3, 2000.0
    slide = UrdfJoint(
        "j", "prismatic", "body", "foot", lower=0.0, upper=travel, stiffness=stiffness, reference=-5.0 / stiffness,
        armature=stiffness * (1.0 / 60.0) ** 2 / 0.25, damping=0.03,
    )  # fmt: skip
    with on_plane(engine, write_urdf(tmp_path, [body, foot], [slide]), step=step) as world:
        world.place({}, height_m=0.05 if step < 0.01 else 0.01)
        speeds = recorded(world, 3.0, lambda: float(world.link_speeds().max()))
        assert speeds.max() < 2.0, "it does not explode"
        positions = recorded(world, 2.0, lambda: position(world))
    assert positions.mean() == pytest.approx((1.0 * G - 5.0) / stiffness, abs=3e-4)


@every_engine
@pytest.mark.parametrize("travel", [1e-3, 1.8e-3, 0.02])
def test_a_light_cap_on_a_slide_takes_its_friction_however_short_its_way(
    tmp_path: Path, engine: Engine, travel: float
) -> None:
    friction, mass = 2.5, 2.7e-3
    armature = friction_armature(friction, mass, travel, PhysicsSettings())
    # Off its frame: of a body on a slide along the world's axis, MuJoCo's estimate leaves armature out.
    cap = UrdfLink("part", mass, (0.0, 0.01, 0.0), ball_inertia(1e-7))
    slide = {"type": "prismatic", "axis": (1, 0, 0), "friction": friction, "armature": armature}
    with held(engine, swing(tmp_path, cap, **slide, lower=0.0, upper=travel)) as world:
        for share, holds in ((0.48, True), (0.9, True), (1.2, False)):
            world.place({"j": 0.0})
            world.push({"j": share * friction})
            world.step(round(0.5 / world.timestep_s))
            assert (position(world) < 0.02 * travel) == holds, (share, position(world))


@every_engine
@STEPS
def test_a_rocker_snaps_to_the_end_that_is_nearer(tmp_path: Path, engine: Engine, step: float) -> None:
    rocker = UrdfLink("part", 0.005, ORIGIN, ball_inertia(1e-6))
    terms: dict[str, object] = {"friction": 0.01, "damping": 1e-5, "armature": 2e-4, "lower": -0.12, "upper": 0.12}
    with held(engine, swing(tmp_path, rocker, **terms, bias=(0.08 / 0.12, 0.0, -0.08, 0.08)), step=step) as world:
        for start, effort, end in ((0.12, 0.0, 0.12), (0.12, -0.07, 0.12), (0.12, -0.11, -0.12), (-0.04, 0.0, -0.12)):
            world.place({"j": start})
            world.push({"j": effort})
            world.step(round(1.0 / step))
            world.push({})
            world.step(round(0.5 / step))
            assert position(world) == pytest.approx(end, abs=0.012), (start, effort)


@every_engine
@STEPS
def test_a_selector_clicks(tmp_path: Path, engine: Engine, step: float) -> None:
    """Detents of 0.02 N·m at every 0.5 rad beside 0.01 N·m of friction: by hand it takes 0.03 N·m to leave
    one slowly, and 0.01 + 0.75 · 0.02 = 0.025 N·m at once: its draw, over the way to the middle, is three quarters."""
    knob = UrdfLink("part", 0.02, ORIGIN, ball_inertia(1e-5))
    terms: dict[str, object] = {"friction": 0.01, "damping": 1e-3, "armature": 2e-4, "lower": -3.0, "upper": 3.0}
    with held(engine, swing(tmp_path, knob, **terms, bias=(-0.16, 0.2, -0.02, 0.02, 0.5)), step=step) as world:
        for start, effort, end in ((0.2, 0.023, 0.2), (1.2, -0.023, 1.2), (0.4, 0.0, 0.2), (0.52, 0.0, 0.7)):
            world.place({"j": start})
            world.push({"j": effort})
            world.step(round(0.5 / step))
            held_at = position(world)
            world.push({})
            world.step(round(0.5 / step))
            assert abs(held_at - end) < 0.25 and position(world) == pytest.approx(end, abs=0.07), (start, effort)
        world.place({"j": 0.2})
        world.push({"j": 0.029})
        world.step(round(1.0 / step))
        assert position(world) > 0.7, "a little more turns it past one click after another"


@every_engine
@STEPS
def test_a_seal_holds_a_door_shut_and_lets_go_of_it_for_good(tmp_path: Path, engine: Engine, step: float) -> None:
    door = UrdfLink("part", 10.0, ORIGIN, ball_inertia(1.0))
    terms: dict[str, object] = {"friction": 0.5, "damping": 0.7, "lower": 0.0, "upper": 2.0}
    with held(engine, swing(tmp_path, door, **terms, bias=(400.0, 0.02, -8.0, 0.0)), step=step) as world:
        for effort, opens in ((7.5, False), (9.5, True)):
            world.place({})
            world.push({"j": effort})
            world.step(round(1.0 / step))
            assert (position(world) > 0.05) == opens, effort
        world.place({"j": 0.03})
        world.step(round(1.0 / step))
        assert position(world) == pytest.approx(0.03, abs=2e-3), "beyond its gasket its hinges keep it"
