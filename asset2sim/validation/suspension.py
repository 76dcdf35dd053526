"""Parts that no hand moves: suspensions, through whose springs an object stands as a cart on its wheels, and stages.

What they take is judged by what they carry.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace

import numpy as np

from asset2sim.guidance.tables import part_effort
from asset2sim.physics.kinematics import apply, rigid_links
from asset2sim.physics.mass_matrix import GRAVITY_M_S2, PosedObject
from asset2sim.validation.handling import STANDING_PART_N, Handling, standing_part
from schemas.overlay import JointPhysics

TOUCHING = 0.02
"""Height over the lowest point, as a share of the object's height, within which a part stands on the ground: wheels
that are carried by springs hang a little lower or higher than each other."""

UNKNOWN_KINDS = frozenset(
    part_effort("", "", motion, length, loose=loose).kind
    for motion in ("slider", "hinge", "spin")
    for length in (0.0, 0.1, 1.0)
    for loose in (False, True)
)
"""Kinds of parts of which nothing is known but their size and whether they swing freely."""


def with_suspensions(
    handled: Mapping[str, Handling], springs: Collection[str], item: PosedObject
) -> dict[str, Handling]:
    """The handling of joints, where those of its suspension carry the object: each its share of the weight, alike.

    An object is carried so where all that touches the ground is beyond joints that have ``springs``."""
    clouds = item.clouds
    lowest = {name: float(cloud[:, 2].min()) for name, cloud in clouds.items()}
    floor = min(lowest.values())
    height = max(float(cloud[:, 2].max()) for cloud in clouds.values()) - floor
    feet = {name for name, low in lowest.items() if low <= floor + TOUCHING * height}
    tree = item.tree
    carrying = {joint.name: {*rigid_links(tree, joint.name)} for joint in tree if joint.name in springs}
    carrying = {name: links for name, links in carrying.items() if links & feet}
    if not carrying or feet - set().union(*carrying.values()):
        return dict(handled)
    pushed = GRAVITY_M_S2 * item.mass / len(carrying)
    found = dict(handled)
    for name in carrying.keys() & handled.keys():
        load = pushed * lift_of(name, carrying[name] & feet, item)
        found[name] = replace(standing_part(handled[name]), ground_load=load)
    return found


def lifted_by_machines(
    joints: Iterable[JointPhysics], item: PosedObject, levers: Mapping[str, float], known: bool
) -> tuple[JointPhysics, ...]:
    """The joints, of which no hand is asked to move a part of no known kind that weighs more than its kind takes of a
    hand, as a stage, a lift or a robot's arm does: what drives it bears it, which here is its friction.

    A slider weighs along its axis, and a hinge of an object of no ``known`` category wherever it turns, at the edge
    of its part: joint → its lever, m."""
    poses, bodies, found = item.poses, item.bodies, list[JointPhysics]()
    hinges = {joint.name: joint for joint in item.tree}
    for joint in joints:
        hinge, asked = hinges[joint.name], joint.effort_range
        if asked is not None and asked.kind in UNKNOWN_KINDS and (joint.type == "prismatic" or not known):
            frame = poses[hinge.parent] @ hinge.child_to_parent
            axis, moved = frame[:3, :3] @ hinge.axis, [*rigid_links(item.tree, joint.name)]
            weight = GRAVITY_M_S2 * sum(bodies[link].mass for link in moved)
            share = abs(float(axis[2]))
            if joint.type != "prismatic":
                centers = [apply(poses[link], bodies[link].com[None])[0] - frame[:3, 3] for link in moved]
                middle = np.average(centers, axis=0, weights=[bodies[link].mass for link in moved])
                share = float(np.linalg.norm(np.cross(axis, middle)) * np.hypot(*axis[:2]) / levers[joint.name])
            if weight * share > asked.most_n:
                driven = {"kind": "part that a machine lifts", "most_n": STANDING_PART_N}
                joint = joint.model_copy(update={"effort_range": asked.model_copy(update=driven)})
        found.append(joint)
    return tuple(found)


def lift_of(name: str, feet: Collection[str], item: PosedObject) -> float:
    """How far a joint lifts the middle of its feet per unit of its position, m/m or m/rad: what a push of the ground of
    1 N exerts on it, N or N·m."""
    joint = next(joint for joint in item.tree if joint.name == name)
    frame = item.poses[joint.parent] @ joint.child_to_parent
    axis = frame[:3, :3] @ joint.axis
    if joint.type == "prismatic":
        return float(axis[2])
    middle = np.vstack([item.clouds[foot] for foot in feet]).mean(axis=0)
    return float(np.cross(axis, middle - frame[:3, 3])[2])
