"""The lowest point of a set of convex shapes, for engines that do not report it."""

import math
from dataclasses import dataclass

import numpy as np

from asset2sim.physics.arrays import Array

RIM_POINTS = 128
"""Points that stand for the rim of a cylinder: it is 0.03 % of the radius too small between them."""


@dataclass(frozen=True)
class BallCloud:
    """Points, each the centre of a ball (of radius 0 for corners), whose convex hull is one shape or many. ``points``
    is (n, 3) in the frame of the link whose index is in ``link`` (n,); ``radius`` is (n,), m."""

    points: Array
    radius: Array
    link: "np.ndarray[tuple[int], np.dtype[np.intp]]"

    def lowest_m(self, rotations: Array, origins: Array) -> float:
        """The least height of any shape, links at (l, 3, 3) rotations and (l, 3) origins; infinite without shapes."""
        down = rotations[self.link, 2]
        heights = np.einsum("ij,ij->i", down, self.points) + origins[self.link, 2] - self.radius
        return float(heights.min(initial=math.inf))


@dataclass(frozen=True)
class Balls:
    """Balls whose convex hull is the shape: (n, 3) centres in the shape's own frame and (n,) radii, m."""

    points: Array
    radius: Array


def corners(points: Array) -> Balls:
    """A shape that is the convex hull of (n, 3) points."""
    return Balls(np.asarray(points, dtype=float), np.zeros(len(points)))


def box(half: Array) -> Balls:
    """A box of (3,) half edges."""
    signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    return corners(signs * np.asarray(half))


def sphere(radius: float) -> Balls:
    """A ball."""
    return Balls(np.zeros((1, 3)), np.array([radius]))


def capsule(radius: float, half_length: float, axis: int) -> Balls:
    """A capsule along one of its frame's axes, ``half_length`` to the centre of either cap."""
    ends = np.zeros((2, 3))
    ends[:, axis] = (-half_length, half_length)
    return Balls(ends, np.array([radius, radius]))


def cylinder(radius: float, half_length: float, axis: int) -> Balls:
    """A cylinder along one of its frame's axes."""
    angles = np.arange(RIM_POINTS) * 2.0 * math.pi / RIM_POINTS
    rim = np.zeros((RIM_POINTS, 3))
    rim[:, (axis + 1) % 3], rim[:, (axis + 2) % 3] = radius * np.cos(angles), radius * np.sin(angles)
    ends = np.zeros(3)
    ends[axis] = half_length
    return corners(np.concatenate([rim - ends, rim + ends]))


def lowest_cloud(shapes: "list[tuple[int, Balls, Array]]") -> BallCloud:
    """The cloud of shapes given as (link, the shape, its (4, 4) shape-to-link transform)."""
    if not shapes:
        return BallCloud(np.zeros((0, 3)), np.zeros(0), np.zeros(0, dtype=np.intp))
    points = [shape.points @ pose[:3, :3].T + pose[:3, 3] for _, shape, pose in shapes]
    links = [np.full(len(shape.points), link, dtype=np.intp) for link, shape, _ in shapes]
    radii = [shape.radius for _, shape, _ in shapes]
    return BallCloud(np.concatenate(points), np.concatenate(radii), np.concatenate(links))
