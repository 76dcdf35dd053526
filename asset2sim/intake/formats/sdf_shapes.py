"""Solids of SDF's shapes that a URDF has no word for: ellipsoids, cones, extruded outlines; and what shapes weigh."""

from collections.abc import Callable, Sequence

import numpy as np
import trimesh
from lxml import etree
from lxml.etree import _Element as Element

from asset2sim.physics.arrays import Array, Faces

Numbers = Callable[[Element, str, str], list[float]]
"""(element, path, default) → the numbers below the element."""
SOLIDS = ("ellipsoid", "cone", "polyline")
WATER_KG_M3 = 1000.0
"""Density of collisions that state none, beside others that do."""


def solid_of(shapes: Sequence[Element], numbers: Numbers) -> tuple[Array, Faces]:
    """(n, 3) vertices and (m, 3) faces of one ellipsoid or cone, which stands along z about its middle, or of the
    polylines of one geometry, which stand on z = 0. Raises ValueError for outlines that enclose nothing."""
    shape = shapes[0]
    if shape.tag == "ellipsoid":
        solid = trimesh.creation.icosphere(3).apply_scale(numbers(shape, "radii", "1 1 1"))
    elif shape.tag == "cone":
        radius, length = (numbers(shape, key, "1")[0] for key in ("radius", "length"))
    made: trimesh.Trimesh | None = None
    if shape.tag == "box":
        made = trimesh.creation.box(numbers(shape, "size", "1 1 1"))
    elif shape.tag == "sphere":
        made = trimesh.primitives.Sphere(radius)
    elif shape.tag in ("cylinder", "capsule"):  # as they are, not in facets
        made = getattr(trimesh.primitives, shape.tag.capitalize())(radius, length)
    elif shape.tag in SOLIDS:
        made = trimesh.Trimesh(*solid_of(geometry.findall(str(shape.tag)), numbers))
    return made


def extruded(outlines: Sequence[Sequence[Sequence[float]]], height_m: float) -> tuple[Array, Faces]:
    """Vertices and faces of what closed outlines enclose, those within others being holes, from z = 0 up."""
    from shapely.geometry import Polygon

    if any(len(points) < 3 for points in outlines):
        raise ValueError("an outline of fewer than three points")
    area = Polygon()
    for points in outlines:
        area = area.symmetric_difference(Polygon(points).buffer(0.0))
    pieces = [piece for piece in getattr(area, "geoms", [area]) if piece.area > 0.0]
    if not pieces or height_m <= 0.0:
        raise ValueError("an outline that encloses nothing")
    solids = [trimesh.creation.extrude_polygon(piece, height_m) for piece in pieces]
    count = np.cumsum([0, *(len(solid.vertices) for solid in solids)])
    faces = [solid.faces + start for solid, start in zip(solids, count, strict=False)]
    return np.vstack([solid.vertices for solid in solids]), np.vstack(faces)
