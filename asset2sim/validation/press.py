"""Where a hand or foot presses a part, and the largest press that neither tips nor slides the whole object."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from asset2sim.assets.extract import Extraction
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint, apply, link_to_root, subtree
from asset2sim.physics.mass_matrix import GRAVITY_M_S2, Body
from asset2sim.validation.notes import Notes
from schemas.overlay import JointProposal
from schemas.settings import PhysicsSettings

STANDS_ON_M, STANDS_ON_SHARE = 2e-3, 0.01
"""Height over the lowest point up to which a point counts as one that the object stands on, m, and as a share of the
object's height: feet are modelled with small differences."""
DOWNWARD = 0.5
"""Share of a press that goes down from which the table or floor takes it: no hand holds the object against it."""


@dataclass(frozen=True)
class Stand:
    """The object as it stands in its root frame, at the final scale and its initial positions.

    ``points`` has each link's (n, 3) points, ``edges`` (k, 3) the sides of what it stands on: outward unit normal in x
    and y, and offset, inside where n·x ≤ offset. ``floor`` is the height of its lowest point, m.
    """

    tree: Sequence[TreeJoint]
    poses: Mapping[str, Array]
    points: Mapping[str, Array]
    edges: Array
    floor: float
    mass: float
    com: Array
    friction: float


def stand_of(
    extraction: Extraction,
    tree: Sequence[TreeJoint],
    bodies: Mapping[str, Body],
    positions: Mapping[str, float],
    scale: float,
    friction: float,
) -> Stand:
    """The object at these joint positions; without edges where it stands on a line or a point."""
    poses = link_to_root(tree, extraction.features.root, positions)
    points = {name: apply(pose, extraction.geometry[name].points * scale) for name, pose in poses.items()}
    everything = np.vstack([np.zeros((0, 3)), *points.values()])
    mass = sum(body.mass for body in bodies.values())
    com = np.asarray(sum(body.mass * apply(poses[name], body.com[None])[0] for name, body in bodies.items())) / mass
    floor = float(everything[:, 2].min()) if len(everything) else 0.0
    return Stand(tree, poses, points, stands_on(everything, floor), floor, mass, com, friction)


def stands_on(points: Array, floor: float) -> Array:
    """(k, 3) sides of the convex area that the lowest points span; (0, 3) where they span none."""
    if len(points) == 0:
        return np.zeros((0, 3))
    slack = max(STANDS_ON_M, STANDS_ON_SHARE * float(np.ptp(points[:, 2])))
    try:
        sides: Array = ConvexHull(points[points[:, 2] <= floor + slack][:, :2]).equations * np.array([1.0, 1.0, -1.0])
    except (QhullError, ValueError):
        return np.zeros((0, 3))
    return sides


def reach_of(stand: Stand, joint: TreeJoint) -> float:
    """Distance from a hinge's axis to the furthest point that it moves, m; 1 for a slider, or without geometry."""
    return 1.0 if joint.type == "prismatic" else max(float(np.linalg.norm(far_edge(stand, joint)[1])), 0.0) or 1.0


def far_edge(stand: Stand, joint: TreeJoint) -> tuple[Array, Array]:
    """(3,) the point at which the joint's part is pressed, and (3,) its lever from the axis: the far edge of a hinge's
    part, the middle of a slider's."""
    frame = stand.poses[joint.parent] @ joint.child_to_parent
    axis = frame[:3, :3] @ joint.axis
    points = np.vstack([stand.points[link] for link in subtree(stand.tree, joint.name)])
    if len(points) == 0:
        return frame[:3, 3], np.zeros(3)
    levers = points - frame[:3, 3]
    levers -= (levers @ axis)[:, None] * axis
    if joint.type == "prismatic":
        return (points.min(axis=0) + points.max(axis=0)) / 2.0, np.zeros(3)
    index = int(np.argmax(np.linalg.norm(levers, axis=1)))
    return points[index], levers[index]


def largest_press(stand: Stand, joint: TreeJoint, outward: float, settings: PhysicsSettings) -> float:
    """The largest press on the joint's part towards ``outward`` (±1) that leaves the object standing where it is, N:
    ``press_margin`` of the force that tips or slides it; infinite where a hand holds a light object meanwhile."""
    axis = (stand.poses[joint.parent] @ joint.child_to_parent)[:3, :3] @ joint.axis
    point, lever = far_edge(stand, joint)
    way = outward * (axis if joint.type == "prismatic" else np.cross(axis, lever))
    length = float(np.linalg.norm(way))
    if length <= 0.0 or len(stand.edges) == 0:
        return math.inf
    way = way / length
    if stand.mass < settings.held_by_hand_kg and way[2] > -DOWNWARD:
        return math.inf
    weight = stand.mass * GRAVITY_M_S2
    normals, offsets = stand.edges[:, :2], stand.edges[:, 2]
    tips = -way[2] * (normals @ point[:2] - offsets) + normals @ way[:2] * (point[2] - stand.floor)
    stays = np.maximum(weight * (offsets - normals @ stand.com[:2]), 0.0)
    forces = [float(stay / tip) for stay, tip in zip(stays, tips, strict=True) if tip > 0.0]
    slides = float(np.linalg.norm(way[:2])) + stand.friction * float(way[2])
    if slides > 0.0:
        forces.append(stand.friction * weight / slides)
    return settings.press_margin * min(forces, default=math.inf)


def bounded_press(proposal: JointProposal, most: float, notes: Notes) -> JointProposal:
    """The proposal with its press forces lowered together so that none exceeds ``most``, N."""
    stated = {name: getattr(proposal, name) for name in ("press_start", "press_end")}
    largest = max((value for value in stated.values() if value is not None), default=0.0)
    if largest <= most:
        return proposal
    message = (
        f"joint '{proposal.name}': a press of {largest:.3g} N would tip or slide the object; its spring is made for "
        f"{most:.3g} N"
    )
    notes.info("press_bounded", message, joint=proposal.name, value=largest, limit=most)
    lowered = {name: None if value is None else value * most / largest for name, value in stated.items()}
    return proposal.model_copy(update=lowered)
