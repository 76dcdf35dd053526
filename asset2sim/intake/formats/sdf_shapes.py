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
        solid = trimesh.creation.cone(radius, length).apply_translation([0.0, 0.0, -length / 2.0])
    else:
        outlines = [[numbers(point, ".", "0 0") for point in item.findall("point")] for item in shapes]
        return extruded(outlines, numbers(shape, "height", "1")[0])
    return solid.vertices, solid.faces


def mass_of(
    collisions: Sequence[Element], inertial: Element, numbers: Numbers, pose_of: Callable[[Element], Array]
) -> tuple[float, list[float]] | None:
    """Mass, kg, and centre, m, in the link's frame of the collisions of a link whose inertial Gazebo makes: their
    densities times their volumes, or the mass that the inertial states. None where neither is stated, and for meshes.
    """
    general = numbers(inertial, "density", "0")[0]
    stated = [numbers(item, "density", str(general))[0] for item in collisions]
    mass = numbers(inertial, "mass", "0")[0]
    geometries = [item.find("geometry") for item in collisions]
    made = [None if geometry is None else plain_solid(geometry, numbers) for geometry in geometries]
    if not (mass > 0.0 or any(stated)) or not made or None in made:
        return None
    weights = [(density or WATER_KG_M3) * solid.volume for density, solid in zip(stated, made, strict=True) if solid]
    centres = [pose_of(item) @ [*solid.center_mass, 1.0] for item, solid in zip(collisions, made, strict=True) if solid]
    centre: list[float] = np.average(centres, axis=0, weights=weights)[:3].tolist()
    return mass or float(sum(weights)), centre


def plain_solid(geometry: Element, numbers: Numbers) -> trimesh.Trimesh | None:
    """The solid of one shape; None for a mesh and what has no volume."""
    shape = next(geometry.iterchildren(etree.Element), None)
    if shape is None:
        return None
    radius, length = (numbers(shape, key, "1")[0] for key in ("radius", "length"))
    made: trimesh.Trimesh | None = None
    if shape.tag == "box":
        made = trimesh.creation.box(numbers(shape, "size", "1 1 1"))
    elif shape.tag == "sphere":
        made = trimesh.primitives.Sphere(radius)
    elif shape.tag in ("cylinder", "capsule"):  # as they are, not in facets
        made = getattr(trimesh.primitives, str(shape.tag).capitalize())(radius, length)
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
