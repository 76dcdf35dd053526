"""Collision shapes in USD: hulls and other geometry that PhysX takes as it is written, and the schemas that make it
collide.

A convex mesh is GPU-compatible with at most 64 vertices and 64 polygons, none of more than 32 vertices
(``PxConvexMeshDesc`` and ``ConvexMesh::isGpuCompatible`` of PhysX 5). Cooking with data for the GPU, as Isaac Sim does,
cuts larger hulls down by itself: it pushes planes outwards, so that parts which did not touch may overlap, and says
nothing. Hulls here are made smaller instead: inside the given one, with the error known.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from pxr import Gf, Usd, UsdGeom, UsdPhysics, UsdShade, Vt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull

from asset2sim.assets import mujoco_options
from asset2sim.assets.exports.refined_object import ExportShape, wxyz_of
from asset2sim.assets.exports.usd_joints import set_unregistered
from asset2sim.assets.meshes.hull import hull_of
from asset2sim.assets.meshes.load import load_mesh
from asset2sim.physics.arrays import Array
from asset2sim.physics.convex_hull import convex_hull

VERTEX_LIMIT = 64
POLYGON_LIMIT = 64
POLYGON_VERTEX_LIMIT = 32
"""The most vertices, polygons, and vertices of one polygon that a convex mesh may have to be collided on a GPU."""
SAME_PLANE_RAD = 3e-4
"""Angle between two triangles that are one polygon. PhysX merges at least these: it tolerates 0.0007 of the extent."""


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
    full = convex_hull(points)
    if full is None or (len(points) <= VERTEX_LIMIT and within_physx_limits(full)):
        return None
    corners = points[full.vertices]
    chosen = np.unique(np.concatenate([corners.argmin(axis=0), corners.argmax(axis=0)]))
    kept = np.arange(0)
    while len(chosen) <= VERTEX_LIMIT:
        hull = convex_hull(corners[chosen])
        if hull is None:
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


CUSTOM_DATA = "asset2sim"
"""Key of the custom data of the root layer and of collision prims that say what was made smaller."""


def write_shape(stage: Usd.Stage, shape: ExportShape, folder: Path, path: str) -> LimitedHull | None:
    """One collision shape's geometry in its link's frame, and the hull in its place where it had to be smaller."""
    geometry: UsdGeom.Gprim
    smaller: LimitedHull | None = None
    if shape.kind == "mesh":
        mesh = load_mesh(folder / shape.file)
        geometry = UsdGeom.Mesh.Define(stage, path)
        scale = np.ones(3) if shape.scale is None else shape.scale
        points = np.asarray(mesh.vertices, dtype=float) * scale
        faces = np.asarray(mesh.faces) if np.prod(scale) > 0.0 else np.asarray(mesh.faces)[:, ::-1]
        smaller = limited_hull(points)
        if smaller is not None:
            points, faces = smaller.points, smaller.faces
        geometry.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points.astype(np.float32)))
        geometry.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(faces), 3, dtype=np.int32)))
        geometry.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(faces.astype(np.int32).ravel()))
        geometry.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    elif shape.kind == "box":
        geometry = UsdGeom.Cube.Define(stage, path)
        geometry.CreateSizeAttr(1.0)
    elif shape.kind == "cylinder":
        geometry = UsdGeom.Cylinder.Define(stage, path)
        geometry.CreateRadiusAttr(shape.size[0])
        geometry.CreateHeightAttr(shape.size[1])
        geometry.CreateAxisAttr(UsdGeom.Tokens.z)
    else:
        geometry = UsdGeom.Sphere.Define(stage, path)
        geometry.CreateRadiusAttr(shape.size[0])
    set_transform(geometry, shape.to_link)
    if shape.kind == "box":
        geometry.AddScaleOp().Set(Gf.Vec3f(*shape.size))
    # A guide: it is not rendered, and still collides.
    geometry.CreatePurposeAttr(UsdGeom.Tokens.guide)
    return smaller


def make_collidable(prim: Usd.Prim, shape: ExportShape, material: str) -> None:
    """Make a prim collide; a mesh collides as its convex hull."""
    UsdPhysics.CollisionAPI.Apply(prim)
    if shape.kind == "mesh":
        UsdPhysics.MeshCollisionAPI.Apply(prim).CreateApproximationAttr(UsdPhysics.Tokens.convexHull)
    bound = UsdShade.Material(prim.GetStage().GetPrimAtPath(material))
    UsdShade.MaterialBindingAPI.Apply(prim).Bind(bound, UsdShade.Tokens.weakerThanDescendants, "physics")


def write_contact(prim: Usd.Prim, shape: ExportShape, rolling_m: float, timestep_s: float) -> None:
    """MuJoCo's terms of one collision shape, as in the MJCF: the object's own friction decides on any floor."""
    prim.AddAppliedSchema("MjcCollisionAPI")
    set_unregistered(prim, "mjc:condim", mujoco_options.ROLLING_DIMENSION if rolling_m > 0.0 else 3)
    set_unregistered(prim, "mjc:priority", 1)
    set_unregistered(prim, "mjc:solref", mujoco_options.solref(timestep_s))
    set_unregistered(prim, "mjc:solimp", mujoco_options.CONTACT_SOLIMP)
    if shape.kind == "mesh":
        prim.AddAppliedSchema("MjcMeshCollisionAPI")
        set_unregistered(prim, "mjc:inertia", "shell")


def set_transform(xform: UsdGeom.Xformable, to_parent: Array) -> None:
    """Give a prim its (4, 4) transform as a translation and an orientation, which physics engines can write back."""
    xform.AddTranslateOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Vec3d(*(float(v) for v in to_parent[:3, 3])))
    xform.AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Quatd(*wxyz_of(to_parent[:3, :3])))


def hull_data(hull: LimitedHull) -> dict[str, float | int]:
    """Custom data of a collision prim on the hull that it stands for."""
    return {
        "vertices_before": hull.vertices_before,
        "distance_m": round(hull.distance_m, 9),
        "volume_ratio": round(hull.volume_ratio, 6),
    }
