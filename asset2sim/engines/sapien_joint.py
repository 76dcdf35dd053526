"""Joints in PhysX, with damping and friction as their URDF states them.

PhysX has one drive for each axis of a joint, and a joint friction that is a coefficient of the force that the joint
transmits, not a torque. Here the drive is the dry friction, and a second joint between the same two links the damper.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yourdfpy

from asset2sim.assets.urdf.read import Dynamics
from asset2sim.physics.arrays import Array

STOP_DAMPING = 1e8
"""Damping of the drive that is the dry friction, N·m·s/rad or N·s/m: a held joint creeps at its load over this."""
UNBOUNDED = 1e6
"""Speed limits, m/s and rad/s: SAPIEN's own of 10 m/s and 50 rad/s would hide an explosion."""


@dataclass(frozen=True)
class Builder:
    """Inputs shared by all links: SAPIEN modules, URDF path, contact material, and whether the root is held."""

    sapien: Any
    physx: Any
    urdf: Path
    material: Any
    held: bool


def give_joint(builder: Builder, joint: yourdfpy.Joint, link: Any, terms: dict[str, Dynamics]) -> None:
    """Set the joint's kind, frames, limits and dry friction."""
    made, frame = link.joint, axis_frame(joint)
    made.name = joint.name
    made.type = {"fixed": "fixed", "prismatic": "prismatic"}.get(joint.type, "revolute_unwrapped")
    made.pose_in_parent = builder.sapien.Pose(origin_of(joint) @ frame)
    made.pose_in_child = builder.sapien.Pose(frame)
    if joint.type == "fixed":
        return
    term = terms[joint.name]
    made.limit = np.array([limits_of(joint)])
    made.friction = 0.0
    # Added to the joint-space inertia, with which the spring, an explicit effort, is stable (see ``SapienWorld.step``).
    made.armature = np.array([term.armature])
    made.max_velocity = UNBOUNDED
    # A drive at rest with a bounded force is Coulomb friction. As a part of the joint it is solved with it, and holds.
    made.set_drive_property(0.0, STOP_DAMPING if term.friction > 0.0 else 0.0, term.friction)
    made.set_drive_velocity_target(0.0)


def damper_of(
    builder: Builder, joint: yourdfpy.Joint, link: Any, parent: Any, terms: dict[str, Dynamics]
) -> Any | None:
    """A second joint between the same links that only damps; None where the joint has no damping."""
    if joint.type == "fixed" or terms[joint.name].damping <= 0.0:
        return None
    frame = axis_frame(joint)
    damper = builder.physx.PhysxDriveComponent(link)
    damper.parent = parent
    damper.pose_in_parent = builder.sapien.Pose(origin_of(joint) @ frame)
    damper.pose_in_child = builder.sapien.Pose(frame)
    give = damper.set_drive_property_x if joint.type == "prismatic" else damper.set_drive_property_twist
    give(0.0, terms[joint.name].damping)
    return damper


def origin_of(joint: yourdfpy.Joint) -> Array:
    """(4, 4) joint-to-parent transform."""
    return np.eye(4) if joint.origin is None else np.asarray(joint.origin, dtype=float)


def limits_of(joint: yourdfpy.Joint) -> tuple[float, float]:
    """Lower and upper limit, infinite where the joint has none or they are crossed."""
    limit = joint.limit
    if joint.type == "continuous" or limit is None or limit.lower is None or limit.upper is None:
        return -np.inf, np.inf
    return (-np.inf, np.inf) if limit.lower > limit.upper else (float(limit.lower), float(limit.upper))


def axis_frame(joint: yourdfpy.Joint) -> Array:
    """(4, 4) frame whose x axis is the joint's: PhysX moves joints about and along x. A fixed joint has the frame of
    its origin, whatever axis it states: of one without length numbers would come that kill PhysX."""
    if joint.type == "fixed":
        return np.eye(4)
    axis = np.array([1.0, 0.0, 0.0]) if joint.axis is None else np.asarray(joint.axis, dtype=float)
    axis = axis / np.linalg.norm(axis)
    side = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    side /= np.linalg.norm(side)
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 1], frame[:3, 2] = axis, side, np.cross(axis, side)
    return frame
