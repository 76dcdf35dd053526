"""Where a hand moves a part: the point at its edge, the direction in which that point moves, and the lever."""

from dataclasses import dataclass

import numpy as np

from asset2sim.physics.arrays import Array

EDGE_SHARE = 0.9
"""Share of a part's furthest reach from its hinge beyond which its points are its edge, where a hand takes hold; of a
slider, of its extent along the way that it moves."""
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
        return Grip(middle(points[front]), axis, 1.0)
    levers = np.linalg.norm(np.cross(axis, points - origin), axis=1)
    furthest = float(levers.max())
    point = middle(points[levers >= EDGE_SHARE * furthest])
    arm = np.cross(axis, point - origin)
    if np.linalg.norm(arm) < max(LEAST_LEVER_M, EDGE_SHARE**2 * furthest):
        # A knob's edge is all around its axis: the middle of it is not on it.
        point = points[int(levers.argmax())]
        arm = np.cross(axis, point - origin)
    lever = max(float(np.linalg.norm(arm)), LEAST_LEVER_M)
    return Grip(point, arm / lever, lever)


def middle(points: Array) -> Array:
    """(3,) middle of the box about (n, 3) points."""
    center: Array = (points.min(axis=0) + points.max(axis=0)) / 2.0
    return center
