"""Decals: surfaces that lie exactly on others are lifted a hair, so that they are seen whole and not in speckles."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from asset2sim.views.surface import Batch, Surface

LIFT = 4e-5
"""How far the smallest flat surface is lifted off, as a share of the object's size: a tenth of a pixel of a large
view."""
FLAT = 1e-4
"""A surface is flat if it is no thicker than this share of the object's size."""


def small_first(surfaces: Sequence[Surface]) -> list[tuple[Surface, float]]:
    """The surfaces from the smallest to the largest, each with the distance (m) that it is to be lifted along its
    normals.

    What lies on something is smaller than what it lies on; among equals, the textured one is on top. Only flat surfaces
    are lifted: others would gape at their edges.
    """
    if not surfaces:
        return []
    areas, thickness = zip(*(area_and_thickness(surface) for surface in surfaces), strict=True)
    size = max(float(np.ptp(np.concatenate([surface.vertices for surface in surfaces]), axis=0).max()), 1e-9)
    largest = max(areas) or 1.0

    def on_top(index: int) -> tuple[float, bool]:
        paint = surfaces[index].paint
        return (round(areas[index] / largest, 6), paint is None or paint.texture is None)

    order = sorted(range(len(surfaces)), key=on_top)
    lift = [LIFT * size * (1.0 - (item / largest) ** 0.5) for item in areas]
    flat = [item <= FLAT * size for item in thickness]
    return [(surfaces[index], lift[index] if flat[index] else 0.0) for index in order]


def area_and_thickness(surface: Surface) -> tuple[float, float]:
    """The surface's area, m² (both sides count where both are given), and its extent along its largest face's
    normal, m."""
    corner = surface.vertices[surface.faces]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    double = np.linalg.norm(normal, axis=1)
    widest = int(double.argmax())
    along = corner.reshape(-1, 3) @ (normal[widest] / (double[widest] or 1.0))
    return 0.5 * float(double.sum()), float(np.ptp(along))


def lifted(batch: Batch, distance: float) -> Batch:
    """The batch moved along its own normals by ``distance`` metres."""
    return replace(batch, vertices=batch.vertices + distance * batch.normals)
