"""Points that span the collision shapes of a URDF's links, in the links' frames, m."""

import math
from contextlib import suppress
from pathlib import Path

import numpy as np
from lxml import etree

from asset2sim.assets.meshes.load import mesh_points
from asset2sim.assets.meshes.obj_file import read_obj
from asset2sim.assets.urdf.document import parsed_root
from asset2sim.assets.urdf.read import element_pose, numbers_of_attribute
from asset2sim.physics.arrays import Array, box_of

TURNS = np.linspace(0.0, 2.0 * math.pi, 48, endpoint=False)
ROUND = np.stack([np.cos(TURNS), np.sin(TURNS), np.ones(48)], axis=1)
"""(48, 3) rim of a cylinder of radius 1 and half length 1."""


def link_corners(element: "etree._Element", folder: Path) -> Array | None:
    """(8, 3) corners of the box about a link's collision shapes, in the link's frame, m; None where it has none."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for collision in element.findall("collision"):
        extent = shape_box(collision.find("geometry"), folder)
        if extent is None:
            continue
        frame = element_pose(collision)
        points = corners(*extent) @ frame[:3, :3].T + frame[:3, 3]
        low, high = np.minimum(low, points.min(axis=0)), np.maximum(high, points.max(axis=0))
    return corners(low, high) if np.all(low <= high) else None


def collision_points(element: "etree._Element", folder: Path) -> Array:
    """(n, 3) points that span a link's collision shapes, in the link's frame, m; balls by the box about them."""
    return np.vstack([np.zeros((0, 3)), *shape_points(element, folder)])


def shape_points(element: "etree._Element", folder: Path) -> list[Array]:
    """The same for each of its shapes, (n, 3) each."""
    clouds = []
    for collision in element.findall("collision"):
        mesh = collision.find("geometry/mesh")
        if mesh is not None:
            points = points_of(folder / str(mesh.get("filename"))) * np.array(
                numbers_of_attribute(mesh, "scale", "1 1 1")
            )
        else:
            extent = shape_box(collision.find("geometry"), folder)
            points = np.zeros((0, 3)) if extent is None else corners(*extent)
            if extent is not None and collision.find("geometry/cylinder") is not None:
                points = np.vstack([ROUND * extent[1], ROUND * extent[1] * [1.0, 1.0, -1.0]])
        frame = element_pose(collision)
        clouds.append(points @ frame[:3, :3].T + frame[:3, 3])
    return clouds


def corners(low: Array, high: Array) -> Array:
    """(8, 3) corners of a box."""
    return np.array([(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])


def shape_box(geometry: "etree._Element | None", folder: Path) -> tuple[Array, Array] | None:
    """The (3,) least and greatest corner of one URDF geometry in its own frame, or None where there is none."""
    shape = None if geometry is None or not len(geometry) else geometry[0]
    if shape is None:
        return None
    if shape.tag == "box":
        half = np.array(numbers_of_attribute(shape, "size", "0 0 0")) / 2.0
    elif shape.tag == "sphere":
        half = np.full(3, numbers_of_attribute(shape, "radius", "0")[0])
    elif shape.tag in ("cylinder", "capsule"):
        radius, length = numbers_of_attribute(shape, "radius", "0")[0], numbers_of_attribute(shape, "length", "0")[0]
        half = np.array([radius, radius, length / 2.0 + (radius if shape.tag == "capsule" else 0.0)])
    else:
        points = points_of(folder / str(shape.get("filename")))
        if not len(points):
            return None
        scale = np.array(numbers_of_attribute(shape, "scale", "1 1 1"))
        low, high = (end * scale for end in box_of(points))
        return np.minimum(low, high), np.maximum(low, high)
    return -half, half


def points_of(file: Path) -> Array:
    """(n, 3) vertices of a mesh file; none where it is missing or holds no triangle."""
    try:
        return mesh_points(file) if file.is_file() else np.zeros((0, 3))
    except ValueError:
        return np.zeros((0, 3))


def know_points(urdf: Path) -> None:
    """Read the small collision meshes of a URDF: this process, and those forked from it, then know their points."""
    with suppress(etree.XMLSyntaxError, OSError):
        for mesh in parsed_root(urdf).iterfind("link/collision/geometry/mesh"):
            file = urdf.parent / str(mesh.get("filename"))
            if file.suffix == ".obj":
                read_obj(file.read_bytes())
