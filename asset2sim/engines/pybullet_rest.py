"""Leaving an object alone in PyBullet: on a plane, free base, no actuation; settle, then watch."""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pybullet

from asset2sim.arrays import Array
from asset2sim.engines.pybullet_object import PyBulletObject, Stepper, loaded, stepper
from asset2sim.engines.pybullet_penetration import contacts_at
from asset2sim.metrics.drift import drift
from asset2sim.metrics.oscillation import amplitude, sign_changes
from asset2sim.metrics.penetration import by_pair, penetration
from schemas.errors import AssetError
from schemas.measurement import JointMotion, Measurement
from schemas.settings import EngineSettings
from schemas.vocabulary import FailureMode

SPEED_EVERY = 4
"""Steps between two readings of all link speeds: they cost more than a step on an object of a hundred links."""
FAR_ABOVE_M = 20.0
"""A height, m, at which no part of a household object reaches the plane."""
TURN_FACTOR = 10.0
"""A turn counts as still below this many times the links' bound, rad/s: a lever arm of a decimetre."""


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


def watch(
    urdf: Path, positions: Mapping[str, float], contact_friction: float, height_m: float, settings: EngineSettings
) -> Recording:
    """Set the object over the plane at ``height_m`` in its initial state, let it settle, then record it untouched."""
    with loaded(urdf, fixed_base=False, timestep_s=settings.timestep_s) as item:
        stand(item, positions, contact_friction, height_m)
        links = list(range(item.client.getNumJoints(item.body)))
        stepping, speeds = stepper(item), Speeds(item, links)
        settle(stepping, speeds, settings)
        root_positions, root_orientations, joint_positions = [], [], []
        for index in range(round(settings.test_s / settings.timestep_s) + 1):
            position, orientation = item.client.getBasePositionAndOrientation(item.body)
            root_positions.append(position)
            root_orientations.append(orientation)
            joint_positions.append(item.positions())
            if index % SPEED_EVERY == 0 and not np.isfinite(speeds.read()):
                break
            stepping.step()
        return Recording(
            tuple(item.joint_index),
            np.array(root_positions),
            np.array(root_orientations),
            np.array(joint_positions),
            joint_positions[0],
            speeds.peak,
            item.console,
        )


@dataclass
class Speeds:
    """The fastest link's speed now and at its peak, m/s; infinite where a number is not finite."""

    item: PyBulletObject
    links: list[int]
    peak: float = 0.0

    def read(self) -> float:
        """The speed of the fastest link's centre of mass now, m/s."""
        speeds = [np.linalg.norm(self.item.client.getBaseVelocity(self.item.body)[0])]
        states = self.item.client.getLinkStates(self.item.body, self.links, computeLinkVelocity=1) if self.links else []
        speeds += [np.linalg.norm(state[6]) for state in states]
        now = float(np.max(speeds))
        self.peak = max(self.peak, now) if np.isfinite(now) else float("inf")
        return self.peak if not np.isfinite(self.peak) else now


def settle(stepping: Stepper, speeds: Speeds, settings: EngineSettings) -> None:
    """Step until nothing has moved for ``still_s``, or ``settle_s`` are over, or something is no longer a number."""
    still_steps = 0
    for index in range(round(settings.settle_s / settings.timestep_s)):
        stepping.step()
        if index % SPEED_EVERY:
            continue
        fastest = speeds.read()
        if not np.isfinite(fastest):
            return
        turning = np.linalg.norm(stepping.item.client.getBaseVelocity(stepping.item.body)[1])
        joints = np.abs(stepping.item.velocities()).max(initial=0.0)
        moving = fastest > settings.still_speed or max(turning, joints) > TURN_FACTOR * settings.still_speed
        still_steps = 0 if moving else still_steps + SPEED_EVERY
        if still_steps * settings.timestep_s >= settings.still_s:
            return


def stand(item: PyBulletObject, positions: Mapping[str, float], contact_friction: float, height_m: float) -> None:
    """Put a plane under the object, upright as authored, its lowest point ``height_m`` above."""
    client = item.client
    item.place(positions)
    plane = client.createMultiBody(0.0, client.createCollisionShape(pybullet.GEOM_PLANE))
    # Bullet multiplies the two coefficients of a contact: 1 on the plane leaves the object's own.
    client.changeDynamics(plane, -1, lateralFriction=1.0)
    links = [-1, *range(client.getNumJoints(item.body))]
    for link in links:
        client.changeDynamics(item.body, link, lateralFriction=contact_friction)
    # Far above the plane first: a link's box is loose, its closest point to the plane is exact.
    position, orientation = client.getBasePositionAndOrientation(item.body)
    client.resetBasePositionAndOrientation(item.body, (*position[:2], FAR_ABOVE_M), orientation)
    item.place(positions)
    gaps = [float(point[8]) for point in client.getClosestPoints(plane, item.body, 2.0 * FAR_ABOVE_M)]
    if not gaps:
        raise AssetError(FailureMode.ENGINE_CRASH, "nothing_collides", "no link has a collision shape; add one")
    raised = (position[0], position[1], FAR_ABOVE_M - min(gaps) + height_m)
    client.resetBasePositionAndOrientation(item.body, raised, orientation)
    item.place(positions)


def measure(
    urdf: Path, positions: Mapping[str, float], contact_friction: float, settings: EngineSettings
) -> Measurement:
    """PyBullet's record of one refined asset in its initial state: Φ there, then rest on a plane (paper, section 1)."""
    points = contacts_at(urdf, positions, settings)
    seen = watch(urdf, positions, contact_friction, settings.drop_height_m, settings)
    drift_m, drift_rad = drift(seen.root_positions, seen.root_orientations)
    drift_m, drift_rad, peak = capped(drift_m), capped(drift_rad), capped(seen.peak_speed)
    finite = bool(np.isfinite(seen.joint_positions).all() and np.isfinite(seen.peak_speed))
    return Measurement(
        engine="pybullet",
        engine_version=version("pybullet"),
        timestep_s=settings.timestep_s,
        settle_s=settings.settle_s,
        test_s=settings.test_s,
        penetration_m=penetration(points),
        pairs=by_pair(points),
        drift_m=drift_m,
        drift_rad=drift_rad,
        peak_speed_m_s=peak,
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
        finite=finite,
        console=seen.console,
    )


BEYOND_MEASURE = 1e9
"""What a record holds instead of infinity or no number: larger than any threshold, and still a number in JSON
and SQL."""


def capped(value: float) -> float:
    """The value, or ``BEYOND_MEASURE`` where it is not finite."""
    return value if np.isfinite(value) and abs(value) < BEYOND_MEASURE else BEYOND_MEASURE
