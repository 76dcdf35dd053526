"""Where a shape is hollow: the space within its hull that a ball from outside can reach, on a grid of cubes.

Whether a mesh is closed, wound alike or a heap of loose faces makes no difference here: a ball of a given size either
gets to a place without touching a face, or it does not. What no ball gets to counts as filled.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import ConvexHull

from asset2sim.physics.arrays import Array

Cells = NDArray[np.int64]

MOST_CELLS = 1_500_000
"""Most cells of one grid, which takes 0.1 s per million; beyond it cells are made larger."""
CELLS_A_RADIUS = 2.0
"""Cells along the ball's radius: with fewer, a wall is as thick as what it encloses."""
DILATION = ndimage.generate_binary_structure(3, 2)
"""Neighbours within 1.5 cells, by which the ball's centres are dilated: two cells' radius half covers those beyond."""
OUTER_CELLS = 3
"""Cells around the shape beyond the ball's radius, so that the ball starts outside of it."""


@dataclass(frozen=True)
class Hollow:
    """A grid over one shape: its (3,) lowest corner and the edge of its cells (m), and at each cell a depth.

    ``depth`` is the distance to the nearest face, in cells, where the ball or another body can be, and 0 elsewhere:
    how far something that fills this cell stands out of the shape. ``gap`` is the same for a ball of no size.
    ``pockets`` says that other bodies are where no ball gets to.
    """

    low: Array
    cell_m: float
    depth: NDArray[np.float32]
    gap: NDArray[np.float32]
    pockets: bool = False

    def cells(self, points: Array) -> Cells:
        """(n, 3) indices of the cells of (n, 3) points; those outside the grid fall into its border."""
        found: Cells = np.floor((points - self.low) / self.cell_m).astype(np.int64)
        return np.clip(found, 0, np.array(self.depth.shape) - 1)

    def deepest(self, points: Array, triangles: Array) -> float:
        """The greatest depth, in cells, that the hull of (n, 3) points with (k, 3, 3) faces reaches into the hollow.
        Space that the ball reaches is open to the outside, so a hull that fills a part of it has faces there; pockets
        with a narrow mouth may lie inside the hull, so for them its volume is examined too."""
        depth = self.at(samples(triangles, self.cell_m))
        if self.pockets and depth <= LOOSE_DEPTHS[-1] and self.filled_m3(points) > 0.0:
            return OVER
        return depth

    def at(self, points: Array) -> float:
        """The greatest depth, in cells, at (n, 3) points."""
        index = self.cells(points)
        return float(self.depth[index[:, 0], index[:, 1], index[:, 2]].max())

    def filled_m3(self, piece: Array) -> float:
        """Volume of the hollow that the hull of (k, 3) points takes up, m³, its outermost cells left out."""
        low, high = self.cells(np.array([piece.min(axis=0), piece.max(axis=0)]))
        block = self.depth[low[0] : high[0] + 1, low[1] : high[1] + 1, low[2] : high[2] + 1] > ALLOWED_DEPTH
        if not block.any():
            return 0.0
        # The hull is an interval of every column of cells: planes are met once a column, not once a cell.
        x, y, z = (
            (np.arange(n) + first + 0.5) * self.cell_m + at
            for n, first, at in zip(block.shape, low, self.low, strict=True)
        )
        planes = np.unique(np.round(ConvexHull(piece).equations, 9), axis=0)
        bottom, top = np.full((len(x), len(y)), -np.inf), np.full((len(x), len(y)), np.inf)
        for a, b, c, d in planes:
            rest = (a * x)[:, None] + (b * y)[None] + d
            if c > LEVEL:
                np.minimum(top, -rest / c, out=top)
            elif c < -LEVEL:
                np.maximum(bottom, -rest / c, out=bottom)
            else:
                top[rest > 0.0] = -np.inf
        first, end = np.searchsorted(z, bottom), np.searchsorted(z, top, side="right")
        count = np.zeros((*block.shape[:2], block.shape[2] + 1), dtype=np.int64)
        np.cumsum(block, axis=2, out=count[:, :, 1:])
        below, within = (np.take_along_axis(count, i[:, :, None], 2) for i in (first, np.maximum(end, first)))
        return float((within - below).sum()) * self.cell_m**3

    def opened_m2(self, triangles: Array) -> float:
        """Area of a plate with these (k, 3, 3) faces that lies in the hollow, m²; its two sides count once."""
        index = np.unique(self.cells(samples(triangles, self.cell_m / 2.0)), axis=0)
        return float((self.depth[index[:, 0], index[:, 1], index[:, 2]] > ALLOWED_DEPTH).sum()) * self.cell_m**2

    def with_reachable(self, points: Array) -> "Hollow":
        """The hollow with the cells of these (n, 3) points added, where they are reachable from outside. Points in the
        faces' own cells or in a closed solid add nothing: no cut of the shape would free them."""
        inner = np.all((points >= self.low) & (points < self.low + self.cell_m * np.array(self.depth.shape)), axis=1)
        index = np.unique(self.cells(points[inner]), axis=0)
        place = (index[:, 0], index[:, 1], index[:, 2])
        gap = self.gap[place]
        if not (gap > np.maximum(self.depth[place], ALLOWED_DEPTH)).any():
            return self
        depth = self.depth.copy()
        depth[place] = np.maximum(depth[place], np.where(gap > ALLOWED_DEPTH, gap, np.float32(0.0)))
        return Hollow(self.low, self.cell_m, depth, self.gap, True)


