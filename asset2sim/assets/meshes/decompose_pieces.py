"""Convex pieces: clipped to a hull, and merged where there are too many."""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

from asset2sim.assets.meshes.hull import hull_volume
from asset2sim.physics.arrays import Array

TOLERANCE = 1e-7
"""How far over a hull's plane a point still lies on it, over the hull's extent: rounding that no engine sees."""
SLIVER = 1e-9
"""Volume over the cube of a piece's extent below which it is flat: no engine makes a body of it."""
MOST_PAIRED = 64
"""Pieces above which the smallest are left out before merging: pairs cost hulls, and slivers hold no contact."""


def clip(piece: Array, hull: ConvexHull) -> Array | None:
    """The hull vertices of the part of a convex piece within ``hull``; None where that is flat or empty."""
    if len(piece) < 4 or not np.isfinite(piece).all():
        return None
    own = _hull(piece)
    if own is None:
        return None
    extent = float(np.ptp(hull.points, axis=0).max())
    over = (piece @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=0)
    planes = hull.equations[over > TOLERANCE * extent]
    if not len(planes):
        return piece[own.vertices]
    # The intersection of half-spaces needs a point well inside all of them: the centre of the largest ball that fits.
    spaces = np.vstack([own.equations, planes])
    centre = _centre(spaces)
    if centre is None:
        return None
    try:
        points = HalfspaceIntersection(spaces, centre).intersections
    except (QhullError, ValueError):
        return None
    points = points[np.isfinite(points).all(axis=1)]
    inside = _hull(points)
    return None if inside is None else points[inside.vertices]


def _hull(points: Array) -> ConvexHull | None:
    """The hull of (k, 3) points, or None where they are flat, by a far smaller bound than ``hull_of`` has."""
    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError):
        return None
    return hull if hull.volume > SLIVER * float(np.ptp(points, axis=0).max()) ** 3 else None


def _centre(spaces: Array) -> Array | None:
    norms = np.linalg.norm(spaces[:, :3], axis=1)
    answer = linprog(
        [0.0, 0.0, 0.0, -1.0],
        A_ub=np.column_stack([spaces[:, :3], norms]),
        b_ub=-spaces[:, 3],
        bounds=[*[(None, None)] * 3, (0.0, None)],
    )
    if answer.status != 0 or answer.x is None or answer.x[3] <= 0.0:
        return None
    return np.asarray(answer.x[:3])


def merge(pieces: Sequence[Array], most: int) -> list[Array]:
    """At most ``most`` convex pieces: the two whose common hull adds the least volume become one, again and again."""
    kept = sorted(pieces, key=hull_volume, reverse=True)[:MOST_PAIRED]
    volumes = [hull_volume(piece) for piece in kept]
    alive = list(range(len(kept)))
    if len(alive) <= most:
        return kept
    added: dict[tuple[int, int], float] = {}

    def price(a: int, b: int) -> None:
        both = np.vstack([kept[a], kept[b]])
        # A hull takes milliseconds. Pieces whose boxes are apart are bad partners: their common box says so.
        joint = hull_volume(both) if _boxes_touch(kept[a], kept[b]) else float(np.ptp(both, axis=0).prod())
        added[(a, b)] = joint - volumes[a] - volumes[b]

    for place, a in enumerate(alive):
        for b in alive[place + 1 :]:
            price(a, b)
    while len(alive) > most:
        a, b = min(added, key=lambda pair: (added[pair], pair))
        both = np.vstack([kept[a], kept[b]])
        kept.append(both[ConvexHull(both).vertices])
        volumes.append(hull_volume(kept[-1]))
        alive = [index for index in alive if index not in (a, b)]
        for pair in [pair for pair in added if a in pair or b in pair]:
            del added[pair]
        for index in alive:
            price(index, len(kept) - 1)
        alive.append(len(kept) - 1)
    return [kept[index] for index in alive]


def _boxes_touch(a: Array, b: Array) -> bool:
    """Whether the boxes of two point sets meet, give or take a hundredth of the smaller one."""
    margin = 0.01 * min(float(np.ptp(a, axis=0).max()), float(np.ptp(b, axis=0).max()))
    return bool((a.min(axis=0) <= b.max(axis=0) + margin).all() and (b.min(axis=0) <= a.max(axis=0) + margin).all())
