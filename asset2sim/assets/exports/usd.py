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

Hulls that are larger than PhysX takes to a GPU are made smaller here, and only here (``usd_hulls``); each says so in
its custom data, and the root layer sums them up in its own.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade

from asset2sim.assets.exports.refined_object import USD_NAME, ExportBody, ExportJoint, read_object, wxyz_of
from asset2sim.assets.exports.usd_collision import CUSTOM_DATA, collide, hull_data, place, write_shape
from asset2sim.assets.exports.usd_hulls import LimitedHull
from asset2sim.assets.exports.usd_looks import PrimPaths, write_looks
from asset2sim.assets.exports.visuals import looks_of
from asset2sim.assets.urdf.numbers import BIAS
from asset2sim.physics.arrays import Array
from schemas.features import Mimic
from schemas.overlay import PhysicsOverlay

GEOMETRY_NAME = "mobility_geometry.usdc"
"""The layer that holds the points: binary, so that the other one stays short enough to read."""


@dataclass(frozen=True)
class UsdExport:
    """A written export: its root layer, and the collision hulls that were made smaller in it."""

    path: Path
    limited: tuple[LimitedHull, ...]

    @property
    def distance_m(self) -> float:
        """The largest distance, m, of a given hull from the one in its place; 0 where none is replaced."""
        return max((hull.distance_m for hull in self.limited), default=0.0)

    @property
    def volume_ratio(self) -> float:
        """The least share of a given hull's volume that the one in its place has; 1 where none is replaced."""
        return min((hull.volume_ratio for hull in self.limited), default=1.0)


def export_usd(folder: Path, overlay: PhysicsOverlay) -> UsdExport:
    """Write ``mobility.usda`` and ``mobility_geometry.usdc`` into a refined folder. The default prim is the object, z
    up, in its initial state, its lowest collision point at z = 0. Raises what ``read_object`` raises."""
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
    material = write_material(stage, item.contact_friction, f"{names.top}/contact")
    poses = item.poses(item.initial)
    lift = np.eye(4)
    lift[2, 3] = item.height_to_stand(item.initial)
    limited: list[LimitedHull] = []
    for body in item.bodies.values():
        prim = write_body(stage, body, lift @ poses[body.name], names.links[body.name])
        prim.SetDisplayName(body.name)
        if body.name == item.root and not item.fixed:
            write_articulation(prim)
        for index, shape in enumerate(body.shapes):
            at = f"{names.links[body.name]}/collision_{index}"
            with Usd.EditContext(stage, geometry):
                smaller = write_shape(stage, shape, item.folder, at)
            collide(stage.GetPrimAtPath(at), shape, material)
            if smaller is not None:
                limited.append(smaller)
                stage.GetPrimAtPath(at).SetCustomDataByKey(CUSTOM_DATA, hull_data(smaller))
    filter_pairs(stage, item.passing, names.links)
    UsdGeom.Scope.Define(stage, f"{names.top}/joints")
    turning = {joint.name: joint.turns for joint in item.joints}
    for joint in item.joints:
        prim = write_joint(stage, joint, names)
        prim.SetDisplayName(joint.name)
        if joint.moves and joint.tree.mimic is not None:
            write_mimic(prim, joint.tree.mimic, names, turning[joint.name], turning[joint.tree.mimic.joint])
    if item.fixed:
        write_articulation(hold_root(stage, lift @ poses[item.root], names.links[item.root], names.base))
    with Usd.EditContext(stage, geometry):
        write_looks(stage, looks_of(item), item.folder, names)
    geometry.Export(str(geometry_path))
    # A copy, for a layer on a stage would look for its new sublayer at once, and not in the folder.
    root = Sdf.Layer.CreateAnonymous(".usda")
    root.TransferContent(stage.GetRootLayer())
    root.subLayerPaths[:] = [f"./{GEOMETRY_NAME}"]
    export = UsdExport(path, tuple(limited))
    root.customLayerData = {CUSTOM_DATA: summary_data(export)}
    root.Export(str(path))
    return export


