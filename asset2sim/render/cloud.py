"""An object as coloured points, as dense as its pictures need them: what the loops are drawn from."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asset2sim.assets.surfaces.surface import Floats, Ints
from asset2sim.render.faces import Faces, painted_points, smooth_normals, values_at
from asset2sim.render.raster import expanded_counts
from asset2sim.render.renderer import INVISIBLE, SHEEN
from asset2sim.render.zbuffer import Bools, Lens, Singles, Words, seen_in

Bytes = NDArray[np.uint8]

COARSE = 4
"""Edge of a cell in spacings: whether a cell is seen is found out by one point of it."""
SLACK = 0.7
"""How far behind what is seen a cell still counts as seen, in its edges: cells on slopes are at several depths."""
OPAQUE = 0.95
"""Opacity from which a point is opaque."""
STRETCH = 0.3
"""By how many spacings the points of a cell may be too few: most cells are of triangles of few points."""
PERSPECTIVE = 0.15
"""By how much more of a surface's edge may be seen than a parallel view from the middle of the picture shows."""
MOST_CELLS = 400_000
"""Cells of an object, about; beyond it they, and the points, are set further apart."""
MOST_POINTS = 360_000
"""Points of an object, about: each costs 20 ns a frame."""
THICKER = 0.35
"""How far every surface is moved outwards, in spacings: the far side of a thin plate else speckles the near one."""
LIFT_POINTS = 1.0
"""How far the smallest flat surface is lifted off what it lies on, in spacings: the nearest point of a pixel wins, and
two layers closer than that would speckle."""


@dataclass(frozen=True, eq=False)
class Cloud:
    """Points of an object's surfaces. ``points`` (3, n) float32, in the frame of their triangles, m; ``facing`` (n,)
    int32, the number of each one's normal in ``DIRECTIONS``, plus as many times its link's number; ``colors`` (n, 4)
    uint8, RGBA. Those of ``links[i]`` are ``starts[i]`` to ``starts[i + 1]``. ``spacing_m`` is the distance between
    neighbours at most, m."""

    points: Singles
    facing: Words
    colors: Bytes
    spacing_m: float
    links: tuple[str, ...]
    starts: tuple[int, ...]
    glass: "Cloud | None" = None
    """The translucent points, if there are any; they are not among the others."""


@dataclass(frozen=True, eq=False)
class Cells:
    """Triangles cut into rows along their longest edge (``base``, the number of its first corner), and these into
    cells; (n,) each: the ``face``, its ``row`` of ``rows`` and ``column`` of ``columns``, and the cell's ``width`` and
    ``height``, m."""

    face: Ints
    base: Ints
    row: Ints
    rows: Ints
    column: Ints
    columns: Ints
    width: Floats
    height: Floats

    def pick(self, chosen: Bools | Ints) -> "Cells":
        """These of the cells."""
        return Cells(*(array[chosen] for array in vars(self).values()))

    def weights(self, across: Floats, upwards: Floats) -> Singles:
        """(n, 3) weights of the faces' corners at a point of each cell, shares of its width and height."""
        up = (self.row + upwards) / self.rows
        along = (1.0 - up) * (self.column + across) / self.columns
        found = np.empty((len(up), 3), dtype=np.float32)
        place = np.arange(len(up))
        found[place, self.base] = 1.0 - up - along
        found[place, (self.base + 1) % 3] = along
        found[place, (self.base + 2) % 3] = up
        return found


def cells_of(corners: Floats, edge: float) -> Cells:
    """(m, 3, 3) triangles cut into cells whose edges are no longer than ``edge``, m."""
    edges = corners[:, [1, 2, 0]] - corners
    lengths = np.linalg.norm(edges, axis=2)
    base = lengths.argmax(axis=1)
    length = lengths[np.arange(len(corners)), base]
    double_area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    height = double_area / np.maximum(length, 1e-30)
    rows = np.maximum(1, np.ceil(height / edge)).astype(np.int64)
    if len(corners) > MOST_CELLS:
        # Most triangles are far smaller than a pixel then: as many as their area asks for are enough.
        due = np.floor(np.cumsum(double_area / edge**2))
        rows[(rows == 1) & (length < edge) & (np.diff(due, prepend=0.0) == 0.0)] = 0
    face, row = expanded_counts(rows)
    wide = length[face] * (1.0 - row / rows[face])
    columns = np.maximum(1, np.ceil(wide / edge)).astype(np.int64)
    line, column = expanded_counts(columns)
    face = face[line]
    sizes = (wide / columns)[line], (height[face] / rows[face])
    return Cells(face, base[face], row[line], rows[face], column, columns[line], *sizes)


