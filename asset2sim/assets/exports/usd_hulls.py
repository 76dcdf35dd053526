"""Convex hulls within what PhysX collides on a GPU, so that PhysX takes each as it is written.

A convex mesh is GPU-compatible with at most 64 vertices and 64 polygons, none of more than 32 vertices
(``PxConvexMeshDesc`` and ``ConvexMesh::isGpuCompatible`` of PhysX 5). Cooking with data for the GPU, as Isaac Sim does,
cuts larger hulls down by itself: it pushes planes outwards, so that parts which did not touch may overlap, and says
nothing. Hulls here are made smaller instead: inside the given one, with the error known.
"""

from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, QhullError

from asset2sim.assets.meshes.hull import hull_of
from asset2sim.physics.arrays import Array

VERTEX_LIMIT = 64
POLYGON_LIMIT = 64
POLYGON_VERTEX_LIMIT = 32
"""The most vertices, polygons, and vertices of one polygon that a convex mesh may have to be collided on a GPU."""
SAME_PLANE_RAD = 3e-4
"""Angle between two triangles up to which they are one polygon. PhysX merges at least these: its tolerance is 0.0007
of the mesh's extent."""


@dataclass(frozen=True, eq=False)
class LimitedHull:
    """A hull within the limits, in place of one with ``vertices_before``: its (n, 3) points and (k, 3) outward faces,
    the largest distance of the given hull from it, m, and its share of the given hull's volume."""

    points: Array
    faces: NDArray[np.int_]
    vertices_before: int
    distance_m: float
    volume_ratio: float


def limited_hull(points: Array) -> LimitedHull | None:
    """The hull of (n, 3) points, m, made to fit PhysX' limits; None where it fits as it is, or where they are coplanar.

    Its corners are corners of the given hull: it lies inside, so nothing collides that did not before. Those farthest
    along the axes come first, so that the box of the object and the height it stands at stay; then, one by one, the
    corner that is farthest outside.
    """
    try:
        full = ConvexHull(points)
    except (QhullError, ValueError):
        return None
    if len(points) <= VERTEX_LIMIT and within_physx_limits(full):
        return None
    corners = points[full.vertices]
    chosen, kept = extreme_corners(corners), np.arange(0)
    while len(chosen) <= VERTEX_LIMIT:
        try:
            hull = ConvexHull(corners[chosen])
        except QhullError:
            # Still flat: the corner farthest from those chosen gives it depth.
            apart = np.linalg.norm(corners[:, None] - corners[chosen][None], axis=2).min(axis=1)
            chosen = np.append(chosen, apart.argmax())
            continue
        if within_physx_limits(hull):
            kept = chosen
        outside = (corners @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
        outside[chosen] = 0.0
        if outside.max() <= 0.0:
            break
        chosen = np.append(chosen, outside.argmax())
    return reduced_hull(corners, kept, full.volume) if len(kept) else None


def within_physx_limits(hull: ConvexHull) -> bool:
    """Whether a hull is within PhysX' limits on vertices and polygons."""
    if len(hull.vertices) > VERTEX_LIMIT:
        return False
    if len(hull.vertices) <= POLYGON_VERTEX_LIMIT + 1:
        # A hull of n vertices has at most 2 n - 4 polygons, and none with all of them.
        return True
    sizes = polygon_sizes(hull)
    return len(sizes) <= POLYGON_LIMIT and max(sizes) <= POLYGON_VERTEX_LIMIT


def polygon_sizes(hull: ConvexHull) -> list[int]:
    """Number of vertices of every polygon of a hull: triangles side by side in one plane are one polygon."""
    count = len(hull.simplices)
    first = np.repeat(np.arange(count), hull.neighbors.shape[1])
    second = hull.neighbors.ravel()
    normals = hull.equations[:, :3]
    # The sine, for the cosine of so small an angle is 1 to the last digits.
    flat = np.linalg.norm(np.cross(normals[first], normals[second]), axis=1) <= SAME_PLANE_RAD
    joined = coo_array((np.ones(int(flat.sum())), (first[flat], second[flat])), shape=(count, count))
    _, labels = connected_components(joined, directed=False)
    # Each vertex of each polygon once, as one number.
    corners = np.unique(labels[:, None].astype(np.int64) * len(hull.points) + hull.simplices)
    return [int(size) for size in np.bincount(corners // len(hull.points))]


def extreme_corners(corners: Array) -> NDArray[np.int_]:
    """Indices of the (n, 3) corners that are lowest and highest along each axis."""
    return np.unique(np.concatenate([corners.argmin(axis=0), corners.argmax(axis=0)]))


def reduced_hull(corners: Array, kept: NDArray[np.int_], volume_before: float) -> LimitedHull | None:
    """The hull of the corners that are kept, with its error; None where it has no volume."""
    hull = hull_of(corners[kept])
    if hull is None:
        return None
    points, faces = np.unique(hull.triangles.reshape(-1, 3), axis=0, return_inverse=True)
    volume = ConvexHull(points).volume
    # Distance from a convex body is largest at a corner.
    distance = float(distances_from_surface(corners, hull.triangles).max())
    return LimitedHull(points, faces.reshape(-1, 3), len(corners), distance, float(volume / volume_before))


def distances_from_surface(points: Array, triangles: Array) -> Array:
    """(n,) distances, m, of (n, 3) points from a surface of (k, 3, 3) triangles."""
    # At unit size: trimesh takes edges of a tenth of a millimetre for points.
    size, middle = float(np.ptp(points, axis=0).max()), points.mean(axis=0)
    pairs = np.broadcast_to((triangles - middle) / size, (len(points), *triangles.shape)).reshape(-1, 3, 3)
    given = np.repeat((points - middle) / size, len(triangles), axis=0)
    apart = np.linalg.norm(np.asarray(trimesh.triangles.closest_point(pairs, given)) - given, axis=1)
    return np.asarray(size * apart.reshape(len(points), len(triangles)).min(axis=1))
