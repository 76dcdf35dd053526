"""Cupboards that hang on a wall, told from those that stand on a floor by their shape alone."""

import math
from collections.abc import Mapping

import numpy as np

from asset2sim.physics.arrays import Array
from asset2sim.physics.convex_hull import hull_volume
from asset2sim.physics.kinematics import apply, link_to_root, rigid_links, tree_of
from schemas.features import Features, JointFeatures

CABINET = "StorageFurniture"
UPRIGHT = 0.9
"""|axis · z| from which a hinge is a door's."""
DOOR_SHARE = 0.3
"""Height of a door over the object's, from which it is one of a cupboard and not a flap within it."""
DEPTHS = (0.25, 0.8)
"""Depth over height of wall cupboards: 0.30 to 0.37 m by 0.36 to 0.92 m (EN 1116; makers' data, wall units of 0.4 to
0.9 m height). Base units are 0.56 to 0.62 m deep at 0.72 to 0.87 m: only the plinth and the handles tell."""
BOTTOM_SHARE = 0.04
"""Height over the bottom, as a share of the object's, below which the doors end where there is no plinth: plinths of
base units are 0.10 to 0.15 m of 0.87 m."""
FOOT_SHARE = 0.85
"""Share of its box seen from above that a bottom without feet, plinth or recess covers."""
FLAT_SHARE = 0.01
"""Height over the lowest point, as that share, within which points are of the bottom."""
LOW_SHARE = 0.4
"""Height of a handle within its door, as a share of the door's, up to which it is gripped from below: handles of wall
units sit at the lower edge of the door, those of base units at the upper one (makers' mounting instructions)."""
LEVEL = 0.3
"""|axis · z| up to which a hinge is a flap's."""
FLAP_RAD = math.radians(110.0)
"""How far flaps are opened in use (``mechanisms.csv``), rad."""
BELOW_SHARE = 0.05
"""How far a flap swings below the bottom of a cupboard that hangs, as a share of its height: more than handles do."""
HINGE_SHARE = 0.1
"""How far below a front's upper edge, as a share of its height, the hinge lies on which it is lifted."""
GRIP_SHARE = 0.3
"""Share of how far a door's front stands out, outermost, that is its handle's ..."""
LEAST_GRIP = 0.008
"""... where that is at least this share of the object's height: less is a panel's relief."""


def hangs_on_wall(features: Features, points: Mapping[str, Array], scale: float, category: str) -> str:
    """Evidence, in words, that a cupboard of no stated support hangs on a wall: doors alone, which reach down to a flat
    bottom without feet or plinth, and are gripped at their lower ends. Empty where any of this is missing. ``points``
    are each link's (n, 3) hull points in its frame, m at that scale."""
    doors = [joint for joint in features.movable_joints if is_door(joint)]
    if category != CABINET or not doors or any(joint.prismatic for joint in features.movable_joints):
        return ""
    tree = tree_of(features.joints, scale)
    closed = {joint.name: joint.closed or 0.0 for joint in features.movable_joints}
    poses = link_to_root(tree, features.root, closed)
    clouds = {name: apply(poses[name], cloud) for name, cloud in points.items() if len(cloud)}
    if not clouds:
        return ""
    whole = np.vstack(list(clouds.values()))
    low, size = whole.min(axis=0), np.ptp(whole, axis=0)
    height = float(size[2])
    bottom = whole[whole[:, 2] <= low[2] + FLAT_SHARE * height]
    carried = {joint.name: rigid_links(tree, joint.name) for joint in features.movable_joints}
    still = [cloud for link, cloud in clouds.items() if not any(link in links for links in carried.values())]
    fronts = [[clouds[link] for link in carried[joint.name] if link in clouds] for joint in doors]
    if not still or not all(fronts):
        return ""
    moved, body, heights = [np.vstack(front) for front in fronts], np.vstack(still), []
    for door in moved:
        depth, grip = front_of(door, body, height)
        if grip is None or not DEPTHS[0] <= depth / height <= DEPTHS[1] or np.ptp(door[:, 2]) < DOOR_SHARE * height:
            return ""
        heights.append(grip)
    flat = hull_share(bottom[:, :2], float(np.ptp(body[:, 0]) * np.ptp(body[:, 1]))) >= FOOT_SHARE
    ends = min(float(door[:, 2].min()) for door in moved) - float(low[2])
    if not flat or ends > BOTTOM_SHARE * height or max(heights) > LOW_SHARE:
        return ""
    return (
        f"its doors end at its flat bottom, without feet or plinth, and are gripped at {100 * max(heights):.0f} % of "
        "their height, from below"
    )


