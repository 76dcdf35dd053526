"""USD export beside the URDF: UsdPhysics bodies, joints with drives, and attributes for PhysX and Newton.

Written with ``usd-core`` itself, because no converter keeps the dynamics (each tried on a refined box with two lids):

- ``urdf-usd-converter`` 0.3.4 keeps mass, inertia, convex hulls, limits, and damping and friction in Newton's names;
  it loses springs, the initial state and contact friction, writes no drive and nothing that PhysX reads, fixes the root
  to the world, left out one of four visual meshes (texture indices out of range), and brings an OpenUSD build of its
  own that cannot be imported beside ``usd-core``.
- ``mujoco-usd-converter`` 0.8.0 also keeps springs, in MuJoCo's names; it loses the keyframe ("keys are not
  supported"), writes no drive, and pins MuJoCo below 3.17, where we run 4.
- ``newton`` 1.8.0 reads USD and writes none.

Units: metres, kilograms, seconds; angles in degrees, and so angular stiffness in N·m/deg and damping in N·m·s/deg.
"""

import math
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from asset2sim.assets.exports.looks import looks_of
from asset2sim.assets.exports.refined_object import ExportBody, ExportJoint, ExportShape, read_object, wxyz_of
from asset2sim.assets.exports.usd_looks import PrimPaths, write_looks
from asset2sim.assets.meshes.load import load_mesh
from asset2sim.physics.arrays import Array
from schemas.errors import UsageError
from schemas.overlay import PhysicsOverlay

if TYPE_CHECKING:
    from pxr import Usd, UsdGeom

USD_NAME = "mobility.usda"
GEOMETRY_NAME = "mobility_geometry.usdc"
"""The layer that holds the points: binary, so that the other one stays short enough to read."""


def require_usd() -> None:
    """Raise UsageError where ``usd-core`` is not installed, with what to install."""
    if find_spec("pxr") is None:
        raise UsageError("export 'usd' needs usd-core, which is not installed; pip install -c constraints.txt '.[usd]'")


def export_usd(folder: Path, overlay: PhysicsOverlay) -> Path:
    """Write ``mobility.usda`` and ``mobility_geometry.usdc`` into a refined folder; the former's path. The default prim
    is the object, z up, in its initial state, its lowest collision point at z = 0. Raises UsageError where ``usd-core``
    is missing, and what ``read_object`` raises."""
    require_usd()
    from pxr import Sdf, Usd, UsdGeom, UsdPhysics

    item = read_object(folder, overlay)
    path, geometry_path = folder / USD_NAME, folder / GEOMETRY_NAME
    for old in (path, geometry_path):
        old.unlink(missing_ok=True)
    geometry = Sdf.Layer.CreateAnonymous(".usdc")
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().subLayerPaths.append(geometry.identifier)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    names = PrimPaths(item)
    top = UsdGeom.Xform.Define(stage, names.top)
    stage.SetDefaultPrim(top.GetPrim())
    write_articulation(top.GetPrim())
    material = write_material(stage, item.contact_friction, f"{names.top}/contact")
    poses = item.poses(item.initial)
    lift = np.eye(4)
    lift[2, 3] = item.height_to_stand(item.initial)
    for body in item.bodies.values():
        prim = write_body(stage, body, lift @ poses[body.name], names.links[body.name])
        prim.SetDisplayName(body.name)
        with Usd.EditContext(stage, geometry):
            for index, shape in enumerate(body.shapes):
                write_shape(stage, shape, item.folder, f"{names.links[body.name]}/collision_{index}")
        for index, shape in enumerate(body.shapes):
            collide(stage.GetPrimAtPath(f"{names.links[body.name]}/collision_{index}"), shape, material)
    UsdGeom.Scope.Define(stage, f"{names.top}/joints")
    for joint in item.joints:
        write_joint(stage, joint, names).SetDisplayName(joint.name)
    with Usd.EditContext(stage, geometry):
        write_looks(stage, looks_of(item), item.folder, names)
    geometry.Export(str(geometry_path))
    # A copy, for a layer on a stage would look for its new sublayer at once, and not in the folder.
    root = Sdf.Layer.CreateAnonymous(".usda")
    root.TransferContent(stage.GetRootLayer())
    root.subLayerPaths[:] = [f"./{GEOMETRY_NAME}"]
    root.Export(str(path))
    return path


