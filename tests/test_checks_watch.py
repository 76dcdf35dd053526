"""A run ends early where all only trembles or coasts on, and not where it topples, swings wider or goes on too far."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from asset2sim.checks.watch import Harmless, is_steady, watch
from asset2sim.engines.pybullet_world import open_pybullet
from asset2sim.physics.arrays import Array
from schemas.settings import EngineSettings
from tests.builders import UrdfJoint, UrdfLink, ball_inertia, box, write_urdf

SETTINGS = EngineSettings()
EVERY_S, WINDOW = 1.0 / 60.0, 15
STILL = np.full(2, 1e-4)
CALM = Harmless(0.01, np.array([0.02, np.inf]))
"""Speeds up to 1 cm/s and 0.02 of the first entry of the pose decide nothing, and the second never does."""


def seen(pose: Callable[[float], float], free: Callable[[float], float] = lambda _: 0.0, speed: float = 0.0) -> bool:
    """``steady`` of three windows of readings of a pose over time (s), 5 s before the end."""
    times = EVERY_S * np.arange(3 * WINDOW)
    readings = [(np.array([pose(time), free(time)]), np.array([speed])) for time in times]
    return is_steady(readings, STILL, CALM, 5.0 / EVERY_S)


@pytest.mark.parametrize(
    ("pose", "goes_on"),
    [
        (lambda t: 0.3, True),
        (lambda t: 0.005 * math.sin(16.0 * math.pi * t), True),  # trembles
        (lambda t: 0.015 * math.sin(16.0 * math.pi * t), False),  # so wide that it could decide
        (lambda t: 0.003 * t, True),  # coasts over 0.015 until the end
        (lambda t: 0.005 * t, False),  # and over 0.025
        (lambda t: 0.005 * math.exp(-t / 0.3), True),  # comes to rest
        (lambda t: 0.0005 * math.exp(t / 0.3), False),  # topples
        (lambda t: 0.001 * math.exp(t) * math.sin(16.0 * math.pi * t), False),  # swings ever wider
    ],
)
def test_what_goes_on_as_it_does_is_told_from_what_grows(pose: Callable[[float], float], goes_on: bool) -> None:
    assert seen(pose) is goes_on


def test_a_free_joint_may_turn_on_and_a_fast_link_may_not() -> None:
    assert seen(lambda _: 0.0, free=lambda t: 3.0 * t)
    assert not seen(lambda _: 0.0, free=lambda t: 3.0 * t + 1.0 * t**2)
    assert seen(lambda _: 0.0, speed=0.009)
    assert not seen(lambda _: 0.0, speed=0.011)


@pytest.mark.system
def test_a_window_is_looked_at_only_where_its_ends_are_alike(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    looked, spread = list[int](), np.ptp

    def look(poses: Array, axis: int) -> Array:
        looked.append(len(poses))
        return np.asarray(spread(poses, axis=axis))

    monkeypatch.setattr(np, "ptp", look)
    body = UrdfLink("body", 1.0, inertia=ball_inertia(0.01), shapes=((box(0.1, 0.1, 0.1), (0.0, 0.0, 0.0)),))
    with open_pybullet(write_urdf(tmp_path, [body]), plane=True, timestep_s=1.0 / 240.0, contact_friction=0.8) as world:
        world.place({}, height_m=1.0)
        assert watch(world, 0.4, SETTINGS).seconds >= 0.4 and not looked, "it falls"
        world.place({}, height_m=0.0)
        assert watch(world, 4.0, SETTINGS).seconds < 1.0 and looked


@pytest.mark.system
def test_a_pole_set_just_beyond_its_balance_falls_before_its_run_ends(tmp_path: Path) -> None:
    edge, height = 0.05, 1.0
    pole = UrdfLink("pole", 1.0, inertia=ball_inertia(0.083), shapes=((box(edge, edge, height), (0.0, 0.0, 0.0)),))
    balance = math.atan(edge / height)
    with open_pybullet(write_urdf(tmp_path, [pole]), plane=True, timestep_s=1.0 / 240.0, contact_friction=0.8) as world:
        world.place({}, height_m=0.0, tilt_rad=(balance + 2e-3, 0.0, 0.0))
        calm = Harmless(0.01, np.array([np.inf] * 3 + [0.02] * 9))
        run = watch(world, 6.0, SETTINGS, calm=calm)
    # Fallen by a right angle, its centre has come down from half a metre.
    assert run.peak > 1.0


@pytest.mark.system
def test_a_wheel_that_coasts_ends_a_run_unless_how_far_decides(tmp_path: Path) -> None:
    wheel = UrdfLink("wheel", 1.0, inertia=ball_inertia(0.01))
    base = UrdfLink("base", 10.0, inertia=ball_inertia(1.0))
    urdf = write_urdf(tmp_path, [base, wheel], [UrdfJoint("axle", "continuous", "base", "wheel")])
    with open_pybullet(urdf, plane=False, timestep_s=1.0 / 240.0, contact_friction=0.5) as world:

        def seconds(turn_rad: float | None) -> float:
            world.place({})
            world.kick({"axle": 0.1})
            harm = None if turn_rad is None else Harmless(0.01, np.array([np.inf] * 12 + [turn_rad]))
            return watch(world, 3.0, SETTINGS, calm=harm).seconds

        # At 0.1 rad/s 0.225 rad are left after three windows of a quarter of a second.
        assert seconds(0.25) == pytest.approx(0.75, abs=0.1)
        assert seconds(0.1) == pytest.approx(2.0, abs=0.1)  # 0.1 rad are left
        assert seconds(None) == pytest.approx(3.0)