def lifts_up(features: Features, points: Mapping[str, Array], scale: float, category: str) -> str:
    """Evidence, in words, that a cupboard hangs on a wall: all that opens are fronts on hinges along their upper edges,
    over a flat bottom without feet or plinth; empty where any of this is missing. ``points`` are as in
    ``hangs_on_wall``."""
    flaps = [joint for joint in features.movable_joints if is_flap(joint)]
    if category != CABINET or not flaps or len(flaps) < len(features.movable_joints):
        return ""
    tree = tree_of(features.joints, scale)
    poses = link_to_root(tree, features.root, {joint.name: joint.closed or 0.0 for joint in flaps})
    clouds = {name: apply(poses[name], cloud) for name, cloud in points.items() if len(cloud)}
    for joint in tree:
        if joint.name not in {flap.name for flap in flaps}:
            continue
        front = np.vstack([np.zeros((0, 3)), *(clouds[link] for link in rigid_links(tree, joint.name) & clouds.keys())])
        hinge = float((poses[joint.parent] @ joint.child_to_parent)[2, 3])
        if not len(front) or hinge < front[:, 2].max() - HINGE_SHARE * np.ptp(front[:, 2]) or is_level(front):
            return ""
    whole = np.vstack(list(clouds.values()))
    low, size = whole.min(axis=0), np.ptp(whole, axis=0)
    body = np.vstack([clouds[name] for name in clouds if name not in {flap.child for flap in flaps}] or [whole])
    bottom = body[body[:, 2] <= low[2] + FLAT_SHARE * float(size[2])]
    flat = hull_share(bottom[:, :2], float(np.prod(np.ptp(body[:, :2], axis=0)))) >= FOOT_SHARE
    return "its fronts are lifted on hinges along their upper edges, over a flat bottom without feet" if flat else ""


def is_level(front: Array) -> bool:
    """Whether (n, 3) points are of a leaf that lies level, as a lid does."""
    return int(np.argmin(np.ptp(front, axis=0))) == 2


def swings_below(features: Features, points: Mapping[str, Array], scale: float, category: str) -> str:
    """Evidence, in words, that a cupboard hangs on a wall: opened as in use, a flap of it swings well below its bottom,
    where a floor would stop it; empty where none does. ``points`` are as in ``hangs_on_wall``."""
    flaps = [joint for joint in features.movable_joints if is_flap(joint)]
    if category != CABINET or not flaps:
        return ""
    tree = tree_of(features.joints, scale)
    closed = {
        joint.name: (joint.closed or 0.0) * (scale if joint.prismatic else 1.0) for joint in features.movable_joints
    }

    def heights(positions: Mapping[str, float]) -> dict[str, Array]:
        poses = link_to_root(tree, features.root, positions)
        return {name: apply(poses[name], cloud)[:, 2] for name, cloud in points.items() if len(cloud)}

    whole = np.concatenate([np.zeros(0), *heights(closed).values()])
    for joint in flaps:
        way = float(np.clip((joint.open or 0.0) - closed[joint.name], -FLAP_RAD, FLAP_RAD))
        opened, moved = heights({**closed, joint.name: closed[joint.name] + way}), rigid_links(tree, joint.name)
        below = max((float(whole.min() - opened[link].min()) for link in moved if link in opened), default=0.0)
        share = below / max(float(np.ptp(whole)), 1e-12)
        if share > BELOW_SHARE:
            how_far = f"{100.0 * share:.2g} % of its height"
            return f"the flap of '{joint.name}' swings {how_far} below its bottom, where a floor would stop it"
    return ""


def is_flap(joint: JointFeatures) -> bool:
    """Whether a joint is a hinge that turns about a level axis."""
    return joint.type == "revolute" and abs(joint.axis_in_root[2]) <= LEVEL


def is_door(joint: JointFeatures) -> bool:
    """Whether a joint is a hinge that turns about an upright axis."""
    return joint.type == "revolute" and abs(joint.axis_in_root[2]) >= UPRIGHT


def front_of(door: Array, body: Array, height: float) -> tuple[float, float | None]:
    """The body's depth behind a door, m, and the height of the door's handle over its lower edge, as a share of the
    door's; None for a door without one. ``door`` and ``body`` are (n, 3) points in the root's frame, m."""
    extent = np.ptp(door, axis=0)
    axis = int(np.argmin(extent[:2]))
    middle = (body.min(axis=0) + body.max(axis=0)) / 2.0
    outward = np.sign((door[:, axis].min() + door[:, axis].max()) / 2.0 - middle[axis]) or 1.0
    standing_out = outward * door[:, axis]
    depth, out = float(np.ptp(body[:, axis])), float(np.ptp(standing_out))
    grip = door[standing_out >= standing_out.max() - GRIP_SHARE * out, 2]
    if out < LEAST_GRIP * height or np.ptp(grip) > LOW_SHARE * extent[2]:
        return depth, None
    return depth, float((grip.min() + grip.max()) / 2.0 - door[:, 2].min()) / float(extent[2])


def hull_share(points: Array, box_m2: float) -> float:
    """Share of an area (m²) that the convex hull of (n, 2) points covers; 0 where they lie on a line."""
    return hull_volume(points) / max(box_m2, 1e-12)
