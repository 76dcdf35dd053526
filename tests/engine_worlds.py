"""Worlds for tests of the engines: every installed engine, and the recorded motion of a joint."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
import pytest

from asset2sim.engines.registry import installed, known_engines, open_world
from asset2sim.engines.world import World
from asset2sim.physics.arrays import Array
from asset2sim.physics.mass_matrix import GRAVITY_M_S2
from schemas.vocabulary import Engine

STEP = 1.0 / 240.0
G = GRAVITY_M_S2

ENGINES = [
    pytest.param(
        engine,
        id=engine.value,
        marks=() if engine in installed() else pytest.mark.skip(reason=f"{engine} is not installed (extra: engines)"),
    )
    for engine in known_engines()
]
every_engine = pytest.mark.parametrize("engine", ENGINES)


def held(engine: Engine, urdf: Path, step: float = STEP, gravity: float = G) -> AbstractContextManager[World]:
    """A world without a plane, the root held."""
    return open_world(engine, urdf, plane=False, timestep_s=step, contact_friction=0.5, gravity_m_s2=gravity)


def on_plane(engine: Engine, urdf: Path, step: float = STEP, friction: float = 0.5) -> AbstractContextManager[World]:
    """A world with a plane, the root free."""
    return open_world(engine, urdf, plane=True, timestep_s=step, contact_friction=friction)


def track(
    engine: Engine,
    urdf: Path,
    start: float,
    seconds: float,
    *,
    velocity: float = 0.0,
    effort: float = 0.0,
    gravity: float = G,
) -> Array:
    """(n + 1,) positions of joint ``j`` of an object whose root is held, from ``start`` on."""
    with held(engine, urdf, gravity=gravity) as world:
        world.place({"j": start})
        world.kick({"j": velocity})
        world.push({"j": effort})
        return recorded(world, seconds, lambda: float(world.positions()[world.joint_names.index("j")]))


def recorded(world: World, seconds: float, read: Callable[[], float]) -> Array:
    """(n + 1,) values read before the first step and after every one."""
    values = [read()]
    for _ in range(round(seconds / world.timestep_s)):
        world.step()
        values.append(read())
    return np.array(values)


def period(positions: Array, step: float = STEP) -> float:
    """Mean time between downward zero crossings, s."""
    before, after = positions[:-1], positions[1:]
    falls = np.flatnonzero((before > 0.0) & (after <= 0.0))
    moments = falls + before[falls] / (before[falls] - after[falls])
    return float(np.diff(moments).mean()) * step