def write_articulation(prim: "Usd.Prim") -> None:
    """Mark the object as one articulation whose links collide with each other, except parent and child."""
    from pxr import UsdPhysics

    UsdPhysics.ArticulationRootAPI.Apply(prim)
    prim.AddAppliedSchema("PhysxArticulationAPI")
    give(prim, "physxArticulation:enabledSelfCollisions", True)


def write_material(stage: "Usd.Stage", friction: float, path: str) -> str:
    """The material of every contact: Coulomb friction, no bounce. Its path."""
    from pxr import UsdPhysics, UsdShade

    material = UsdShade.Material.Define(stage, path)
    api = UsdPhysics.MaterialAPI.Apply(material.GetPrim())
    api.CreateStaticFrictionAttr(friction)
    api.CreateDynamicFrictionAttr(friction)
    api.CreateRestitutionAttr(0.0)
    return path


def write_body(stage: "Usd.Stage", body: ExportBody, to_world: Array, path: str) -> "Usd.Prim":
    """One rigid body at its place in the initial state, with its mass, and its inertia by its principal axes."""
    from pxr import Gf, UsdGeom, UsdPhysics

    xform = UsdGeom.Xform.Define(stage, path)
    place(xform, to_world)
    prim = xform.GetPrim()
    UsdPhysics.RigidBodyAPI.Apply(prim)
    prim.AddAppliedSchema("PhysxRigidBodyAPI")
    for name in ("linearDamping", "angularDamping"):
        # PhysX adds drag to bodies by default; only the joints' damping is wanted.
        give(prim, f"physxRigidBody:{name}", 0.0)
    moments, axes = np.linalg.eigh(body.inertia)
    if np.linalg.det(axes) < 0.0:
        axes[:, 2] *= -1.0
    w, x, y, z = wxyz_of(axes)
    mass = UsdPhysics.MassAPI.Apply(prim)
    mass.CreateMassAttr(body.mass_kg)
    mass.CreateCenterOfMassAttr(Gf.Vec3f(*(float(v) for v in body.com)))
    mass.CreateDiagonalInertiaAttr(Gf.Vec3f(*(float(v) for v in moments)))
    mass.CreatePrincipalAxesAttr(Gf.Quatf(w, x, y, z))
    return prim


def write_shape(stage: "Usd.Stage", shape: ExportShape, folder: Path, path: str) -> None:
    """The geometry of one collision shape, in its link's frame."""
    from pxr import Gf, UsdGeom, Vt

    geometry: UsdGeom.Gprim
    if shape.kind == "mesh":
        mesh = load_mesh(folder / shape.file)
        geometry = UsdGeom.Mesh.Define(stage, path)
        scale = np.ones(3) if shape.scale is None else shape.scale
        points = np.asarray(mesh.vertices, dtype=float) * scale
        faces = np.asarray(mesh.faces) if np.prod(scale) > 0.0 else np.asarray(mesh.faces)[:, ::-1]
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
    place(geometry, shape.to_link)
    if shape.kind == "box":
        geometry.AddScaleOp().Set(Gf.Vec3f(*shape.size))
    # A guide: it is not rendered, and still collides.
    geometry.CreatePurposeAttr(UsdGeom.Tokens.guide)


def collide(prim: "Usd.Prim", shape: ExportShape, material: str) -> None:
    """Make a prim collide; a mesh collides as its convex hull."""
    from pxr import UsdPhysics, UsdShade

    UsdPhysics.CollisionAPI.Apply(prim)
    if shape.kind == "mesh":
        UsdPhysics.MeshCollisionAPI.Apply(prim).CreateApproximationAttr(UsdPhysics.Tokens.convexHull)
    bound = UsdShade.Material(prim.GetStage().GetPrimAtPath(material))
    UsdShade.MaterialBindingAPI.Apply(prim).Bind(bound, UsdShade.Tokens.weakerThanDescendants, "physics")


