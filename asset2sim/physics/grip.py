"""Where a hand moves a part: the point at its edge, the direction in which that point moves, and the lever."""

import math
from dataclasses import dataclass

import numpy as np

from asset2sim.physics.arrays import Array

EDGE_SHARE = 0.9
"""Share of a part's furthest reach from its hinge beyond which its points are its edge, where a hand takes hold; of a
slider, of its extent along the way that it moves."""
ROUND_SHARE = 0.75
"""Least reach of a round part in each of eight directions about its axis, as a share of its furthest: a square has
0.71, a grip with five lobes 0.81."""
LEAST_LEVER_M = 1e-3
"""Least lever of a hinge that is assumed, m: a part that hardly reaches from its axis."""


@dataclass(frozen=True)
class Grip:
    """(3,) ``point`` at a part's edge, (3,) unit ``direction`` in which it moves as the joint's position grows, and the
    ``lever`` that turns a force there into the joint's effort: m about a hinge, 1 along a slider."""

    point: Array
    direction: Array
    lever: float


def grip_on(points: Array, axis: Array, origin: Array, *, slides: bool, opens: float) -> Grip | None:
    """The grip on a part of (n, 3) points that turns about, or slides along, the (3,) unit axis through ``origin``, all
    in one frame. ``opens`` is the sign of opening: a slider's front is that way. None for a part without points."""
    if not len(points):
        return None
    if slides:
        along = opens * (points @ axis)
        front = along >= along.max() - (1.0 - EDGE_SHARE) * np.ptp(along)
        return Grip(box_middle(points[front]), axis, 1.0)
    levers = np.linalg.norm(np.cross(axis, points - origin), axis=1)
    furthest = float(levers.max())
    point = box_middle(points[levers >= EDGE_SHARE * furthest])
    arm = np.cross(axis, point - origin)
    if np.linalg.norm(arm) < max(LEAST_LEVER_M, EDGE_SHARE**2 * furthest):
        # A knob's edge is all around its axis: the middle of it is not on it.
        point = points[int(levers.argmax())]
        arm = np.cross(axis, point - origin)
    lever = max(float(np.linalg.norm(arm)), LEAST_LEVER_M)
    return Grip(point, arm / lever, lever)


def round_about(points: Array, axis: Array, origin: Array) -> bool:
    """Whether a part of (n, 3) points is round about the (3,) unit axis through ``origin``: a cap, a knob, a wheel; no
    leaf or lever, however far it turns."""
    across = np.linalg.svd(axis[None, :])[2][1:]
    flat = (points - origin) @ across.T
    if not len(flat):
        return False
    reach = np.linalg.norm(flat, axis=1).max()
    turned = flat @ np.array([[1.0, -1.0], [1.0, 1.0]]) / math.sqrt(2.0)
    edges = [side for cloud in (flat, turned) for side in (cloud.max(axis=0), -cloud.min(axis=0))]
    return bool(np.min(edges) >= ROUND_SHARE * reach)


def box_middle(points: Array) -> Array:
    """(3,) middle of the box about (n, 3) points."""
    center: Array = (points.min(axis=0) + points.max(axis=0)) / 2.0
    return center
