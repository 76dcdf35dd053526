"""Leaving an object alone in PyBullet: on a plane, free base, no actuation; settle, then watch."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pybullet

from asset2sim.arrays import Array
from asset2sim.engines.pybullet_object import PyBulletObject, loaded, stepper
from asset2sim.engines.pybullet_penetration import contacts_at
from asset2sim.metrics.drift import drift
from asset2sim.metrics.oscillation import amplitude, sign_changes
from asset2sim.metrics.penetration import by_pair, penetration
from schemas.measurement import JointMotion, Measurement
from schemas.settings import EngineSettings

SPEED_EVERY = 4
"""Steps between two readings of all link speeds: they cost more than a step on an object of a hundred links."""


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
        stepping, peak = stepper(item), 0.0
        settle = round(settings.settle_s / settings.timestep_s)
        test = round(settings.test_s / settings.timestep_s)
        links = list(range(item.client.getNumJoints(item.body)))
        root_positions, root_orientations, joint_positions = [], [], []
        settled = item.positions()
        for index in range(settle + test + 1):
            if index >= settle:
                position, orientation = item.client.getBasePositionAndOrientation(item.body)
                root_positions.append(position)
                root_orientations.append(orientation)
                joint_positions.append(item.positions())
            if index == settle:
                settled = joint_positions[0]
            if index % SPEED_EVERY == 0:
                peak = max(peak, fastest(item, links))
                if not np.isfinite(peak):
                    break
            stepping.step()
        return Recording(
            tuple(item.joint_index),
            np.array(root_positions or [[np.nan] * 3]),
            np.array(root_orientations or [[np.nan] * 4]),
            np.array(joint_positions or [np.full(len(item.joint_index), np.nan)]),
            settled,
            peak,
            item.console,
        )


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
    lowest = min(client.getAABB(item.body, link)[0][2] for link in links if has_shape(item, link))
    position, orientation = client.getBasePositionAndOrientation(item.body)
    raised = (position[0], position[1], position[2] + height_m - lowest)
    client.resetBasePositionAndOrientation(item.body, raised, orientation)
    item.place(positions)


def has_shape(item: PyBulletObject, link: int) -> bool:
    """Whether a link has a collision shape; a link without one has a box around its origin that means nothing."""
    return len(item.client.getCollisionShapeData(item.body, link)) > 0


def fastest(item: PyBulletObject, links: list[int]) -> float:
    """The speed of the fastest link's centre of mass, m/s; infinite where any is not finite."""
    speeds = [np.linalg.norm(item.client.getBaseVelocity(item.body)[0])]
    states = item.client.getLinkStates(item.body, links, computeLinkVelocity=1) if links else []
    speeds += [np.linalg.norm(state[6]) for state in states]
    peak = float(np.max(speeds))
    return peak if np.isfinite(peak) else float("inf")


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
        engine_version=str(pybullet.getAPIVersion()),
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
"""What a record holds instead of infinity or no number: larger than any threshold, and still a number in JSON and SQL."""


def capped(value: float) -> float:
    """The value, or ``BEYOND_MEASURE`` where it is not finite."""
    return value if np.isfinite(value) and abs(value) < BEYOND_MEASURE else BEYOND_MEASURE
