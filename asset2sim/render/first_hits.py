"""The triangle met first in each pixel: by Embree, or by a z-buffer in NumPy without it (Linux on ARM)."""

import os

import numpy as np

from asset2sim.assets.surfaces.surface import Floats, Ints
from asset2sim.render.camera import Camera, Singles

try:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene
except ImportError:
    EmbreeScene = None


def stay_one_thread() -> None:
    """Have Embree make no threads, which it otherwise does for each core that is there for its first scene: a process
    that has threads cannot be forked safely, nor be given another asset."""
    if EmbreeScene is not None and hasattr(os, "sched_setaffinity"):
        cores = os.sched_getaffinity(0)
        os.sched_setaffinity(0, {min(cores)})
        EmbreeScene()
        os.sched_setaffinity(0, cores)


stay_one_thread()

MOST = 1_000_000
"""Pixels of triangles that are looked at together, without Embree: 100 MB."""
INSIDE = -1e-9
"""Share of a triangle by which a pixel may lie outside it, without Embree: edges that two share leave no gap."""
Hits = tuple[Ints, Singles, Singles]


class Triangles:
    """(m, 3, 3) triangles, ready to be looked at."""

    def __init__(self, corners: Floats) -> None:
        self.corners = corners
        # Embree's numbers are single: of a unit's size, about the origin, they lose least.
        self.middle = 0.5 * (corners.min(axis=(0, 1)) + corners.max(axis=(0, 1))) if len(corners) else np.zeros(3)
        self.size = float(np.ptp(corners, axis=(0, 1)).max()) or 1.0 if len(corners) else 1.0
        self.scene = None
        if EmbreeScene is not None and len(corners):
            self.scene = EmbreeScene(robust=True)
            TriangleMesh(self.scene, ((corners - self.middle) / self.size).astype(np.float32))

    def first_hits(self, camera: Camera, pixel: Ints, beyond: Singles) -> Hits:
        """Of each of these (n,) pixels of a camera, the number of the triangle that is met first ``beyond`` a depth, -1
        for none, the (3, n) weights of its corners there, and the depth."""
        if self.scene is None:
            return rasterized(self.corners, camera, pixel, beyond)
        origins, directions = camera.rays(pixel)
        starts = np.empty((len(pixel), 3), dtype=np.float32)
        starts[:] = (origins - self.middle) / self.size
        directions = directions / np.float32(self.size)
        if beyond.any():
            starts += beyond[:, None] * directions
        found = self.scene.run(starts, directions, output=1)
        weights = np.stack([1.0 - found["u"] - found["v"], found["u"], found["v"]])
        return found["primID"], weights, found["tfar"] + beyond


def rasterized(corners: Floats, camera: Camera, pixel: Ints, beyond: Singles) -> Hits:
    """The same of (m, 3, 3) triangles by a z-buffer."""
    x, y, depth = camera.project(corners.reshape(-1, 3).T).reshape(3, -1, 3)
    place = np.full(camera.width * camera.height, -1)
    place[pixel] = np.arange(len(pixel))
    area = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])
    (left, right), (top, bottom) = (
        np.clip((np.ceil(at.min(1) - 0.5), np.floor(at.max(1) - 0.5) + 1), 0, side).astype(np.int64)
        for at, side in ((x, camera.width), (y, camera.height))
    )
    counts = np.where(area != 0.0, np.maximum(right - left, 0) * np.maximum(bottom - top, 0), 0)
    number, weights = np.full(len(pixel), -1), np.zeros((len(pixel), 3), dtype=np.float32)
    buffer, ends, first = np.full(len(pixel), np.inf), np.cumsum(counts), 0
    while first < len(counts):
        last = max(first + 1, int(np.searchsorted(ends, ends[first] - counts[first] + MOST, side="right")))
        face = np.repeat(np.arange(first, last), counts[first:last])
        within = np.arange(len(face)) + ends[first] - counts[first] - (ends[face] - counts[face])
        wide = right[face] - left[face]
        column, row = left[face] + within % wide, top[face] + within // wide
        to_x, to_y = x[face] - (column[:, None] + 0.5), y[face] - (row[:, None] + 0.5)
        after, before = [1, 2, 0], [2, 0, 1]
        share = (to_x[:, after] * to_y[:, before] - to_x[:, before] * to_y[:, after]) / area[face, None]
        at = place[row * camera.width + column]
        inside = (share.min(axis=1) >= INSIDE) & (at >= 0)
        face, share, at = face[inside], share[inside], at[inside]
        if camera.flat:
            far = (share * depth[face]).sum(axis=1)
        else:  # one over the depth is linear in the picture
            share /= depth[face]
            far = 1.0 / share.sum(axis=1)
            share *= far[:, None]
        seen = far > beyond[at]
        face, share, far, at = face[seen], share[seen], far[seen], at[seen]
        np.minimum.at(buffer, at, far)
        won = np.flatnonzero(far == buffer[at])[::-1]  # of equals the first stays
        number[at[won]], weights[at[won]] = face[won], share[won]
        first = last
    return number, weights.T, buffer.astype(np.float32)
