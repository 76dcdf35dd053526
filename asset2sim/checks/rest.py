"""The paper's rest check in any engine: an object on a plane, base free, nothing driven, settles and is recorded."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from asset2sim.checks.watch import capped_reading, reading_stride, watch
from asset2sim.engines.contacts import ContactPoint, by_pair, penetration
from asset2sim.engines.registry import engine_version, open_world
from asset2sim.engines.static_object import contact_points
from asset2sim.engines.world import World
from asset2sim.physics.arrays import Array
from schemas.interaction import JointMotion, Measurement
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine


def drift(positions: Array, orientations: Array) -> tuple[float, float]:
    """D_pos (m) and D_ori (rad) of (n, 3) root positions and (n, 4) xyzw orientations; row 0 is the reference pose.
    Infinite where any row is not finite: an object that exploded has drifted."""
    if not (np.isfinite(positions).all() and np.isfinite(orientations).all()):
        return float("inf"), float("inf")
    distance = float(np.linalg.norm(positions - positions[0], axis=1).max())
    turned = Rotation.from_quat(orientations) * Rotation.from_quat(orientations[0]).inv()
    return distance, float(turned.magnitude().max())


STILL = 1e-6
"""Change of a joint between two steps below which it counts as still: solvers tremble in the last digits."""


def amplitude(positions: Array) -> float:
    """A = max q − min q of (n,) positions of one joint, rad or m."""
    return float(np.ptp(positions)) if np.isfinite(positions).all() else float("inf")


def sign_changes(positions: Array) -> int:
    """How often Δq changes sign along (n,) positions, steps at which the joint is still left out."""
    steps = np.diff(positions)
    signs = np.sign(steps[np.abs(steps) > STILL])
    return int(np.count_nonzero(signs[1:] != signs[:-1]))


@dataclass(frozen=True)
class RestMotion:
    """Recorded motion: root positions (n, 3) and xyzw (n, 4), joints (n, j), and joints after settling (j,)."""

    joints: tuple[str, ...]
    root_positions: Array
    root_orientations: Array
    joint_positions: Array
    settled: Array
    peak_speed: float
    console: tuple[str, ...]


def contacts_at(
    engine: Engine, urdf: Path, positions: Mapping[str, float], settings: EngineSettings
) -> list[ContactPoint]:
    """Contact points at one pose in a fresh world: contact caches make Φ depend slightly on earlier poses."""
    with open_world(
        engine, urdf, plane=False, timestep_s=settings.timestep_s, contact_friction=0.0, gravity_m_s2=0.0
    ) as world:
        return contact_points(world, positions)


def observe(
    engine: Engine,
    urdf: Path,
    positions: Mapping[str, float],
    contact_friction: float,
    height_m: float,
    settings: EngineSettings,
    *,
    held: bool = False,
) -> RestMotion:
    """Set the object over the plane at ``height_m`` in its initial state, or its root ``held`` and without a plane, let
    it settle, then record it untouched. It settles for ``settle_s`` at most, less once nothing has moved for
    ``still_s`` (see ``watch``)."""
    with open_world(
        engine, urdf, plane=not held, timestep_s=settings.timestep_s, contact_friction=contact_friction
    ) as world:
        world.place(positions, height_m=height_m)
        return record(world, watch(world, settings.settle_s, settings).peak, settings)


def record(world: World, peak: float, settings: EngineSettings) -> RestMotion:
    """Motion of an object that has settled for ``test_s`` untouched; ``peak`` is its fastest link's speed until now."""
    stride = reading_stride(world)
    root_positions, root_orientations, joint_positions = [], [], []
    for index in range(round(settings.test_s / settings.timestep_s) + 1):
        position, orientation = world.root_pose()
        root_positions.append(position)
        root_orientations.append(orientation)
        joint_positions.append(world.positions())
        if index % stride == 0:
            fastest = float(np.max(world.link_speeds()))
            if not np.isfinite(fastest):
                peak = fastest
                break
            peak = max(peak, fastest)
        world.step()
    paths = np.array(root_positions), np.array(root_orientations), np.array(joint_positions)
    return RestMotion(world.joint_names, *paths, joint_positions[0], peak, world.console)


def measure(
    engine: Engine,
    urdf: Path,
    positions: Mapping[str, float],
    contact_friction: float,
    settings: EngineSettings,
    *,
    held: bool = False,
) -> Measurement:
    """One engine's record of one refined asset in its initial state: Φ there, then rest on a plane (paper, section 1),
    or with its root ``held``. Raises AssetError (engine_refused) where the engine refuses the asset,
    UsageError where it is not installed."""
    points = contacts_at(engine, urdf, positions, settings)
    seen = observe(engine, urdf, positions, contact_friction, settings.drop_height_m, settings, held=held)
    return measurement(engine, points, seen, positions, settings)


def measurement(
    engine: Engine,
    points: list[ContactPoint],
    seen: RestMotion,
    positions: Mapping[str, float],
    settings: EngineSettings,
) -> Measurement:
    """The record of an object's contact points with itself at these joint positions and of how it rests from there."""
    drift_m, drift_rad = drift(seen.root_positions, seen.root_orientations)
    return Measurement(
        engine=engine.value,
        engine_version=engine_version(engine),
        timestep_s=settings.timestep_s,
        settle_s=settings.settle_s,
        test_s=settings.test_s,
        penetration_m=penetration(points),
        pairs=by_pair(points),
        drift_m=capped_reading(drift_m),
        drift_rad=capped_reading(drift_rad),
        peak_speed_m_s=capped_reading(seen.peak_speed),
        joints=tuple(
            JointMotion(
                name=name,
                amplitude=capped_reading(amplitude(seen.joint_positions[:, i])),
                sign_changes=sign_changes(seen.joint_positions[:, i]),
                final_position=capped_reading(float(seen.joint_positions[-1, i])),
            )
            for i, name in enumerate(seen.joints)
        ),
        settle_motion={
            name: capped_reading(abs(float(seen.settled[i]) - positions.get(name, 0.0)))
            for i, name in enumerate(seen.joints)
        },
        finite=bool(np.isfinite(seen.joint_positions).all() and np.isfinite(seen.peak_speed)),
        console=seen.console,
    )