def starts_of(link: Ints, links: Sequence[str]) -> tuple[int, ...]:
    """Where the points of each link start among those of sorted links, and the number of all."""
    return tuple(np.searchsorted(link, np.arange(len(links) + 1)).tolist())


def cloud_of(
    faces: Faces, spacing: float, views: Sequence[tuple[Singles, Lens]], most_points: int = MOST_POINTS
) -> Cloud:
    """The points, ``spacing`` m apart, that are seen in any of these views, (links, 3, 4) transforms to a world in
    which the object is one unit long, and a lens; and their surroundings. About ``most_points``, or they are set
    further apart."""
    area = 0.5 * float(np.linalg.norm(np.cross(*np.moveaxis(np.diff(faces.corners, axis=1), 1, 0)), axis=1).sum())
    edge = max(COARSE * spacing, (area / MOST_CELLS) ** 0.5)
    cells = cells_of(faces.corners, edge)
    middle = np.full(len(cells.face), 0.5)
    centers = values_at(cells.weights(middle, middle), faces.corners.astype(np.float32), cells.face).T
    starts = starts_of(faces.link[cells.face], faces.links)
    slack = SLACK * edge / faces.size_m
    seen = np.zeros(len(cells.face), dtype=bool)
    for motion, lens in views:
        seen |= seen_in(centers, starts, motion, lens.shrunk(COARSE), slack)
    cells = cells.pick(seen)
    spacing = edge / COARSE
    sides = [
        side * share for side, share in zip((cells.width, cells.height), seen_shares(faces, cells, views), strict=True)
    ]
    across, upwards = point_counts(sides, spacing)
    for _ in range(2):  # rounding up leaves too many the first time
        spacing *= max(1.0, float(across @ upwards) / most_points) ** 0.5
        across, upwards = point_counts(sides, spacing)
    cell, place = expanded_counts(across * upwards)
    fine = cells.pick(cell)
    weights = fine.weights((place % across[cell] + 0.5) / across[cell], (place // across[cell] + 0.5) / upwards[cell])
    face = fine.face
    points = values_at(weights, faces.corners.astype(np.float32), face)
    points += (spacing * (THICKER + LIFT_POINTS * faces.lift[face]))[:, None].astype(np.float32) * faces.flat[face]
    colors = painted_points(faces, face, weights)
    seen = colors[:, 3] >= INVISIBLE
    # An exporter that writes an opacity of zero everywhere did not mean an invisible object.
    if not seen.any():
        seen[:], colors[:, 3] = True, 1.0
    colors[:, :3] = SHEEN + (1.0 - SHEEN) * colors[:, :3]
    link, opaque = faces.link[face], colors[:, 3] >= OPAQUE
    facing = (link * len(DIRECTIONS) + direction_of(smooth_normals(faces, face, weights))).astype(np.int32)
    shades = (255.0 * colors + 0.5).astype(np.uint8)

    def part(chosen: Bools, glass: Cloud | None) -> Cloud:
        starts = starts_of(link[chosen], faces.links)
        places = np.ascontiguousarray(points[chosen].T)
        return Cloud(places, facing[chosen], shades[chosen], spacing, faces.links, starts, glass)

    translucent = seen & ~opaque
    return part(seen & opaque, part(translucent, None) if translucent.any() else None)


def point_counts(sides: Sequence[Floats], spacing: float) -> tuple[Ints, Ints]:
    """How many points each cell has along its width and its height."""
    across, upwards = (np.maximum(1, np.ceil(side / spacing - STRETCH)).astype(np.int64) for side in sides)
    return across, upwards


def seen_shares(faces: Faces, cells: Cells, views: Sequence[tuple[Singles, Lens]]) -> tuple[Singles, Singles]:
    """Of each cell's width and height, the share that is seen at most in any of the views: what is seen at a slant
    needs fewer points."""
    number = np.arange(len(faces.corners))
    base = np.zeros(len(number), dtype=np.int64)
    base[cells.face] = cells.base
    wide = faces.corners[number, (base + 1) % 3] - faces.corners[number, base]
    wide /= np.maximum(np.linalg.norm(wide, axis=1, keepdims=True), 1e-30)
    sides = wide, np.cross(faces.flat, wide)
    most = [np.zeros(len(number)) for _ in sides]
    bounds = np.searchsorted(faces.link, np.arange(len(faces.links) + 1))
    for link in range(len(faces.links)):
        turns = np.array([motion[link, :, :3].T @ lens.towards for motion, lens in views]).reshape(-1, 3)
        turns = np.unique(np.round(turns / np.maximum(np.linalg.norm(turns, axis=1, keepdims=True), 1e-9), 2), axis=0)
        part = slice(bounds[link], bounds[link + 1])
        for towards in turns:
            for side, share in zip(sides, most, strict=True):
                seen = np.sqrt(np.maximum(1.0 - (side[part] @ towards) ** 2, 0.0))
                np.maximum(share[part], seen, out=share[part])
    # Perspective, and the views between these, see it less at a slant.
    wider, higher = (np.minimum(share + PERSPECTIVE, 1.0).astype(np.float32)[cells.face] for share in most)
    return wider, higher


def direction_of(normals: Singles) -> Words:
    """(n,) the numbers in ``DIRECTIONS`` of (n, 3) unit vectors, of which a vector and its opposite are the same."""
    upward = normals * np.where(normals[:, 2:] < 0.0, -1.0, 1.0)
    flat = upward[:, :2] / np.maximum(np.abs(upward).sum(axis=1, keepdims=True), 1e-12)
    across, along = np.minimum(((flat + 1.0) * (0.5 * STEPS)).astype(np.int32), STEPS - 1).T
    found: Words = across * STEPS + along
    return found


def octahedron() -> Singles:
    """(STEPS², 3) unit vectors of the upper half of an octahedron, in squares."""
    x, y = ((np.indices((STEPS, STEPS)).reshape(2, -1) + 0.5) * (2.0 / STEPS) - 1.0).astype(np.float32)
    found = np.stack([x, y, np.maximum(1.0 - np.abs(x) - np.abs(y), 0.0)], axis=1)
    unit: Singles = found / np.linalg.norm(found, axis=1, keepdims=True)
    return unit


STEPS = 48
DIRECTIONS = octahedron()


def merged_clouds(clouds: Sequence[Cloud]) -> Cloud:
    """Several clouds as one, whose links are those of all, in their order; ``spacing_m`` is that of the coarsest."""
    links: tuple[str, ...] = ()
    starts: tuple[int, ...] = (0,)
    facing: list[Words] = []
    for cloud in clouds:
        facing.append(cloud.facing + np.int32(len(links) * len(DIRECTIONS)))
        links += cloud.links
        starts += tuple(starts[-1] + start for start in cloud.starts[1:])
    points = np.concatenate([cloud.points for cloud in clouds], axis=1)
    colors, spacing = np.concatenate([cloud.colors for cloud in clouds]), max(cloud.spacing_m for cloud in clouds)
    glass = None
    if any(cloud.glass is not None for cloud in clouds):
        glass = merged_clouds([cloud.glass or empty_like(cloud) for cloud in clouds])
    return Cloud(points, np.concatenate(facing), colors, spacing, links, starts, glass)


def empty_like(cloud: Cloud) -> Cloud:
    """A cloud of the same links without a point."""
    none, starts = cloud.facing[:0], (0,) * len(cloud.starts)
    return Cloud(cloud.points[:, :0], none, cloud.colors[:0], cloud.spacing_m, cloud.links, starts)
