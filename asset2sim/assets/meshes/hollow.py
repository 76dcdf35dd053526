"""Where a shape is hollow: the space within its hull that a ball from outside can reach, on a grid of cubes.

Whether a mesh is closed, wound alike or a heap of loose faces makes no difference here: a ball of a given size either
gets to a place without touching a face, or it does not. What no ball gets to counts as filled.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import ConvexHull

from asset2sim.physics.arrays import Array, box_of, boxes_of, cross, norms

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
        np.maximum(found, 0, out=found)
        np.minimum(found, np.array(self.depth.shape) - 1, out=found)
        return found

    def deepest(self, points: Array, triangles: Array) -> float:
        """The greatest depth, in cells, that the hull of (n, 3) points with (k, 3, 3) faces reaches into the hollow; 0
        where it is at most ``ALLOWED_DEPTH``."""
        return self.deepest_each([(points, triangles)])[0]

    def deepest_each(self, hulls: Sequence[tuple[Array, Array]]) -> list[float]:
        """``deepest`` of each hull, looked up together: a call for each takes twice as long.

        Space that the ball reaches is open to the outside, so a hull that fills a part of it has faces there; pockets
        with a narrow mouth may lie inside the hull, so for them its volume is examined too."""
        if not hulls:
            return []
        hull = np.repeat(np.arange(len(hulls)), [len(triangles) for _, triangles in hulls])
        cells, of = self.open_cells(np.vstack([triangles for _, triangles in hulls]), self.cell_m)
        found = np.zeros(len(hulls))
        np.maximum.at(found, hull[of], self.depth.ravel()[cells])
        depths: list[float] = found.tolist()
        if self.pockets:
            filled = (
                d <= LOOSE_DEPTHS[-1] and self.filled_m3(p) > 0.0 for d, (p, _) in zip(depths, hulls, strict=True)
            )
            depths = [OVER if inside else depth for depth, inside in zip(depths, filled, strict=True)]
        return depths

    def open_cells(self, triangles: Array, spacing: float) -> tuple[Cells, Cells]:
        """Flat indices of the cells deeper than ``ALLOWED_DEPTH`` that ``samples`` of (k, 3, 3) triangles are in, one a
        sample, and the index of its triangle. Seven in ten samples are not made, because no cell about them is deep."""
        points, of = sampled(triangles, spacing, self.may_be_open)
        flat = self.flat(self.cells(points))
        deep = self.depth.ravel()[flat] > ALLOWED_DEPTH
        return flat[deep], of[deep]

    def may_be_open(self, low: Array, high: Array) -> NDArray[np.bool_]:
        """(n,) whether any cell that meets a box, given by its (n, 3) corners, is deeper than ``ALLOWED_DEPTH``."""
        total, rounding = self.open_before, ROUNDING * self.cell_m
        steps = np.array([total.shape[1] * total.shape[2], total.shape[2], 1])
        x, y, z = (self.cells(low - rounding) * steps).T
        right, back, top = ((self.cells(high + rounding) + 1) * steps).T
        below, above = (
            total.ravel()[right + back + level]
            - total.ravel()[x + back + level]
            - total.ravel()[right + y + level]
            + total.ravel()[x + y + level]
            for level in (z, top)
        )
        return np.asarray(above > below)

    @cached_property
    def open_before(self) -> NDArray[np.int32]:
        """Cells deeper than ``ALLOWED_DEPTH`` below each index along all axes: eight numbers give those in any box."""
        total = np.zeros(np.array(self.depth.shape) + 1, dtype=np.int32)
        total[1:, 1:, 1:] = self.depth > ALLOWED_DEPTH
        for axis in range(3):
            np.cumsum(total, axis=axis, out=total)
        return total

    def flat(self, index: Cells) -> Cells:
        """(n,) places of (n, 3) cell indices in the raveled grid."""
        _, wide, deep = self.depth.shape
        found: Cells = (index[:, 0] * wide + index[:, 1]) * deep + index[:, 2]
        return found

    def at(self, points: Array) -> float:
        """The greatest depth, in cells, at (n, 3) points."""
        return float(self.depth.ravel()[self.flat(self.cells(points))].max())

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
        return float(len(np.unique(self.open_cells(triangles, self.cell_m / 2.0)[0]))) * self.cell_m**2

    def with_reachable(self, points: Array) -> "Hollow":
        """The hollow with the cells of these (n, 3) points added, where they are reachable from outside. Points in the
        faces' own cells or in a closed solid add nothing: no cut of the shape would free them."""
        inner = np.all((points >= self.low) & (points < self.low + self.cell_m * np.array(self.depth.shape)), axis=1)
        place = np.unravel_index(np.unique(self.flat(self.cells(points[inner]))), self.depth.shape)
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
ROUNDING = 1e-6
"""By how much boxes are made larger for rounding, in cells: a sample never lies outside of its triangle's box."""


