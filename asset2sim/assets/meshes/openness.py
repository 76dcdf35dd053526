"""Which end of a joint's range is closed and which is open, from geometry alone.

Closed objects are compact: the hull of the whole object is smallest when a door, lid or drawer is shut. Where the hull
does not tell the ends apart (a button inside its panel, a screen folded flat either way), the second cue is how near
the moving part is to the rest of the object.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from asset2sim.assets.meshes.hull import hull_vertices, hull_volume
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint, apply, link_to_root, subtree

SAMPLES = 9
"""Positions sampled along a range: a hull's volume is smooth in q, and the closed state may lie inside the range."""


@dataclass(frozen=True)
class JointEnds:
    """A joint's closed and open positions (radians or metres) and the confidence, 0 to 1, in telling them apart."""

    closed: float
    open: float
    confidence: float


def profile(
    tree: Sequence[TreeJoint], root: str, points: Mapping[str, Array], joint: TreeJoint, lower: float, upper: float
) -> tuple[Array, Array, Array]:
    """(n,) positions, (n,) volumes of the object's hull, m³, and (n,) distances of the moving part from the rest, m."""
    moved = set(subtree(tree, joint.name))
    poses = link_to_root(tree, root, {})
    static = [apply(poses[name], cloud) for name, cloud in points.items() if name not in moved and len(cloud)]
    fixed = np.vstack(static) if static else np.zeros((0, 3))
    fixed = hull_vertices(fixed)
    positions = np.linspace(lower, upper, SAMPLES)
    volumes, gaps = np.zeros(SAMPLES), np.zeros(SAMPLES)
    center = (fixed.min(axis=0) + fixed.max(axis=0)) / 2.0 if len(fixed) else np.zeros(3)
    for index, position in enumerate(positions):
        poses = link_to_root(tree, root, {joint.name: float(position)})
        clouds = [apply(poses[name], points[name]) for name in moved if name in points and len(points[name])]
        if not clouds:
            continue
        moving = np.vstack(clouds)
        volumes[index] = hull_volume(np.vstack([fixed, moving]))
        middle = (moving.min(axis=0) + moving.max(axis=0)) / 2.0
        gaps[index] = float(np.linalg.norm(middle - center))
    return positions, volumes, gaps


GAP_WEIGHT = 0.5
"""Weight of the distance cue, per object diagonal, beside the hull volume: it decides where that does not."""
INTERIOR_MARGIN = 0.05
"""How much more compact than both ends an inner position must be to be the closed one (drawers that pass through)."""
SURE = 0.15
"""Difference of compactness between the ends from which the answer is certain; doors of real assets show 0.2 to 0.8."""
BLIND = 0.004
"""Difference below which geometry does not decide; the closed end is then the one nearer the authored zero."""


def joint_ends(
    tree: Sequence[TreeJoint],
    root: str,
    points: Mapping[str, Array],
    joint: TreeJoint,
    lower: float,
    upper: float,
    diagonal: float,
) -> JointEnds:
    """The closed and open positions of one joint with limits. ``points`` maps link → (n, 3) hull points in the link's
    frame; ``diagonal`` is the object's, m."""
    nearest_zero = min((lower, upper), key=abs)
    other = upper if nearest_zero == lower else lower
    if upper - lower <= 0.0 or diagonal <= 0.0:
        return JointEnds(nearest_zero, other, 0.0)
    positions, volumes, gaps = profile(tree, root, points, joint, lower, upper)
    if volumes.max() <= 0.0:
        return JointEnds(nearest_zero, other, 0.0)
    cost = volumes / volumes.max() + GAP_WEIGHT * gaps / diagonal
    difference = abs(float(cost[0] - cost[-1]))
    inner = int(np.argmin(cost))
    if cost[inner] < min(cost[0], cost[-1]) - INTERIOR_MARGIN:
        closed = float(positions[inner])
        far = upper if upper - closed >= closed - lower else lower
        return JointEnds(closed, far, 0.5)
    if difference < BLIND:
        return JointEnds(nearest_zero, other, 0.0)
    closed, opened = (lower, upper) if cost[0] < cost[-1] else (upper, lower)
    return JointEnds(closed, opened, min(difference / SURE, 1.0))