def write_joint(stage: "Usd.Stage", joint: ExportJoint, names: PrimPaths) -> "Usd.Prim":
    """One joint: frames whose x axis is the joint's, limits, the drive that is its spring and damper, dry friction, and
    its initial position."""
    from pxr import Gf, UsdPhysics

    path = names.joints[joint.name]
    kind = UsdPhysics.RevoluteJoint if joint.turns else UsdPhysics.PrismaticJoint
    usd_joint = (kind if joint.moves else UsdPhysics.FixedJoint).Define(stage, path)
    usd_joint.CreateBody0Rel().SetTargets([names.links[joint.tree.parent]])
    usd_joint.CreateBody1Rel().SetTargets([names.links[joint.tree.child]])
    turn = rotation_from_x(joint.tree.axis) if joint.moves else np.eye(3)
    frame0 = joint.tree.child_to_parent.copy()
    frame0[:3, :3] = frame0[:3, :3] @ turn
    usd_joint.CreateLocalPos0Attr(Gf.Vec3f(*(float(v) for v in frame0[:3, 3])))
    usd_joint.CreateLocalRot0Attr(Gf.Quatf(*wxyz_of(frame0[:3, :3])))
    usd_joint.CreateLocalPos1Attr(Gf.Vec3f(0.0))
    usd_joint.CreateLocalRot1Attr(Gf.Quatf(*wxyz_of(turn)))
    prim = usd_joint.GetPrim()
    if not joint.moves:
        return prim
    usd_joint.CreateAxisAttr(UsdPhysics.Tokens.x)
    unit = math.degrees(1.0) if joint.turns else 1.0
    if joint.lower is not None and joint.upper is not None:
        usd_joint.CreateLowerLimitAttr(joint.lower * unit)
        usd_joint.CreateUpperLimitAttr(joint.upper * unit)
    word = "angular" if joint.turns else "linear"
    terms = joint.dynamics
    drive = UsdPhysics.DriveAPI.Apply(prim, word)
    drive.CreateTypeAttr(UsdPhysics.Tokens.force)
    drive.CreateStiffnessAttr(terms.stiffness / unit)
    drive.CreateDampingAttr(terms.damping / unit)
    drive.CreateTargetPositionAttr(terms.spring_reference * unit if terms.stiffness > 0.0 else 0.0)
    drive.CreateTargetVelocityAttr(0.0)
    prim.AddAppliedSchema(f"PhysicsJointStateAPI:{word}")
    give(prim, f"state:{word}:physics:position", joint.initial * unit)
    give(prim, f"state:{word}:physics:velocity", 0.0)
    # PhysX from 5.6 on takes dry friction as a torque or force; its older coefficient has no unit and is switched off.
    prim.AddAppliedSchema("PhysxJointAPI")
    give(prim, "physxJoint:jointFriction", 0.0)
    # kg, or kg·m² also where angles are in degrees: PhysX adds it to the joint-space inertia as it is.
    if terms.armature > 0.0:
        give(prim, "physxJoint:armature", terms.armature)
    prim.AddAppliedSchema(f"PhysxJointAxisAPI:{word}")
    give(prim, f"physxJointAxis:{word}:staticFrictionEffort", terms.friction)
    give(prim, f"physxJointAxis:{word}:dynamicFrictionEffort", terms.friction)
    # Newton's own name for the same. Its damping is left out: it would be added to the drive's.
    prim.AddAppliedSchema("NewtonJointAPI")
    give(prim, "newton:friction", terms.friction)
    return prim


def give(prim: "Usd.Prim", name: str, value: float | bool) -> None:
    """Set an attribute of a schema that usd-core does not know, by name; its type is that of the value."""
    from pxr import Sdf

    kind = Sdf.ValueTypeNames.Bool if isinstance(value, bool) else Sdf.ValueTypeNames.Float
    prim.CreateAttribute(name, kind, custom=False).Set(value)


def rotation_from_x(axis: Array) -> Array:
    """A (3, 3) rotation that takes x to the unit (3,) ``axis``, by the shortest way."""
    x, y, z = (float(v) for v in axis)
    if x < -1.0 + 1e-12:
        return np.diag([-1.0, -1.0, 1.0])
    cross = np.array([[0.0, -y, -z], [y, 0.0, 0.0], [z, 0.0, 0.0]])
    return np.asarray(np.eye(3) + cross + cross @ cross / (1.0 + x))


def place(xform: "UsdGeom.Xformable", to_parent: Array) -> None:
    """Give a prim its (4, 4) transform as a translation and an orientation, which physics engines can write back."""
    from pxr import Gf, UsdGeom

    xform.AddTranslateOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Vec3d(*(float(v) for v in to_parent[:3, 3])))
    xform.AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Quatd(*wxyz_of(to_parent[:3, :3])))
