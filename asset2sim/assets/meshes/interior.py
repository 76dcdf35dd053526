"""The interior of a link's visual meshes: where a ball from outside lies walled in over its own floor.

Meshes need not be closed or wound alike: all is decided on a grid of cubes, as ``hollow`` does.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from asset2sim.assets.meshes.hollow import CELLS_A_RADIUS, OUTER_CELLS, samples
from asset2sim.physics.arrays import Array, box_of, boxes_of

Grid = NDArray[np.bool_]
SIDES, RAILS = 5, 4
"""How many of the six axis directions must meet walls; downwards must be one of them, and the link's own. And how many
beside it, where the link turns."""
ROOM = 2.0
"""Least free volume for the ball's centre, over the ball's volume: less is, for example, a gap behind a handle."""
FLOOR_CELLS, ABREAST = 2.5, 2.0
"""Cells between a ball that lies on the floor and the floor; and least width of its places there, over its radius, in
each direction: two lie side by side. Less is a door's rebate, the slit before a clock's face, or a slot."""
MOST_CELLS = 400_000
"""Most cells of one grid, which takes about 0.1 s; beyond it cells are made larger."""


@dataclass(frozen=True, eq=False)
class Interior:
    """One compartment: (n, 3) centres of the cells where a ball of ``radius_m`` may lie, their (n,) distance to the
    nearest face and (n,) height over what is below, and the edge of a cell, m."""

    points: Array
    clearance_m: Array
    height_m: Array
    cell_m: float
    radius_m: float

    @property
    def volume_m3(self) -> float:
        """Volume of its cells, m³."""
        return len(self.points) * self.cell_m**3


def interiors(
    own: Array, others: Array, radius: float, in_the_way: Array | None = None, *,
    walls_of_all: bool = False, railed: bool = False,
) -> list[Interior]:  # fmt: skip
    """The compartments of a link for a ball of ``radius`` (m), the largest first; gravity is along -z.

    ``own`` are the link's (k, 3, 3) faces, ``others`` those of all other links, between which the ball lies. Those
    ``in_the_way`` stay while it comes in from outside: none unless stated. Walls beside and above are the link's own,
    or with ``walls_of_all`` any link's, as about a rack; ``railed`` asks for all four beside it, as of a door's shelf.
    """
    low, high = box_of(own.reshape(-1, 3))
    if walls_of_all:
        high = high + np.array([0.0, 0.0, 6.0 * radius])
    if float(np.sort(high - low)[0]) < radius:
        return []
    cell = radius / CELLS_A_RADIUS
    size = high - low + 2.0 * (radius + OUTER_CELLS * cell)
    cell *= max(1.0, float((size / cell).prod() / MOST_CELLS) ** (1.0 / 3.0))
    margin = radius + OUTER_CELLS * cell
    corner, shape = low - margin, np.ceil((high - low + 2.0 * margin) / cell).astype(int) + 1
    walls = occupied_cells(own, corner, cell, shape)
    every = walls | occupied_cells(others, corner, cell, shape)
    kept = walls if in_the_way is None else walls | occupied_cells(in_the_way, corner, cell, shape)
    free = ndimage.distance_transform_edt(~kept) * cell >= radius + cell / 2.0
    outside, _ = ndimage.label(free)
    clearance = ndimage.distance_transform_edt(~every) * cell
    around = sides_met(every if walls_of_all else walls)
    if railed:
        around[sides_met(walls, (0, 1)) < RAILS] = 0
    level = np.maximum.accumulate(np.where(walls, np.arange(walls.shape[2]), -1), axis=2)
    inside = (outside == outside[0, 0, 0]) & (clearance >= radius + cell) & (level >= 0) & (around >= SIDES)
    label, count = ndimage.label(inside)
    found = []
    for number in range(1, count + 1):
        index = np.argwhere(label == number)
        place = tuple(index.T)
        height = (index[:, 2] - level[place]) * cell
        lowest = index[height <= radius + FLOOR_CELLS * cell, :2]
        wide = len(lowest) > 0 and float(np.ptp(lowest, axis=0).min()) * cell >= ABREAST * radius
        if wide and len(index) * cell**3 >= ROOM * 4.0 / 3.0 * np.pi * radius**3:
            found.append(Interior(corner + (index + 0.5) * cell, clearance[place], height, cell, radius))
    return sorted(found, key=lambda item: -len(item.points))


def occupied_cells(faces: Array, corner: Array, cell: float, shape: Array) -> Grid:
    """Boolean grid of the cells that (k, 3, 3) faces pass through."""
    taken = np.zeros(shape, dtype=bool)
    if len(faces):
        lowest, highest = boxes_of(faces)
        reached = (highest >= corner).all(axis=1) & (lowest <= corner + shape * cell).all(axis=1)
        index = np.floor((samples(faces[reached], cell / 2.0) - corner) / cell).astype(int)
        index = index[np.all((index >= 0) & (index < shape), axis=1)]
        taken[index[:, 0], index[:, 1], index[:, 2]] = True
    return taken


def sides_met(walls: Grid, axes: Sequence[int] = (0, 1, 2)) -> NDArray[np.int8]:
    """In how many of -x, +x, -y, +y, -z and +z, or both ways along these axes, a wall lies, of each cell."""
    met = np.zeros(walls.shape, dtype=np.int8)
    for axis in axes:
        met += np.logical_or.accumulate(walls, axis=axis)
        met += np.flip(np.logical_or.accumulate(np.flip(walls, axis), axis=axis), axis)
    return met
