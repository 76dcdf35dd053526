"""Area, centre and second moments of a mesh's faces: what a wall of even thickness along them weighs and where."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from asset2sim.physics.arrays import Array, Faces


@dataclass(frozen=True)
class SheetSurface:
    """Area (m²), (3,) centre of a sheet along the faces, and its (3, 3) inertia about that at 1 kg/m². ``opening`` is
    the area of what would close it, m²: 0 for a closed mesh, the plate's own for a plate drawn from one side."""

    area: float
    opening: float
    center: Array
    inertia: Array

    def moved(self, rotation: Array, translation: Array) -> "SheetSurface":
        """The same surface in another frame: (3, 3) rotation, then (3,) translation."""
        return SheetSurface(
            self.area, self.opening, rotation @ self.center + translation, rotation @ self.inertia @ rotation.T
        )


NOTHING = SheetSurface(0.0, 0.0, np.zeros(3), np.zeros((3, 3)))
"""The surface of no faces."""


def surface_of(vertices: Array, faces: Faces) -> SheetSurface:
    """Surface of (n, 3) merged vertices and (k, 3) faces. A face drawn twice, once for either side, counts once."""
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    triangles = np.asarray(vertices, dtype=float)[faces[first]]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]) / 2.0
    area = np.linalg.norm(normals, axis=1)
    whole = float(area.sum())
    if whole <= 0.0:
        return SheetSurface(0.0, 0.0, triangles.reshape(-1, 3).mean(axis=0), np.zeros((3, 3)))
    center = (area @ triangles.sum(axis=1)) / (3.0 * whole)
    # ∫ x xᵀ over a triangle is A/12 · (Σ vᵢ vᵢᵀ + s sᵀ), with its corners vᵢ and their sum s.
    corners = triangles - center
    sums = corners.sum(axis=1)
    second = np.einsum("k,kvi,kvj->ij", area, corners, corners) + np.einsum("k,ki,kj->ij", area, sums, sums)
    second /= 12.0
    # The area vectors of a closed surface sum to zero, so what is left is that of its openings.
    opening = float(np.linalg.norm(normals.sum(axis=0)))
    return SheetSurface(whole, opening, center, np.trace(second) * np.eye(3) - second)


def joined_surfaces(surfaces: Sequence[SheetSurface]) -> SheetSurface:
    """Several surfaces in one frame as one (parallel-axis theorem)."""
    area = sum(item.area for item in surfaces)
    if area <= 0.0:
        return NOTHING
    center = np.sum([item.area * item.center for item in surfaces], axis=0) / area
    inertia = np.zeros((3, 3))
    for item in surfaces:
        offset = item.center - center
        inertia += item.inertia + item.area * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    return SheetSurface(float(area), sum(item.opening for item in surfaces), center, inertia)