def summary_data(export: UsdExport) -> dict[str, float | int]:
    """Custom data of the root layer on all hulls that were made smaller."""
    return {
        "hulls_limited": len(export.limited),
        "largest_distance_m": round(export.distance_m, 9),
        "least_volume_ratio": round(export.volume_ratio, 6),
    }


def hold_root(stage: Usd.Stage, to_object: Array, link: str, path: str) -> Usd.Prim:
    """A fixed joint at ``path`` that holds the root link to the world where it is written, ``to_object`` being its
    (4, 4) place in the object's prim, with which it moves when that is placed."""
    joint = UsdPhysics.FixedJoint.Define(stage, path)
    # Without a first body the frame is the world's; the object's prim, which is no body, is taken as where it stands.
    joint.CreateBody0Rel().SetTargets([stage.GetDefaultPrim().GetPath()])
    joint.CreateBody1Rel().SetTargets([link])
    joint.CreateLocalPos0Attr(Gf.Vec3f(*(float(v) for v in to_object[:3, 3])))
    joint.CreateLocalRot0Attr(Gf.Quatf(*wxyz_of(to_object[:3, :3])))
    joint.CreateLocalPos1Attr(Gf.Vec3f(0.0))
    joint.CreateLocalRot1Attr(Gf.Quatf(1.0))
    return joint.GetPrim()


def filter_pairs(stage: Usd.Stage, pairs: Sequence[tuple[str, ...]], links: Mapping[str, str]) -> None:
    """Have pairs of links, by their prims' paths, pass through each other."""
    for first in dict.fromkeys(pair[0] for pair in pairs):
        api = UsdPhysics.FilteredPairsAPI.Apply(stage.GetPrimAtPath(links[first]))
        api.CreateFilteredPairsRel().SetTargets([links[second] for other, second in pairs if other == first])


def write_articulation(prim: Usd.Prim) -> None:
    """Mark the object as one articulation with this root body, or this joint that holds it to the world, whose links
    collide with each other, except parent and child. On the object's prim, readers would choose a root by themselves:
    another link, with joints turned round."""
    UsdPhysics.ArticulationRootAPI.Apply(prim)
    prim.AddAppliedSchema("PhysxArticulationAPI")
    give(prim, "physxArticulation:enabledSelfCollisions", True)


def write_material(stage: Usd.Stage, friction: float, path: str) -> str:
    """The material of every contact: Coulomb friction, no bounce. Its path."""
    material = UsdShade.Material.Define(stage, path)
    api = UsdPhysics.MaterialAPI.Apply(material.GetPrim())
    api.CreateStaticFrictionAttr(friction)
    api.CreateDynamicFrictionAttr(friction)
    api.CreateRestitutionAttr(0.0)
    return path


def write_body(stage: Usd.Stage, body: ExportBody, to_world: Array, path: str) -> Usd.Prim:
    """One rigid body at its place in the initial state, with its mass, and its inertia by its principal axes."""
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


