"""Pieces cut down to the flat floors that are seen where they cover them: else a floor leans, and a ball rolls out.

Authored collision meshes and hulls over rounded corners stand a little into the hollow (``hollow.ALLOWED_DEPTH``): on a
microwave's floor 7 mm here and 4 mm there. What is above a floor and is not seen there is taken off by its plane.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from asset2sim.assets.meshes.hollow import ALLOWED_DEPTH, samples
from asset2sim.assets.meshes.patches import PatchPiece, piece_of
from asset2sim.physics.arrays import Array, boxes_of

UPRIGHT = 0.985
"""Least upward part of a floor's unit normal: it leans by at most 10°."""
BALLS, MOST_FLOORS = 4.0, 12
"""Least area of a floor, over the ball's cross-section, and the floors of a link that are looked at, the largest."""
CELLS = ALLOWED_DEPTH + 1.0
"""Most that a piece may stand above a floor to be cut, in cells: what the hollow's grid lets pass."""
LEAST_CELLS = 0.05
"""... and the least, in cells: below it, nothing rolls."""
LOST = 0.5
"""Most surface of the mesh that a cut takes off, over the floor that it lays free: else it was a rim or a plate."""


ROUNDING_M = 1e-9
"""By how much a triangle's box is made larger for rounding, m."""
PLANES_AT_ONCE = 12
"""Planes that points are compared with at once."""
PLACES = 120
"""Places of a floor at which it is looked whether a piece covers it, about."""


@dataclass(frozen=True)
class Floor:
    """A flat floor: its upward unit normal, its height along it (m), and (n, 3) places on it, each for ``each_m2``."""

    normal: Array
    height: float
    places: Array
    each_m2: float


def flat_floors(triangles: Array, up: Array, radius: float) -> list[Floor]:
    """The flat floors of (k, 3, 3) triangles on which a ball of ``radius`` (m) may lie, the largest first."""
    crossed = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    doubled = np.linalg.norm(crossed, axis=1)
    normals = crossed / np.maximum(doubled, 1e-30)[:, None]
    normals *= np.where(normals @ up < 0.0, -1.0, 1.0)[:, None]  # meshes need not be wound alike
    level = np.flatnonzero((normals @ up > UPRIGHT) & (doubled > 0.0))
    if not len(level):
        return []
    heights = np.einsum("ij,ij->i", normals[level], triangles[level].mean(axis=1))
    keys = np.column_stack([np.round(normals[level] / 0.01), np.round(heights / (0.05 * radius))])
    _, of = np.unique(keys, axis=0, return_inverse=True)
    areas = np.bincount(of.ravel(), doubled[level] / 2.0)
    found = []
    for number in np.argsort(-areas)[:MOST_FLOORS]:
        if areas[number] < BALLS * np.pi * radius**2:
            break
        own = level[of.ravel() == number]
        normal = np.average(normals[own], axis=0, weights=doubled[own])
        normal /= np.linalg.norm(normal)
        spacing = float(np.sqrt(areas[number] / PLACES))
        places = samples(triangles[own], spacing)
        _, first = np.unique(np.floor(places / spacing).astype(int), axis=0, return_index=True)
        places = places[first]
        found.append(Floor(normal, float((places @ normal).max()), places, spacing**2))
    return found


def cut_at_floors(
    pieces: Sequence[PatchPiece], triangles: Array, up: Array, radius: float, cell_m: float, thickness: float
) -> list[PatchPiece]:
    """A link's pieces, cut at flat floors that are seen of it with nothing seen above, where they lie over one; (k, 3,
    3) triangles, ``up`` a (3,) direction in its frame, ``thickness`` that of sheets, m."""
    known, floors = list(pieces), flat_floors(triangles, up, radius)
    planes = [ConvexHull(piece.points).equations for piece in pieces] if floors else []
    for floor in floors:
        levels = triangles @ floor.normal - floor.height
        low = LEAST_CELLS * cell_m
        over = triangles[(levels.max(axis=1) > low) & (levels.min(axis=1) < CELLS * cell_m)]
        free: Array | None = None
        for index, piece in enumerate(known):
            heights = piece.points @ floor.normal - floor.height
            if not low < heights.max() <= CELLS * cell_m or heights.min() > -thickness:
                continue
            covered = inside_planes(planes[index], floor.places + low * floor.normal)
            if covered.sum() * floor.each_m2 < np.pi * radius**2:
                continue
            free = free_above(floor, over) if free is None else free
            area = float((covered & (free > heights.max())).sum()) * floor.each_m2
            if area < np.pi * radius**2 or lost_m2(index, planes, piece, floor, over, low) > LOST * area:
                continue
            known[index] = part_below(piece, floor, thickness)
            planes[index] = ConvexHull(known[index].points).equations
    return known