LEVEL = 1e-9
"""Upright part of a plane's unit normal below which it bounds no column of cells from above or below."""
ALLOWED_DEPTH = 1.5
"""Depth in cells up to which a piece may fill the hollow: 1.9 % of an object of which the ball is 5 %, as CoACD's
default concavity of 0.05 of half the extent."""
LOOSE_DEPTHS = (2.5, 4.0)
"""Looser bounds of the depth, in cells, tried in this order where there would be too many pieces."""
OVER = 1e6
"""A depth that is never allowed."""


def hollow_of(triangles: Array, radius: float) -> Hollow:
    """The hollow of (k, 3, 3) triangles for a ball of ``radius`` (m)."""
    low, high = triangles.reshape(-1, 3).min(axis=0), triangles.reshape(-1, 3).max(axis=0)
    cell = radius / CELLS_A_RADIUS
    size = high - low + 2.0 * radius + 2.0 * OUTER_CELLS * cell
    cell *= max(1.0, float((size / cell).prod() / MOST_CELLS) ** (1.0 / 3.0))
    reach = max(radius / cell, 1.0)
    margin = cell * (reach + OUTER_CELLS)
    nothing = np.zeros(np.ceil((high - low + 2 * margin) / cell).astype(int) + 1, np.float32)
    grid = Hollow(low - margin, cell, nothing, nothing)
    empty = np.ones(grid.depth.shape, dtype=bool)
    index = grid.cells(samples(triangles, cell / 2.0))
    empty[index[:, 0], index[:, 1], index[:, 2]] = False
    distance = ndimage.distance_transform_edt(empty).astype(np.float32)
    centres = _from_outside(distance >= reach)
    swept = ndimage.binary_dilation(centres, DILATION) if reach > 1.5 else centres
    none = np.float32(0.0)
    depth = np.where(swept, distance, none)
    # The middle of a gap that is hardly wider than the ball must stay free under the loosest bound too.
    middle = centres & (distance <= LOOSE_DEPTHS[-1]) & (distance >= ndimage.maximum_filter(distance, 3))
    depth[middle] = OVER
    return Hollow(grid.low, cell, depth, np.where(_from_outside(empty), distance, none))


def _from_outside(free: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The cells that a path through free cells joins to the grid's corner, which is free."""
    label, _ = ndimage.label(free)
    return np.asarray(label == label[0, 0, 0])


def samples(triangles: Array, spacing: float) -> Array:
    """(n, 3) points on (k, 3, 3) triangles, at most ``spacing`` apart along the longest edge and across it."""
    corners = triangles.reshape(-1, 3)
    lengths = np.linalg.norm(np.roll(triangles, -1, axis=1) - triangles, axis=2)
    large = lengths.max(axis=1) > spacing
    if not large.all():
        triangles, lengths = triangles[large], lengths[large]
    if not len(triangles):
        return corners
    each = np.arange(len(triangles))
    longest = lengths.argmax(axis=1)
    a, b, c = (triangles[each, (longest + turn) % 3] for turn in range(3))
    length = lengths[each, longest]
    height = np.linalg.norm(np.cross(b - a, c - a), axis=1) / np.maximum(length, 1e-30)
    along = np.maximum(np.ceil(length / spacing), 1.0).astype(np.int64) + 1
    across = np.maximum(np.ceil(height / spacing), 1.0).astype(np.int64) + 1
    count = along * across
    of = np.repeat(each, count)
    number = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    u = (number % along[of]) / (along[of] - 1)
    v = (number // along[of]) / (across[of] - 1)
    base = a[of] + u[:, None] * (b - a)[of]
    points: Array = base + v[:, None] * (c[of] - base)
    return points if large.all() else np.vstack([corners, points])