def write_joint(stage: Usd.Stage, joint: ExportJoint, names: PrimPaths) -> Usd.Prim:
    """One joint: frames whose x axis is the joint's, limits, the drive that is its spring and damper, dry friction, and
    its initial position."""
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
    if joint.effort is not None and joint.effort > 0.0:
        # In N·m also where the rest is per degree.
        drive.CreateMaxForceAttr(joint.effort)
    prim.AddAppliedSchema(f"PhysicsJointStateAPI:{word}")
    give(prim, f"state:{word}:physics:position", joint.initial * unit)
    give(prim, f"state:{word}:physics:velocity", 0.0)
    # PhysX from 5.6 on takes dry friction as a torque or force; its older coefficient has no unit and is switched off.
    prim.AddAppliedSchema("PhysxJointAPI")
    give(prim, "physxJoint:jointFriction", 0.0)
    # kg, or kg·m² also where angles are in degrees: PhysX adds it to the joint-space inertia as it is.
    if terms.armature > 0.0:
        give(prim, "physxJoint:armature", terms.armature)
    # PhysX has no such joint term: a user applies a mechanism's effort in each step.
    for name, value in zip(BIAS, terms.bias, strict=True) if terms.bias[0] != 0.0 else ():
        give(prim, f"asset2sim:{name}", value)
    prim.AddAppliedSchema(f"PhysxJointAxisAPI:{word}")
    give(prim, f"physxJointAxis:{word}:staticFrictionEffort", terms.friction)
    give(prim, f"physxJointAxis:{word}:dynamicFrictionEffort", terms.friction)
    # Newton's own name for the same. Its damping is left out: it would be added to the drive's.
    prim.AddAppliedSchema("NewtonJointAPI")
    give(prim, "newton:friction", terms.friction)
    return prim


def give(prim: Usd.Prim, name: str, value: float | bool) -> None:
    """Set an attribute of a schema that usd-core does not know, by name; its type is that of the value."""
    kind = Sdf.ValueTypeNames.Bool if isinstance(value, bool) else Sdf.ValueTypeNames.Float
    prim.CreateAttribute(name, kind, custom=False).Set(value)


def rotation_from_x(axis: Array) -> Array:
    """A (3, 3) rotation that takes x to the unit (3,) ``axis``, by the shortest way."""
    x, y, z = (float(v) for v in axis)
    if x < -1.0 + 1e-12:
        return np.diag([-1.0, -1.0, 1.0])
    cross = np.array([[0.0, -y, -z], [y, 0.0, 0.0], [z, 0.0, 0.0]])
    return np.asarray(np.eye(3) + cross + cross @ cross / (1.0 + x))


PHYSX_AXIS = "rotX"
"""The axis of every joint of ours, in PhysX's words; a slider's mimic has an instance of the same name, since PhysX
takes the degree of freedom of a one-axis joint whatever the instance is called."""


def write_mimic(prim: Usd.Prim, mimic: Mimic, names: PrimPaths, turns: bool, leader_turns: bool) -> None:
    """Bind a joint's prim to the joint that it follows: UsdPhysics has no schema for it. ``turns`` and ``leader_turns``
    say which positions are angles, which USD has in degrees.

    ``PhysxMimicJointAPI`` (Isaac Sim) states q + gearing · q_leader + offset = 0, and ``NewtonMimicAPI`` (Newton, and
    MuJoCo's USD reader) q = coef0 + coef1 · q_leader.
    """
    own, leader = (math.degrees(1.0) if angle else 1.0 for angle in (turns, leader_turns))
    ratio, offset = mimic.multiplier * own / leader, mimic.offset * own
    for schema, relation in (
        (f"PhysxMimicJointAPI:{PHYSX_AXIS}", f"physxMimicJoint:{PHYSX_AXIS}:referenceJoint"),
        ("NewtonMimicAPI", "newton:mimicJoint"),
    ):
        prim.AddAppliedSchema(schema)
        prim.CreateRelationship(relation, custom=False).SetTargets([names.joints[mimic.joint]])
    for name, value in (
        (f"physxMimicJoint:{PHYSX_AXIS}:gearing", -ratio),
        (f"physxMimicJoint:{PHYSX_AXIS}:offset", -offset),
        ("newton:mimicCoef0", offset),
        ("newton:mimicCoef1", ratio),
    ):
        prim.CreateAttribute(name, Sdf.ValueTypeNames.Float, custom=False).Set(value)
    token = prim.CreateAttribute(
        f"physxMimicJoint:{PHYSX_AXIS}:referenceJointAxis", Sdf.ValueTypeNames.Token, custom=False
    )
    token.Set(PHYSX_AXIS)
