"""Convex hulls of point sets and of a mesh's connected shells; the mass properties of what a closed surface encloses.

Engines disagree on a mesh's collision shape: PyBullet takes one hull per OBJ group, MuJoCo one per file, and both close
the gaps between separate shells. Written out as convex pieces, every engine simulates the same shapes.
"""

from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from asset2sim.physics.arrays import Array, Faces, cross
from asset2sim.physics.convex_hull import convex_hull

Boxes = tuple[Array, Array]
FLAT_THICKNESS = 1e-4
"""Thickness over longest extent below which a mesh is a sheet: real decals lie below 1e-6, thin panels above 1e-3."""


@dataclass(frozen=True)
class Hull:
    """A convex hull with a volume: its (n, 3) vertices and its (k, 3, 3) outward triangles."""

    points: Array
    triangles: Array


def hull_of(points: Array) -> Hull | None:
    """The hull of (n, 3) points, or None where they are coplanar."""
    extent = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    if len(points) < 4 or extent <= 0.0:
        return None
    hull = convex_hull(points)
    if hull is None or 3.0 * hull.volume <= FLAT_THICKNESS * extent * hull.area:
        return None
    triangles = points[hull.simplices]
    normals = cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    inward = np.einsum("ij,ij->i", normals, hull.equations[:, :3]) < 0.0
    triangles[inward] = triangles[inward][:, ::-1]
    return Hull(used_points(points, hull.simplices), triangles)


def used_points(points: Array, faces: NDArray[np.integer]) -> Array:
    """Those of (n, 3) points that (k, 3) faces use, in their order. SciPy's ``vertices`` of a hull are the same ones;
    it sorts them, in a fifth of the time that a small hull takes."""
    used = np.zeros(len(points), dtype=bool)
    used[faces] = True
    return points[used]


def distinct_faces(faces: Faces) -> Faces:
    """(m,) indices of (k, 3) faces, each set of corners once, the first of those alike, in the order of their sorted
    corners; a key of one number each is sorted in a fifth of the time of rows."""
    corners = np.sort(faces, axis=1).astype(np.int64)
    count = int(corners.max(initial=0)) + 1
    if count >= 1 << 21:  # three of them would not fit
        return np.asarray(np.unique(corners, axis=0, return_index=True)[1])
    key = (corners[:, 0] * count + corners[:, 1]) * count + corners[:, 2]
    return np.asarray(np.unique(key, return_index=True)[1])


def solid_moments(triangles: Array) -> tuple[float, Array, Array]:
    """Volume, (3,) centre of mass and (3, 3) inertia about it of a closed surface of (k, 3, 3) outward triangles."""
    # Integrals about a point of the surface's own box lose fewer digits than about a distant origin.
    origin = triangles.reshape(-1, 3).mean(axis=0)
    # A surface that encloses nothing has no centre; callers see volume 0.
    with np.errstate(divide="ignore", invalid="ignore"):
        properties = trimesh.triangles.mass_properties(triangles - origin, density=1.0, skip_inertia=False)
    return float(properties.volume), np.asarray(properties.center_mass) + origin, np.asarray(properties.inertia)


def hull_vertices(points: Array) -> Array:
    """The points that span the hull of (n, 3) points; all of them where they are coplanar."""
    hull = convex_hull(points)
    return points if hull is None else used_points(points, hull.simplices)


def hull_area(points: Array) -> float:
    """Area of the hull of (n, 3) points, m²; 0 where they are coplanar."""
    hull = convex_hull(points)
    return 0.0 if hull is None else float(hull.area)


def boxes_meet(first: Boxes, second: Boxes, slack: float = 0.0) -> NDArray[np.bool_]:
    """(n, m) whether boxes, given as (n, 3) lowest and highest corners, come within ``slack`` (m) of each other."""
    below = np.all(first[0][:, None] <= second[1][None] + slack, axis=2)
    above = np.all(second[0][None] <= first[1][:, None] + slack, axis=2)
    return np.asarray(below & above)


def spread_directions(count: int) -> Array:
    """(count, 3) unit vectors, evenly spread over the sphere along a golden spiral."""
    index = np.arange(count) + 0.5
    height, turn = 1.0 - 2.0 * index / count, np.pi * (1.0 + np.sqrt(5.0)) * index
    ring = np.sqrt(1.0 - height**2)
    return np.column_stack([ring * np.cos(turn), ring * np.sin(turn), height])


MOST_SHELLS = 24
"""Shells above which the whole hull is kept: a mesh of many fragments is one part drawn in pieces, not many parts."""
LOOSE_SHARE = 0.5
"""Share of the area in flat shells from which the shells are faces of one solid (a box drawn as six loose sides)."""


@dataclass(frozen=True)
class ConvexShell:
    """A convex piece and the (m,) indices of the mesh's faces that it replaces."""

    hull: Hull
    faces: NDArray[np.int64]


NO_HULL = Hull(np.zeros((0, 3)), np.zeros((0, 3, 3)))


def shells(mesh: trimesh.Trimesh, whole: Hull = NO_HULL) -> tuple[ConvexShell, ...]:
    """The convex pieces of a mesh, in its frame, with their faces; ``whole`` is the mesh's own hull, where that is
    wanted. Flat shells among solid ones are decals: they are left out."""
    points = np.asarray(mesh.vertices, dtype=float)
    edges = mesh.edges
    adjacency = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(len(points), len(points)))
    count, label = connected_components(adjacency, directed=False)
    one = (ConvexShell(whole, np.arange(len(mesh.faces))),)
    if count == 1 or count > MOST_SHELLS:
        return one
    face_label = label[mesh.faces[:, 0]]
    found, flat_area = [], 0.0
    for shell in range(count):
        hull = hull_of(points[label == shell])
        if hull is None:
            flat_area += float(mesh.area_faces[face_label == shell].sum())
        else:
            found.append(ConvexShell(hull, np.flatnonzero(face_label == shell)))
    if not found or flat_area > LOOSE_SHARE * float(mesh.area):
        return one
    return tuple(found)
