"""Collision shapes in USD: geometry that PhysX takes as it is written, and the schemas that make it collide."""

from pathlib import Path

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdPhysics, UsdShade, Vt

from asset2sim.assets import mujoco_options
from asset2sim.assets.exports.refined_object import ExportShape, wxyz_of
from asset2sim.assets.exports.usd_hulls import LimitedHull, limited_hull
from asset2sim.assets.exports.usd_joints import set_unregistered
from asset2sim.assets.meshes.load import load_mesh
from asset2sim.physics.arrays import Array

CUSTOM_DATA = "asset2sim"
"""Key of the custom data of the root layer and of collision prims that say what was made smaller."""


def write_shape(stage: Usd.Stage, shape: ExportShape, folder: Path, path: str) -> LimitedHull | None:
    """The geometry of one collision shape, in its link's frame. Returns the hull in its place if it had to be made
    smaller."""
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