def inside_planes(planes: Array, points: Array) -> NDArray[np.bool_]:
    """(n,) whether points lie in the hull of these (k, 4) planes, to a micrometre."""
    left = np.arange(len(points))
    for start in range(0, len(planes), PLANES_AT_ONCE):  # the first few leave out most of what is outside
        some = planes[start : start + PLANES_AT_ONCE]
        left = left[(points[left] @ some[:, :3].T + some[:, 3] <= 1e-6).all(axis=1)]
    inside = np.zeros(len(points), dtype=np.bool_)
    inside[left] = True
    return inside


def lost_m2(index: int, planes: Sequence[Array], piece: PatchPiece, floor: Floor, over: Array, low: float) -> float:
    """Area of the (k, 3, 3) triangles ``over`` a floor that lies in a piece, higher than ``low``, and in no other."""
    spacing = float(np.sqrt(floor.each_m2)) / 2.0
    lowest, highest = boxes_of(over)
    near = (highest >= piece.low).all(axis=1) & (lowest <= piece.high).all(axis=1)
    points = samples(over[near], spacing)
    points = points[((points >= piece.low) & (points <= piece.high)).all(axis=1)]
    points = points[points @ floor.normal - floor.height > low]
    cells = np.floor((points - piece.low) / spacing).astype(np.int64) @ [1, 1 << 20, 1 << 40]
    points = points[np.unique(cells, return_index=True)[1]]
    points = points[inside_planes(planes[index], points)]
    for number, other in enumerate(planes):
        if number != index and len(points):
            points = points[~inside_planes(other, points)]
    return len(points) * spacing**2


def free_above(floor: Floor, over: Array) -> Array:
    """(n,) height over each place of a floor, m, at which a triangle ``over`` it begins; infinite for none."""
    first, second = np.linalg.svd(floor.normal[None])[2][1:]
    flat = np.stack([over @ first, over @ second], axis=-1)
    edges = np.roll(flat, -1, axis=1) - flat
    area = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
    sound = np.abs(area) > 1e-12 * np.abs(edges).max(initial=1e-6) ** 2
    flat, edges, area = flat[sound], edges[sound], area[sound]
    levels = np.roll(over[sound] @ floor.normal, -2, axis=1) - floor.height  # side i is opposite to corner i + 2
    found = np.full(len(floor.places), np.inf)
    (left, front), (right, back) = flat.min(axis=1).T - ROUNDING_M, flat.max(axis=1).T + ROUNDING_M
    for index, place in enumerate(floor.places):
        x, y = place @ first, place @ second
        near = np.flatnonzero((left <= x) & (x <= right) & (front <= y) & (y <= back))
        off = np.array([x, y]) - flat[near]
        shares = (edges[near, :, 0] * off[..., 1] - edges[near, :, 1] * off[..., 0]) / area[near, None]
        met = (shares >= 0.0).all(axis=1)
        heights = (shares[met] * levels[near[met]]).sum(axis=1)
        found[index] = heights[heights > 1e-6].min(initial=np.inf)
    return found


def part_below(piece: PatchPiece, floor: Floor, thickness: float) -> PatchPiece:
    """The part of a piece that is below a floor's plane."""
    over = piece.triangles @ floor.normal - floor.height
    first, last = piece.triangles.reshape(-1, 3), np.roll(piece.triangles, -1, axis=1).reshape(-1, 3)
    start, end = over.ravel(), np.roll(over, -1, axis=1).ravel()
    crosses = start * end < 0.0
    share = (start[crosses] / (start[crosses] - end[crosses]))[:, None]
    met = first[crosses] + share * (last[crosses] - first[crosses])
    kept = piece.points[piece.points @ floor.normal <= floor.height]
    return piece_of(np.vstack([kept, met]), thickness)
