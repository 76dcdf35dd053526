"""How deep a fingertip presses a part before it meets what is around it, of the triangles as drawn. Pure."""

import math

import numpy as np

from asset2sim.physics.arrays import Array

ARM_M = 0.05
"""Length of a finger, m: what is further in front of a part is not in its way."""
BESIDE_M = 5e-4
"""How far what is around a part may stand in front of it for a finger to get there, m."""
RINGS, ANGLES = 16, 12
"""Places under a fingertip, out from its middle and around it."""
SHARES = (0.5, 0.2, 0.8)
"""Places of a part at which it is pressed, as shares of its box across its way."""


def press_ends(rest: float, lower: float, upper: float) -> tuple[float, float]:
    """Where a sprung slider rests within its limits, and the end that is further from there, to which it is pressed."""
    rest = min(max(rest, lower), upper)
    return rest, upper if upper - rest >= rest - lower else lower


def finger_depth(part: Array, around: Array, way: Array, finger_m: float, enough_m: float) -> float:
    """The way, m, along which a fingertip takes a part before it meets what is drawn under the part, which stops it
    where the part has no hole to slide in, or what is around a part that is narrower: as far as the part stands out
    there or, beside it, as deep as the tip's pad, round and ``finger_m`` across, dips into the gap if that is more.
    Where the part is pressed best, or at the first place at which it is ``enough_m``. Infinite where nothing is met,
    and where no finger comes near from its front.

    ``part`` and ``around`` are (n, 3, 3) triangles in one frame, m, and ``way`` the (3,) unit direction of the press.
    """
    across = np.linalg.svd(way[None])[2][1:]
    points = part.reshape(-1, 3) @ across.T
    turn = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
    frame = np.vstack([turn @ across, way])
    part, around = part @ frame.T, around @ frame.T
    front, radius = float(part[..., 2].min()), finger_m / 2.0
    low, high = part[..., :2].min(axis=(0, 1)), part[..., :2].max(axis=(0, 1))
    boxed = (around[..., :2].min(axis=1) <= high + radius) & (around[..., :2].max(axis=1) >= low - radius)
    around = around[boxed.all(axis=1) & (around[..., 2].max(axis=1) > front - ARM_M)]
    if not len(around):
        return math.inf
    rings = np.repeat(radius * np.arange(RINGS + 1) / RINGS, ANGLES)
    angles = np.tile(2.0 * math.pi * np.arange(ANGLES) / ANGLES, RINGS + 1)
    tip = rings[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    dips = radius - np.sqrt(np.maximum(radius**2 - rings**2, 0.0))
    best = -math.inf
    for share in ((x, y) for x in SHARES for y in SHARES):
        middle = low + np.array(share) * (high - low)
        own = first_met(part, middle + tip, front - ARM_M)
        if math.isinf(own[0]):
            continue
        met = first_met(around, middle + tip, front - ARM_M)
        out = met - own[0]
        if (out < -BESIDE_M).any():
            continue
        deep = np.where(met < own, np.maximum(out, dips), math.inf)
        best = max(best, min(float(deep.min()), float(out[0])))
        if best >= enough_m:
            break
    return math.inf if math.isinf(best) else best


def first_met(triangles: Array, places: Array, beyond: float) -> Array:
    """(k,) least z beyond a value at which a line along z through each (k, 2) place meets a triangle; else infinite."""
    low, high = triangles[..., :2].min(axis=1), triangles[..., :2].max(axis=1)
    inside = ((low[:, None] <= places) & (high[:, None] >= places)).all(axis=2)
    which, at = np.nonzero(inside)
    a, b, c = triangles[which].transpose(1, 0, 2)
    first, second, to = b[:, :2] - a[:, :2], c[:, :2] - a[:, :2], places[at] - a[:, :2]
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    flat = np.abs(area) > 1e-18  # the others stand on edge
    which, at, a, b, c = which[flat], at[flat], a[flat], b[flat], c[flat]
    first, second, to, area = first[flat], second[flat], to[flat], area[flat]
    u = (to[:, 0] * second[:, 1] - to[:, 1] * second[:, 0]) / area
    v = (first[:, 0] * to[:, 1] - first[:, 1] * to[:, 0]) / area
    z = a[:, 2] + u * (b[:, 2] - a[:, 2]) + v * (c[:, 2] - a[:, 2])
    hit = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1.0 + 1e-9) & (z > beyond)
    found = np.full(len(places), math.inf)
    np.minimum.at(found, at[hit], z[hit])
    return found
