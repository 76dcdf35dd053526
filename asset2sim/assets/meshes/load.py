"""Loading the geometry of one visual or collision: a mesh file of any kind trimesh reads, or a primitive."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
import yourdfpy
from trimesh.units import unit_conversion

from asset2sim.assets.meshes.obj_file import read_obj
from asset2sim.assets.meshes.unusable import AGAIN, UnusableMeshError, check_geometry, why_unreadable
from asset2sim.assets.urdf.capsule import Capsule
from asset2sim.physics.arrays import Array

METRES = "meters"


def load_mesh(path: Path) -> trimesh.Trimesh:
    """The file's triangles in metres as one mesh with merged vertices, without materials. Scenes (COLLADA, glTF) are
    flattened by their nodes' transforms. Raises UnusableMeshError, a ValueError, with the cause and the remedy."""
    try:
        return _merged(path)
    except UnusableMeshError as error:
        raise UnusableMeshError(error.problem, path.name) from error


def _merged(path: Path) -> trimesh.Trimesh:
    try:
        known = read_obj(path.read_bytes()) if path.suffix.lower() == ".obj" else None
        mesh = load_scene(path, skip_materials=True, process=False).to_mesh() if known is None else None
    except (UnusableMeshError, MemoryError):
        raise
    except Exception as error:  # a loader raises whatever its format's parser raises
        raise UnusableMeshError(why_unreadable(path, error)) from error
    if known is not None:
        vertices, faces = known.mesh
    elif isinstance(mesh, trimesh.Trimesh):
        vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    else:
        raise UnusableMeshError(f"holds no triangle: {AGAIN} with its faces")
    check_geometry(vertices, faces)
    with np.errstate(over="ignore", invalid="ignore"):
        bare = trimesh.Trimesh(vertices=vertices, faces=faces, process=False)
        bare.merge_vertices()
        bare.update_faces(bare.nondegenerate_faces())
        bare.remove_unreferenced_vertices()
    if len(bare.faces) == 0:
        raise UnusableMeshError(f"has no area: every triangle is degenerate; {AGAIN}")
    return bare


def load_scene(path: Path, **how: Any) -> trimesh.Scene:
    """The file as a scene in metres. COLLADA states a unit, which every loader of URDFs applies and trimesh does not;
    its up axis counts for none of them (PyBullet, SAPIEN, ROS), and files that state y have z up. Raises what the
    format's parser raises."""
    scene = trimesh.load_scene(str(path), **how)
    unit = unit_of(scene)
    return scene if unit == 1.0 else scene.apply_scale(unit)


def collada_header(path: Path) -> tuple[float | None, str]:
    """The unit (m, None where there is none) and the up axis that a COLLADA file states, ``Y_UP`` where it does not."""
    with path.open("rb") as stream:
        head = stream.read(65_536).decode("utf-8", errors="replace")
    unit = re.search(r"""<unit[^>]*\smeter\s*=\s*["']\s*([0-9.]+(?:[eE][+-]?[0-9]+)?)""", head)
    axis = re.search(r"<up_axis>\s*(\w+)", head)
    return (float(unit[1]) if unit else None), (axis[1] if axis else "Y_UP")


def unit_of(scene: trimesh.Scene) -> float:
    """The length of a file's unit, m; 1 where it states none."""
    units = str(scene.units or METRES)
    return 1.0 if units == METRES else float(unit_conversion(units, METRES))


def primitive(geometry: yourdfpy.Geometry) -> trimesh.Trimesh | None:
    """The mesh of a URDF box, cylinder, capsule or sphere, or None if the geometry is none of these."""
    mesh: trimesh.Trimesh | None = None
    if geometry.box is not None:
        mesh = trimesh.creation.box(extents=geometry.box.size)
    elif isinstance(geometry.cylinder, Capsule):
        mesh = trimesh.creation.capsule(radius=geometry.cylinder.radius, height=geometry.cylinder.length)
    elif geometry.cylinder is not None:
        mesh = trimesh.creation.cylinder(radius=geometry.cylinder.radius, height=geometry.cylinder.length)
    elif geometry.sphere is not None:
        mesh = trimesh.creation.icosphere(subdivisions=3, radius=geometry.sphere.radius)
    return mesh


def scale_vector(mesh: yourdfpy.Mesh) -> Array:
    """The (3,) scale of a mesh reference; 1 where it states none."""
    if mesh.scale is None:
        return np.ones(3)
    return np.broadcast_to(np.asarray(mesh.scale, dtype=float), (3,)).copy()


def mesh_points(file: Path) -> Array:
    """(n, 3) vertices that the file's faces use. Raises ValueError as ``load_mesh`` does."""
    known = read_obj(file.read_bytes()) if file.suffix.lower() == ".obj" else None
    if known is not None and np.isfinite(known.points).all():
        return known.points
    return np.asarray(load_mesh(file).vertices, dtype=float)
