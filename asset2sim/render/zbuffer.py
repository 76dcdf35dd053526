"""A z-buffer for clouds of points, in numpy: which point is seen in each pixel, and which points are seen at all."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from asset2sim.assets.surfaces.surface import Ints
from asset2sim.render.camera import camera_axes, fitted_camera

Singles = NDArray[np.float32]
Words = NDArray[np.int32]
Bools = NDArray[np.bool_]

FAR = np.float32(1e9)
NEAREST = 1e-3
"""Depth at which what is behind the camera is drawn, in units of the world."""
FOV = float(np.radians(24.0))
ALIKE = 1e-3
"""Transforms that differ by less show the same picture: the object is one unit long, and some 200 pixels."""


@dataclass(frozen=True, eq=False)
class Lens:
    """A camera for pictures of ``width`` by ``height`` pixels. ``matrix`` (3, 4) takes a point of the world to
    (x · depth, y · depth, depth), x and y in pixels; where it is ``flat``, an orthographic one, to (x, y, depth).
    ``towards`` (3,) is the direction to the viewer."""

    matrix: Singles
    width: int
    height: int
    towards: Singles
    flat: bool = False

    def project(self, points: Singles) -> Singles:
        """(3, n) points of the world as x, y (pixels) and depth."""
        seen: Singles = self.matrix[:, :3] @ points + self.matrix[:, 3:]
        if not self.flat:
            seen[:2] /= np.maximum(seen[2], NEAREST)
        return seen

    def shrunk(self, factor: float) -> "Lens":
        """The same view in a picture that is smaller by this factor."""
        matrix = (self.matrix / np.array([[factor], [factor], [1.0]])).astype(np.float32)
        width, height = round(self.width / factor), round(self.height / factor)
        return Lens(matrix, width, height, self.towards, self.flat)


def lens_for(points: Singles, towards: Singles, width: int, height: int) -> Lens:
    """A lens that shows (n, 3) points from this direction, in perspective."""
    camera = fitted_camera(points.astype(float), towards.astype(float), FOV, width / height)
    right, up, back = camera_axes(towards.astype(float))
    focal = 0.5 * height / np.tan(0.5 * FOV)
    rows = np.stack([focal * right - 0.5 * width * back, -focal * up - 0.5 * height * back, -back])
    matrix = np.concatenate([rows, -(rows @ camera.eye)[:, None]], axis=1)
    return Lens(matrix.astype(np.float32), width, height, towards.astype(np.float32))


@dataclass(frozen=True, eq=False)
class Layers:
    """Z-buffer of one picture with a border of one pixel, flat arrays: ``depth``, and ``point``, the number of the
    point that is seen there, -1 for none."""

    depth: Singles
    point: Words

    @classmethod
    def empty(cls, lens: Lens) -> "Layers":
        """A z-buffer with nothing in it."""
        count = (lens.width + 2) * (lens.height + 2)
        return cls(np.full(count, FAR, dtype=np.float32), np.full(count, -1, dtype=np.int32))

    def copy(self) -> "Layers":
        """A copy to draw on."""
        return Layers(self.depth.copy(), self.point.copy())


def splat(
    layers: Layers, points: Singles, first: int, last: int, to_world: Singles, lens: Lens
) -> tuple[Ints, Singles]:
    """Draw the points ``first`` to ``last`` of (3, n), moved by a (3, 4) transform; the pixel and depth of each."""
    linear = lens.matrix[:, :3] @ to_world[:, :3]
    offset = lens.matrix[:, :3] @ to_world[:, 3] + lens.matrix[:, 3]
    seen = linear @ points[:, first:last]
    seen += offset[:, None]
    depth = seen[2]
    if not lens.flat:
        np.maximum(depth, NEAREST, out=depth)
        seen[:2] /= depth
    seen[:2] += 1.0
    # What lies outside lands in the border.
    np.clip(seen[0], 0.0, lens.width + 1, out=seen[0])
    np.clip(seen[1], 0.0, lens.height + 1, out=seen[1])
    pixel = seen[1].astype(np.intp)
    pixel *= lens.width + 2
    pixel += seen[0].astype(np.int32)
    np.minimum.at(layers.depth, pixel, depth)
    front = np.flatnonzero(depth <= layers.depth[pixel])
    layers.point[pixel[front]] = front + first
    return pixel, depth


def ranges_moving_together(starts: Sequence[int], motion: Singles, links: Bools) -> Iterator[tuple[int, int, int]]:
    """(link, first point, last point) of the chosen links, neighbours that move as one together."""
    start = 0
    while start < len(links):
        end = start + 1
        if links[start]:
            while end < len(links) and links[end] and np.array_equal(motion[start], motion[end]):
                end += 1
            if starts[end] > starts[start]:
                yield start, starts[start], starts[end]
        start = end


def seen_in(points: Singles, starts: Sequence[int], motion: Singles, lens: Lens, slack: float) -> Bools:
    """(n,) whether each of (3, n) points is seen in a view, (links, 3, 4) transforms and a lens, or lies less than
    ``slack`` (units of the world) behind what is seen in a pixel beside it. Links hide nothing of each other: in
    a view between these they may stand apart."""
    found = np.empty(points.shape[1], dtype=bool)
    for link, (first, last) in enumerate(pairwise(starts)):
        layers = Layers.empty(lens)
        pixel, depth = splat(layers, points, first, last, motion[link], lens)
        front = layers.depth.reshape(lens.height + 2, lens.width + 2)
        found[first:last] = depth <= maximum_filter(front, size=3).ravel()[pixel] + slack
    return found


def changing_frames(motions: Singles) -> list[int]:
    """The frames of (frames, links, 3, 4) transforms that show another picture than the one before."""
    chosen = [0]
    for frame in range(1, len(motions)):
        if np.abs(motions[frame] - motions[chosen[-1]]).max() > ALIKE:
            chosen.append(frame)
    return chosen
