"""Cylinders among convex hulls, which engines and exports take without corners, so that a wheel rolls."""

from dataclasses import dataclass

import numpy as np

from asset2sim.physics.arrays import Array
from asset2sim.physics.convex_hull import convex_hull

SIDES = 64
"""Corners of a rim by which a cylinder takes part where hulls are cut apart; 0.12 % of its radius lie between them."""
ROUND_SHARE = 0.98
"""Least distance of a facetted wheel's corners from its axis, over the largest: what is drawn for a circle has all of
them on it, however few there are."""
WIDEST_GAP_RAD = np.pi / 4.0 + 0.01
"""Widest angle between neighbouring corners of a facetted wheel: a table with eight edges does not roll."""
FINEST_GAP_RAD = 0.12
"""Angle between neighbouring corners below which a wheel stays as it is drawn: it rolls over them under 6 % of what it
bears, and what is drawn so finely is drawn close to what it turns in."""
HUB_SHARE = 0.9
"""Largest reach of what a wheel has beside its tread, over the tread's radius."""
LEAST_LENGTH_M = 2e-3
"""Least length of a cylinder, m: the tread of a tyre that is drawn with a single outermost circle."""
LEAST_LEFT = 0.5
"""Least share of a wheel's length that is left where its end is cut off and it stays a cylinder."""
SAME = 1e-6
"""Share of its size by which the corners of a cylinder may be off through rounding."""


@dataclass(frozen=True)
class Cylinder:
    """A cylinder with its (3,) ``middle`` on its (3,) unit ``axis``, m."""

    middle: Array
    axis: Array
    radius: float
    length: float

    @property
    def corners(self) -> Array:
        """(2 · ``SIDES``, 3) corners of both rims, one after the other."""
        across = np.linalg.svd(self.axis[None, :])[2][1:]
        turns = np.arange(SIDES) * 2.0 * np.pi / SIDES
        rim = self.middle + self.radius * np.column_stack([np.cos(turns), np.sin(turns)]) @ across
        return np.vstack([rim - self.axis * self.length / 2.0, rim + self.axis * self.length / 2.0])


def cylinder_of(points: Array) -> Cylinder | None:
    """The cylinder whose ``corners`` these (n, 3) points are; None where they are others, as those of a cut one."""
    if len(points) != 2 * SIDES:
        return None
    low, high = points[:SIDES], points[SIDES:]
    along = high.mean(axis=0) - low.mean(axis=0)
    length = float(np.linalg.norm(along))
    arms = low - low.mean(axis=0)
    reach = np.linalg.norm(arms, axis=1)
    radius = float(reach.mean())
    edge = 2.0 * radius * np.sin(np.pi / SIDES)
    off = max(
        float(np.abs(high - low - along).max()),
        float(np.abs(reach - radius).max()),
        float(np.abs(np.linalg.norm(np.roll(arms, 1, axis=0) - arms, axis=1) - edge).max()),
        float(np.abs(arms @ along).max()) / max(length, radius),
    )
    if min(length, radius) <= 0.0 or off > SAME * max(length, radius):
        return None
    return Cylinder(points.mean(axis=0), along / length, radius, length)


def shortened(points: Array, normal: Array, offset: float) -> Array | None:
    """Corners of the longest cylinder in the part with normal · x ≥ offset of the cylinder whose ``corners`` these
    points are; None where they are others, or where less than ``LEAST_LEFT`` of its length is left: it rolls as before,
    which over the corners of a hull it would not."""
    whole = cylinder_of(points)
    if whole is None or abs(slope := float(normal @ whole.axis)) < SAME:
        return None
    away = whole.axis if slope > 0.0 else -whole.axis
    reach = whole.radius * float(np.sqrt(max(1.0 - slope**2, 0.0)))
    start = (offset - normal @ whole.middle + reach) / abs(slope)
    length = whole.length / 2.0 - float(start)
    if not LEAST_LEFT * whole.length <= length <= whole.length:
        return None
    middle = whole.middle + away * (whole.length - length) / 2.0
    return Cylinder(middle, whole.axis, whole.radius, length).corners


def tread(points: Array, axis: Array) -> Cylinder | None:
    """The cylinder about the (3,) unit ``axis`` through the frame's origin on which (n, 3) points roll, as wide as they
    are that far from it; None where they are not drawn round about it, or so finely that they roll as they are. It has
    them inside, or beside its ends."""
    flat = points @ np.linalg.svd(axis[None, :])[2][1:].T
    reach = np.linalg.norm(flat, axis=1)
    hull = convex_hull(flat)
    if hull is None:
        return None
    rim = flat[hull.vertices]
    turns = np.sort(np.arctan2(rim[:, 1], rim[:, 0]))
    gaps = np.diff(turns, append=turns[0] + 2.0 * np.pi)
    radius = float(reach.max())
    if np.linalg.norm(rim, axis=1).min() < ROUND_SHARE * radius:
        return None
    if not FINEST_GAP_RAD < gaps.max() < WIDEST_GAP_RAD:
        return None
    along = points[reach >= ROUND_SHARE * radius] @ axis
    length = max(float(np.ptp(along)), LEAST_LENGTH_M)
    return Cylinder(axis * (along.max() + along.min()) / 2.0, axis, radius, length)


def beside(cylinder: Cylinder, points: Array) -> Array | None:
    """Hull points of a wheel that reach out beside its tread: its hub, drawn in to ``HUB_SHARE`` of its radius so that
    the tread alone touches the ground, whatever an engine's margin. None where they lie in the tread."""
    arms = points - cylinder.middle
    along = arms @ cylinder.axis
    if np.abs(along).max() <= cylinder.length / 2.0 + (1.0 - ROUND_SHARE) * cylinder.radius:
        return None
    across = arms - np.outer(along, cylinder.axis)
    reach = np.linalg.norm(across, axis=1)
    drawn_in = np.minimum(HUB_SHARE * cylinder.radius / np.maximum(reach, SAME * cylinder.radius), 1.0)
    return np.asarray(points - across * (1.0 - drawn_in)[:, None])
