"""The effort check: the force at a part's edge that moves it, and whether the object tips over or slides before."""

from collections.abc import Mapping, Sequence

import numpy as np

from asset2sim.checks.mechanism import Mechanism, poses_at
from asset2sim.checks.support_polygon import Clouds
from asset2sim.physics.arrays import Array
from asset2sim.physics.grip import Grip, grip_on
from asset2sim.physics.support_polygon import DOWNWARD, SupportPolygon
from schemas.interaction import Effort, Opening
from schemas.overlay import JointPhysics
from schemas.settings import Thresholds
from schemas.support import SupportKind


def efforts(
    item: Mechanism,
    clouds: Clouds,
    openings: Sequence[Opening],
    support: SupportPolygon | None,
    friction: float,
    limits: Thresholds,
    carried: SupportKind = SupportKind.FREESTANDING,
) -> tuple[Effort, ...]:
    """What a hand needs at the edge of every joint's part, each way that it has room, from the least efforts that were
    measured with the root held, and statics on ``support`` at this Coulomb ``friction``; without one nothing tips, nor
    where the object is ``carried`` by a hand. A light object whose button is pressed sideways or from below is held in
    the other hand."""
    poses = poses_at(item, item.start)
    joints = {joint.name: joint for joint in item.joints}
    found = []
    for seen in openings:
        joint = joints[seen.joint]
        if carried is not SupportKind.FIXED and bears_the_rest(item, joint):
            continue
        grip = part_grip(item, clouds, joint, poses)
        for way, effort, sign in (("opening", seen.opening, opens(joint)), ("closing", seen.closing, -opens(joint))):
            if grip is None or effort is None:
                continue
            direction = sign * grip.direction
            stands = support if carried is SupportKind.FREESTANDING else None
            if stands is not None and in_hand(joint, direction, stands, limits):
                stands = None
            record = Effort(
                joint=seen.joint,
                way=way,
                effort=effort,
                lever_m=grip.lever,
                tips_at_n=None if stands is None else stands.tips_at(grip.point, direction),
                slides_at_n=None if stands is None else stands.slides_at(direction, friction),
            )
            found.append(record)
    return tuple(found)


def bears_the_rest(item: Mechanism, joint: JointPhysics) -> bool:
    """Whether the joint moves most of the object's mass: the object stands on that part, and no hand moves it."""
    moved = sum(item.bodies[link].mass for link in item.moved[joint.name])
    return moved > sum(body.mass for body in item.bodies.values()) / 2.0


def in_hand(joint: JointPhysics, direction: Array, support: SupportPolygon, limits: Thresholds) -> bool:
    """Whether a hand holds the object while another moves the part along the (3,) direction: of a light object, a part
    with a spring that the table does not press back."""
    sprung = joint.stiffness > 0.0 and not joint.holds
    return sprung and support.mass < limits.held_by_hand_kg and float(direction @ support.up) > -DOWNWARD


def opens(joint: JointPhysics) -> float:
    """The sign of the joint's positions towards its open end."""
    return 1.0 if joint.open >= joint.closed else -1.0


def part_grip(item: Mechanism, clouds: Clouds, joint: JointPhysics, poses: Mapping[str, Array]) -> Grip | None:
    """Where a hand moves the part of a joint, in the root's frame; None for a part without collision shapes."""
    hinge = next(entry for entry in item.tree if entry.name == joint.name)
    frame = poses[hinge.parent] @ hinge.child_to_parent
    parts = [
        clouds[link] @ poses[link][:3, :3].T + poses[link][:3, 3] for link in item.rigid[joint.name] & clouds.keys()
    ]
    points = np.vstack([np.zeros((0, 3)), *parts])
    slides = joint.type == "prismatic"
    return grip_on(points, frame[:3, :3] @ hinge.axis, frame[:3, 3], slides=slides, opens=opens(joint))
