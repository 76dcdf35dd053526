"""Which end of a joint's range is closed and which is open, from geometry alone.

Closed objects are compact: the hull of the whole object is smallest when a door, lid or drawer is shut. Where the hull
does not tell the ends apart (a button inside its panel, a screen folded flat either way), the second cue is how near
the moving part is to the rest of the object.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from asset2sim.assets.meshes.hull import hull_vertices
from asset2sim.physics.arrays import Array
from asset2sim.physics.convex_hull import hull_volume
from asset2sim.physics.kinematics import TreeJoint, apply, link_to_root, moved_links

SAMPLES = 9
"""Positions sampled along a range: a hull's volume is smooth in q, and the closed state may lie inside the range."""


@dataclass(frozen=True)
class JointEnds:
    """A joint's closed and open positions (radians or metres) and the confidence, 0 to 1, in telling them apart."""

    closed: float
    open: float
    confidence: float


@dataclass(frozen=True)
class DrawnTree:
    """An object's joints and root link, and link → (n, 3) points that span it as drawn, in its own frame, m."""

    tree: Sequence[TreeJoint]
    root: str
    points: Mapping[str, Array]

    def joint(self, name: str) -> TreeJoint:
        """The joint of this name."""
        return next(joint for joint in self.tree if joint.name == name)

    def parted(self, joint: TreeJoint, position: float) -> tuple[Array, Array, Array]:
        """The (4, 4) frame of a joint, the (n, 3) points of what it moves, and those of the rest, in the root's
        frame."""
        poses = link_to_root(self.tree, self.root, {joint.name: position})
        moved = set(moved_links(self.tree, joint.name))
        clouds = {name: apply(poses[name], cloud) for name, cloud in self.points.items() if len(cloud)}
        part, rest = (
            np.vstack([np.zeros((0, 3)), *(clouds[name] for name in clouds if (name in moved) is inside)])
            for inside in (True, False)
        )
        return poses[joint.parent] @ joint.child_to_parent, part, rest


def opening_profile(item: DrawnTree, joint: TreeJoint, lower: float, upper: float) -> tuple[Array, Array, Array]:
    """(n,) positions, (n,) volumes of the object's hull, m³, and (n,) distances of the moving part from the rest, m: 0
    where nothing else has a shape."""
    tree, root, points = item.tree, item.root, item.points
    moved = set(moved_links(tree, joint.name))
    beyond = [other for other in tree if other.child in moved]
    still = link_to_root(tree, root, {})
    static = [apply(still[name], cloud) for name, cloud in points.items() if name not in moved and len(cloud)]
    fixed = np.vstack(static) if static else np.zeros((0, 3))
    fixed = hull_vertices(fixed)
    positions = np.linspace(lower, upper, SAMPLES)
    volumes, gaps = np.zeros(SAMPLES), np.zeros(SAMPLES)
    center = (fixed.min(axis=0) + fixed.max(axis=0)) / 2.0 if len(fixed) else None
    for index, position in enumerate(positions):
        poses = link_to_root(beyond, root, {joint.name: float(position)}, still)
        clouds = [apply(poses[name], points[name]) for name in moved if name in points and len(points[name])]
        if not clouds:
            continue
        moving = np.vstack(clouds)
        volumes[index] = hull_volume(np.vstack([fixed, moving]))
        middle = (moving.min(axis=0) + moving.max(axis=0)) / 2.0
        gaps[index] = 0.0 if center is None else float(np.linalg.norm(middle - center))
    return positions, volumes, gaps


GAP_WEIGHT = 0.5
"""Weight of the distance cue, per object diagonal, beside the hull volume: it decides where that does not."""
INTERIOR_MARGIN = 0.05
"""How much more compact than both ends an inner position must be to be the closed one (drawers that pass through)."""
SURE = 0.15
"""Difference of compactness between the ends from which the answer is certain; doors of real assets show 0.2 to 0.8."""
BLIND = 0.004
"""Difference below which geometry does not decide; the closed end is then the one nearer the authored zero."""

GUESSED = 0.3
"""Confidence below which an end is a guess, and what either would mean is looked at: a lid that covers, or hangs."""
LEVEL = 0.3
"""|axis · z| up to which a hinge is level, as a lid's is."""
COVERS = 0.5
"""Share of a part, seen from above, by which it covers the rest more at one end for it to be a lid closed there."""
HANGING = 0.5
"""How far below its hinge the middle of a part is, over its distance from it, for the part to hang from it."""
LID_SHARE = 0.15
"""Area of a part, seen from above, over that of the rest, from which it may be a lid or one of its flaps."""
ON_TOP = 0.75
"""Height of its middle over the rest's, from which a part is on top of it."""
COVERING_CONFIDENCE = 0.5
"""Confidence in an end at which a lid covers the rest, where compactness does not tell."""