def grid_over(triangles: Array, radius: float) -> tuple[Hollow, float]:
    """A grid over (k, 3, 3) triangles, nothing hollow yet, for a ball of ``radius`` (m), and that in cells."""
    low, high = box_of(triangles.reshape(-1, 3))
    cell = radius / CELLS_A_RADIUS
    size = high - low + 2.0 * radius + 2.0 * OUTER_CELLS * cell
    cell *= max(1.0, float((size / cell).prod() / MOST_CELLS) ** (1.0 / 3.0))
    reach = max(radius / cell, 1.0)
    margin = cell * (reach + OUTER_CELLS)
    nothing = np.zeros(np.ceil((high - low + 2 * margin) / cell).astype(int) + 1, np.float32)
    return Hollow(low - margin, cell, nothing, nothing), reach


def hollow_of(triangles: Array, radius: float) -> Hollow:
    """The hollow of (k, 3, 3) triangles for a ball of ``radius`` (m)."""
    grid, reach = grid_over(triangles, radius)
    empty = np.ones(grid.depth.shape, dtype=bool)
    index = grid.cells(samples(triangles, grid.cell_m / 2.0))
    empty[index[:, 0], index[:, 1], index[:, 2]] = False
    distance = ndimage.distance_transform_edt(empty).astype(np.float32)
    centres = _from_outside(distance >= reach)
    swept = ndimage.binary_dilation(centres, DILATION) if reach > 1.5 else centres
    none = np.float32(0.0)
    depth = np.where(swept, distance, none)
    # The middle of a gap that is hardly wider than the ball must stay free under the loosest bound too.
    middle = centres & (distance <= LOOSE_DEPTHS[-1]) & (distance >= ndimage.maximum_filter(distance, 3))
    depth[middle] = OVER
    return Hollow(grid.low, grid.cell_m, depth, np.where(_from_outside(empty), distance, none))


def _from_outside(free: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The cells that a path through free cells joins to the grid's corner, which is free."""
    label, _ = ndimage.label(free)
    return np.asarray(label == label[0, 0, 0])


def samples(triangles: Array, spacing: float) -> Array:
    """(n, 3) points on (k, 3, 3) triangles, at most ``spacing`` apart along the longest edge and across it."""
    return sampled(triangles, spacing)[0]


def sampled(
    triangles: Array, spacing: float, wanted: Callable[[Array, Array], NDArray[np.bool_]] | None = None
) -> tuple[Array, Cells]:
    """``samples`` of triangles, and (n,) the index of each one's triangle. Rows of samples are left out whose box is
    not ``wanted``, which gets the (m, 3) lowest and highest corners."""
    lengths = np.array([norms(triangles[:, corner - 2] - triangles[:, corner]) for corner in range(3)])
    large = lengths.max(axis=0) > spacing
    keep = large if wanted is None else large & wanted(*boxes_of(triangles))
    known = np.zeros((0, 3)) if large.all() else triangles.reshape(-1, 3)
    known_of = np.repeat(np.arange(len(triangles)), 3)[: len(known)]
    kept = np.flatnonzero(keep)
    if not len(kept):
        return known, known_of
    triangles, lengths = triangles[kept], lengths[:, kept]
    each = np.arange(len(triangles))
    longest = lengths.argmax(axis=0)
    a, b, c = (triangles[each, (longest + turn) % 3] for turn in range(3))
    length = lengths[longest, each]
    height = norms(cross(b - a, c - a)) / np.maximum(length, 1e-30)
    along = np.maximum(np.ceil(length / spacing), 1.0).astype(np.int64) + 1
    across = np.maximum(np.ceil(height / spacing), 1.0).astype(np.int64) + 1
    # A row an axis from here on: NumPy takes three times as long for rows of three.
    a, b, c = (np.ascontiguousarray(corner.T) for corner in (a, b, c))
    of = np.repeat(each, across)
    v = ranges_of_counts(across) / (across[of] - 1)
    if wanted is not None:
        first, last = (end.take(of, axis=1) + v * (c - end).take(of, axis=1) for end in (a, b))
        rows = wanted(np.minimum(first, last).T, np.maximum(first, last).T)
        of, v = of[rows], v[rows]
    count = along[of]
    u = ranges_of_counts(count) / np.repeat(count - 1, count)
    of, v = np.repeat(of, count), np.repeat(v, count)
    base = a.take(of, axis=1) + u * (b - a).take(of, axis=1)
    points = base + v * (c.take(of, axis=1) - base)
    return np.concatenate([known.T, points], axis=1).T, np.concatenate([known_of, kept[of]])


def ranges_of_counts(counts: Cells) -> Cells:
    """0, 1, … of each count, one after the other."""
    return np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
