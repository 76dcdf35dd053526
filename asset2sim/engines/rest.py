"""The paper's test in any engine: an object on a plane, its base free, nothing driven, settles and then is watched."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from asset2sim.arrays import Array
from asset2sim.engines.registry import engine_version, open_world
from asset2sim.engines.world import World
from asset2sim.metrics.drift import drift
from asset2sim.metrics.oscillation import amplitude, sign_changes
from asset2sim.metrics.penetration import ContactPoint, by_pair, penetration
from schemas.measurement import JointMotion, Measurement
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine

SPEED_EVERY = 4
"""Steps between two readings of all link speeds: in PyBullet they cost more than a step on an object of a hundred
links."""
TURN_FACTOR = 10.0
"""A turn counts as still below this many times the links' bound, rad/s: a lever arm of a decimetre."""
BEYOND_MEASURE = 1e9
"""What a record holds instead of infinity or no number: larger than any threshold, and still a number in JSON
and SQL."""


@dataclass(frozen=True)
class Recording:
    """What was watched. Poses and joints over the test: (n, 3), (n, 4) xyzw, (n, j); joints after settling: (j,)."""

    joints: tuple[str, ...]
    root_positions: Array
    root_orientations: Array
    joint_positions: Array
    settled: Array
    peak_speed: float
    console: tuple[str, ...]


@dataclass
class Speeds:
    """The fastest link's speed now and at its peak, m/s; infinite where a number is not finite."""

    world: World
    peak: float = 0.0

    def read(self) -> float:
        """The speed of the fastest link's centre of mass now, m/s."""
        now = float(np.max(self.world.link_speeds()))
        self.peak = max(self.peak, now) if np.isfinite(now) else float("inf")
        return self.peak if not np.isfinite(self.peak) else now


def contacts_at(
    engine: Engine, urdf: Path, positions: Mapping[str, float], settings: EngineSettings
) -> list[ContactPoint]:
    """Contact points at one pose in a world of their own: contact caches make Φ depend a little on what came before."""
    with open_world(
        engine, urdf, plane=False, timestep_s=settings.timestep_s, contact_friction=0.0, gravity_m_s2=0.0
    ) as world:
        world.place(positions)
        return world.contacts()


def watch(
    engine: Engine,
    urdf: Path,
    positions: Mapping[str, float],
    contact_friction: float,
    height_m: float,
    settings: EngineSettings,
) -> Recording:
    """Set the object over the plane at ``height_m`` in its initial state, let it settle, then record it untouched."""
    with open_world(
        engine, urdf, plane=True, timestep_s=settings.timestep_s, contact_friction=contact_friction
    ) as world:
        world.place(positions, height_m=height_m)
        speeds = Speeds(world)
        settle(world, speeds, settings)
        root_positions, root_orientations, joint_positions = [], [], []
        for index in range(round(settings.test_s / settings.timestep_s) + 1):
            position, orientation = world.root_pose()
            root_positions.append(position)
            root_orientations.append(orientation)
            joint_positions.append(world.positions())
            if index % SPEED_EVERY == 0 and not np.isfinite(speeds.read()):
                break
            world.step()
        return Recording(
            world.joint_names,
            np.array(root_positions),
            np.array(root_orientations),
            np.array(joint_positions),
            joint_positions[0],
            speeds.peak,
            world.console,
        )


def settle(world: World, speeds: Speeds, settings: EngineSettings) -> float:
    """Step until nothing has moved for ``still_s``, or ``settle_s`` are over, or something is no longer a number.

    Returns the time that passed, s.
    """
    still_steps, passed = 0, 0
    interval = SPEED_EVERY * world.timestep_s
    _, before = world.root_pose()
    for _ in range(round(settings.settle_s / interval)):
        world.step(SPEED_EVERY)
        passed += SPEED_EVERY
        fastest = speeds.read()
        if not np.isfinite(fastest):
            break
        _, after = world.root_pose()
        turning, before = turned(before, after) / interval, after
        joints = np.abs(world.velocities()).max(initial=0.0)
        moving = fastest > settings.still_speed or max(turning, joints) > TURN_FACTOR * settings.still_speed
        still_steps = 0 if moving else still_steps + SPEED_EVERY
        if still_steps * world.timestep_s >= settings.still_s:
            break
    return passed * world.timestep_s


def turned(before: Array, after: Array) -> float:
    """The angle, rad, between two (4,) xyzw orientations that are close: twice the vector part of their quotient.

    Its sine, unlike its cosine, is exact for the small angles of an engine that counts in single precision.
    """
    vector = before[3] * after[:3] - after[3] * before[:3] + np.cross(after[:3], before[:3])
    return 2.0 * float(np.arcsin(min(1.0, float(np.linalg.norm(vector)))))


def measure(
    engine: Engine, urdf: Path, positions: Mapping[str, float], contact_friction: float, settings: EngineSettings
) -> Measurement:
    """One engine's record of one refined asset in its initial state: Φ there, then rest on a plane (paper, section 1).

    Raises AssetError (engine_crash) where the engine refuses the asset, UsageError where it is not installed.
    """
    points = contacts_at(engine, urdf, positions, settings)
    seen = watch(engine, urdf, positions, contact_friction, settings.drop_height_m, settings)
    drift_m, drift_rad = drift(seen.root_positions, seen.root_orientations)
    return Measurement(
        engine=engine.value,
        engine_version=engine_version(engine),
        timestep_s=settings.timestep_s,
        settle_s=settings.settle_s,
        test_s=settings.test_s,
        penetration_m=penetration(points),
        pairs=by_pair(points),
        drift_m=capped(drift_m),
        drift_rad=capped(drift_rad),
        peak_speed_m_s=capped(seen.peak_speed),
        joints=tuple(
            JointMotion(
                name=name,
                amplitude=capped(amplitude(seen.joint_positions[:, i])),
                sign_changes=sign_changes(seen.joint_positions[:, i]),
                final_position=capped(float(seen.joint_positions[-1, i])),
            )
            for i, name in enumerate(seen.joints)
        ),
        settle_motion={
            name: capped(abs(float(seen.settled[i]) - positions.get(name, 0.0))) for i, name in enumerate(seen.joints)
        },
        finite=bool(np.isfinite(seen.joint_positions).all() and np.isfinite(seen.peak_speed)),
        console=seen.console,
    )


def capped(value: float) -> float:
    """The value, or ``BEYOND_MEASURE`` where it is not finite."""
    return value if np.isfinite(value) and abs(value) < BEYOND_MEASURE else BEYOND_MEASURE