def joint_ends(item: DrawnTree, joint: TreeJoint, lower: float, upper: float, diagonal: float) -> JointEnds:
    """The closed and open positions of one joint with limits; ``diagonal`` is the object's, m."""
    nearest_zero = min((lower, upper), key=abs)
    other = upper if nearest_zero == lower else lower
    if upper - lower <= 0.0 or diagonal <= 0.0:
        return JointEnds(nearest_zero, other, 0.0)
    positions, volumes, gaps = opening_profile(item, joint, lower, upper)
    if volumes.max() <= 0.0:
        return JointEnds(nearest_zero, other, 0.0)
    shares = volumes / volumes.max()
    cost = shares + GAP_WEIGHT * gaps / diagonal
    difference = abs(float(cost[0] - cost[-1]))
    inner = int(np.argmin(cost))
    # A leaf that slides along a wall is nearest to its middle where it stands in the way: that alone says nothing.
    compact = shares[inner] < min(shares[0], shares[-1]) - BLIND or lower < 0.0 < upper
    if compact and cost[inner] < min(cost[0], cost[-1]) - INTERIOR_MARGIN and not is_mirrored(positions, cost, inner):
        closed = float(positions[inner])
        if upper - lower < 2.0 * math.pi and lies_beside(item, joint, closed):
            closed = higher_end(item, joint, (lower, upper))
        far = upper if upper - closed >= closed - lower else lower
        return JointEnds(closed, far, 0.5)
    if difference < GUESSED * SURE:
        lid = covered_end(item, joint, (lower, upper))
        if lid is not None:
            return JointEnds(lid, upper if lid == lower else lower, COVERING_CONFIDENCE)
    if difference < BLIND:
        return JointEnds(nearest_zero, other, 0.0)
    closed, opened = (lower, upper) if cost[0] < cost[-1] else (upper, lower)
    return JointEnds(closed, opened, min(difference / SURE, 1.0))


def is_mirrored(positions: Array, cost: Array, inner: int) -> bool:
    """Whether the joint is as compact as at its sample ``inner`` where it is turned as far the other way: a seesaw that
    stands on end either way is closed at neither."""
    other = int(np.argmin(np.abs(positions + positions[inner])))
    apart = abs(float(positions[other] + positions[inner])) <= 1e-3 * float(np.ptp(positions))
    return other != inner and apart and float(cost[other] - cost[inner]) < INTERIOR_MARGIN


def lies_beside(item: DrawnTree, joint: TreeJoint, position: float) -> bool:
    """Whether a level hinge lays its part out there beside the rest, as a screen that is folded back beyond its
    keyboard: flat, and so compact, but neither over the rest, as a lid is that is shut, nor hanging."""
    pivot, part, body = item.parted(joint, position)
    axis = pivot[:3, :3] @ joint.axis
    if joint.type != "revolute" or abs(float(axis[2])) > LEVEL or not len(part) or not len(body):
        return False
    arm = (part.min(axis=0) + part.max(axis=0)) / 2.0 - pivot[:3, 3]
    arm = arm - axis * float(axis @ arm)
    hangs = -float(arm[2]) > HANGING * float(np.linalg.norm(arm))
    own, shared = areas_from_above(part, body, axis)
    return not hangs and shared < COVERS * own


def higher_end(item: DrawnTree, joint: TreeJoint, ends: tuple[float, float]) -> float:
    """The end at which a joint's part is higher: towards which a screen is folded shut that goes back beyond flat."""
    return max(ends, key=lambda end: float(item.parted(joint, end)[1][:, 2].mean()))


def outer_end(item: DrawnTree, joint: TreeJoint, ends: tuple[float, float]) -> float:
    """The end at which a joint's part is further from the middle of the rest: where a button stands out."""

    def apart(end: float) -> float:
        _, part, body = item.parted(joint, end)
        between = [part.min(axis=0) + part.max(axis=0), body.min(axis=0) + body.max(axis=0)]
        return float(np.linalg.norm(between[1] - between[0]))

    return max(ends, key=apart)


def areas_from_above(part: Array, body: Array, axis: Array) -> tuple[float, float]:
    """The area of a part seen from above, and that of it over or under a body, by their boxes along a (3,) axis."""
    across = np.array([axis[:2], [-axis[1], axis[0]]]) / float(np.linalg.norm(axis[:2]))
    own, other = part[:, :2] @ across.T, body[:, :2] @ across.T
    both = np.minimum(own.max(axis=0), other.max(axis=0)) - np.maximum(own.min(axis=0), other.min(axis=0))
    return float(np.prod(np.ptp(own, axis=0))), float(np.prod(np.maximum(both, 0.0)))


def covered_end(item: DrawnTree, joint: TreeJoint, ends: tuple[float, float]) -> float | None:
    """The end of a level hinge's range at which its part lies on top of the rest, as a lid does, by ``COVERS`` of the
    part more than at the other; None where neither does. Seen from above along the hinge, z being up in the root."""
    rest = link_to_root(item.tree, item.root, {})
    axis = (rest[joint.parent] @ joint.child_to_parent)[:3, :3] @ joint.axis
    if joint.type != "revolute" or abs(float(axis[2])) > LEVEL or abs(ends[1] - ends[0]) >= 2.0 * math.pi:
        return None
    shares, heights, areas = [], [], []
    for end in ends:
        _, part, body = item.parted(joint, end)
        if not len(part) or not len(body):
            return None
        own, shared = areas_from_above(part, body, axis)
        areas.append(own)
        shares.append(shared)
        heights.append((float(part[:, 2].mean()) - float(body[:, 2].min())) / max(float(np.ptp(body[:, 2])), 1e-9))
    most, least = max(areas), LID_SHARE * areas_from_above(body, body, axis)[0]
    if most <= least or abs(shares[0] - shares[1]) < COVERS * most:
        return None
    top = int(shares[1] > shares[0])
    return ends[top] if heights[top] >= ON_TOP else None
