"""Joints in USD, each with its limits, friction and mechanism in the words of PhysX, Newton and MuJoCo.

PhysX has springs and dampers as a drive; MuJoCo reads no drive, and has both as passive terms. Newton reads both and
would add them up. So the stage says them once, by the variant set ``Physics`` of the default prim, named as in Isaac
Sim's asset structure: ``physx``, the default, has drives and joint states; ``mujoco`` has passive terms, MuJoCo's
constraints, and the actuators that are mechanisms. What adds nothing to another is outside both.

Units of MuJoCo's attributes are MJCF's: damping N·m·s/rad, stiffness N·m/rad, and angles in degrees, as a stage without
``mjc:compiler:angle`` has them. Its joint has the value ``mjc:ref`` where the bodies stand; the frames of that variant
are turned so that Newton, which takes the frames instead, has its zero there too.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, Vt

from asset2sim.assets import mujoco_options
from asset2sim.assets.exports.refined_object import ExportJoint, ExportObject, wxyz_of
from asset2sim.assets.exports.usd_looks import PrimPaths
from asset2sim.assets.urdf.numbers import BIAS
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import joint_motion

VARIANTS, PHYSX, MUJOCO = "Physics", "physx", "mujoco"
"""The variant set of the default prim and its variants."""
PHYSX_AXIS = "rotX"
"""The axis of every joint of ours, in PhysX's words; a slider's mimic has an instance of the same name, since PhysX
takes the degree of freedom of a one-axis joint whatever the instance is called."""


def write_joints(stage: Usd.Stage, item: ExportObject, names: PrimPaths, timestep_s: float) -> None:
    """Define every joint, and what differs between the variants; ``physx`` is selected at the end."""
    UsdGeom.Scope.Define(stage, f"{names.top}/joints")
    moving = [(joint, write_joint(stage, joint, names)) for joint in item.joints]
    moving = [(joint, prim) for joint, prim in moving if joint.moves]
    turning = {joint.name: joint.turns for joint, _ in moving}
    variants = stage.GetDefaultPrim().GetVariantSets().AddVariantSet(VARIANTS)
    for variant in (MUJOCO, PHYSX):
        variants.AddVariant(variant)
        variants.SetVariantSelection(variant)
        zeros = item.initial if variant == MUJOCO else dict.fromkeys(item.initial, 0.0)
        with variants.GetVariantEditContext():
            for joint, prim in moving:
                write_frame(prim, joint, zeros[joint.name])
                if variant == MUJOCO:
                    write_passive(prim, joint, timestep_s)
                    write_mechanism(stage, joint, prim, names)
                else:
                    write_drive(prim, joint)
                if joint.tree.mimic is not None:
                    write_mimic(prim, joint, names, turning, zeros)


def write_joint(stage: Usd.Stage, joint: ExportJoint, names: PrimPaths) -> Usd.Prim:
    """One joint: its bodies, limits, armature and dry friction; a fixed one with its frames."""
    path = names.joints[joint.name]
    kind = UsdPhysics.RevoluteJoint if joint.turns else UsdPhysics.PrismaticJoint
    usd_joint = (kind if joint.moves else UsdPhysics.FixedJoint).Define(stage, path)
    usd_joint.CreateBody0Rel().SetTargets([names.links[joint.tree.parent]])
    usd_joint.CreateBody1Rel().SetTargets([names.links[joint.tree.child]])
    prim = usd_joint.GetPrim()
    prim.SetDisplayName(joint.name)
    usd_joint.CreateLocalPos1Attr(Gf.Vec3f(0.0))
    usd_joint.CreateLocalRot1Attr(Gf.Quatf(*wxyz_of(axis_frame(joint))))
    if not joint.moves:
        write_frame(prim, joint, 0.0)
        return prim
    usd_joint.CreateAxisAttr(UsdPhysics.Tokens.x)
    unit = unit_of(joint.turns)
    if joint.lower is not None and joint.upper is not None:
        usd_joint.CreateLowerLimitAttr(joint.lower * unit)
        usd_joint.CreateUpperLimitAttr(joint.upper * unit)
    instance, terms = instance_name(joint), joint.dynamics
    # PhysX from 5.6 on takes dry friction as a torque or force; its older coefficient has no unit and is switched off.
    prim.AddAppliedSchema("PhysxJointAPI")
    set_unregistered(prim, "physxJoint:jointFriction", 0.0)
    # PhysX has no such joint term: a user applies a mechanism's effort in each step.
    for name, value in zip(BIAS, terms.bias, strict=True) if terms.bias[0] != 0.0 else ():
        set_unregistered(prim, f"asset2sim:{name}", value)
    prim.AddAppliedSchema(f"PhysxJointAxisAPI:{instance}")
    set_unregistered(prim, f"physxJointAxis:{instance}:staticFrictionEffort", terms.friction)
    set_unregistered(prim, f"physxJointAxis:{instance}:dynamicFrictionEffort", terms.friction)
    prim.AddAppliedSchema("NewtonJointAPI")
    set_unregistered(prim, "newton:friction", terms.friction)
    # kg, or kg·m² also where angles are in degrees: it is added to the joint-space inertia as it is.
    if terms.armature > 0.0:
        set_unregistered(prim, "physxJoint:armature", terms.armature)
        set_unregistered(prim, "newton:armature", terms.armature)
    return prim


def write_frame(prim: Usd.Prim, joint: ExportJoint, zero: float) -> None:
    """The joint's frame in its parent, with its position zero where the URDF's is ``zero`` (rad or m)."""
    frame = joint.tree.child_to_parent @ joint_motion(joint.tree, zero)
    usd_joint = UsdPhysics.Joint(prim)
    usd_joint.CreateLocalPos0Attr(Gf.Vec3f(*(float(v) for v in frame[:3, 3])))
    usd_joint.CreateLocalRot0Attr(Gf.Quatf(*wxyz_of(frame[:3, :3] @ axis_frame(joint))))


def write_drive(prim: Usd.Prim, joint: ExportJoint) -> None:
    """Spring and damper as a drive, and the initial position."""
    unit, instance, terms = unit_of(joint.turns), instance_name(joint), joint.dynamics
    drive = UsdPhysics.DriveAPI.Apply(prim, instance)
    drive.CreateTypeAttr(UsdPhysics.Tokens.force)
    drive.CreateStiffnessAttr(terms.stiffness / unit)
    drive.CreateDampingAttr(terms.damping / unit)
    drive.CreateTargetPositionAttr(terms.spring_reference * unit if terms.stiffness > 0.0 else 0.0)
    drive.CreateTargetVelocityAttr(0.0)
    if joint.effort is not None and joint.effort > 0.0:
        # In N·m also where the rest is per degree.
        drive.CreateMaxForceAttr(joint.effort)
    prim.AddAppliedSchema(f"PhysicsJointStateAPI:{instance}")
    set_unregistered(prim, f"state:{instance}:physics:position", joint.initial * unit)
    set_unregistered(prim, f"state:{instance}:physics:velocity", 0.0)


def write_passive(prim: Usd.Prim, joint: ExportJoint, timestep_s: float) -> None:
    """Spring, damper, friction, armature and constraints of a joint as MJCF has them."""
    unit, terms, reference = unit_of(joint.turns), joint.dynamics, mujoco_options.solref(timestep_s)
    stiff = mujoco_options.ARMATURE_LIMIT_SOLIMP if terms.armature > 0.0 else mujoco_options.LIMIT_SOLIMP
    prim.AddAppliedSchema("MjcJointAPI")
    set_unregistered(prim, "mjc:ref", joint.initial * unit)
    set_unregistered(prim, "mjc:damping", terms.damping)
    set_unregistered(prim, "mjc:frictionloss", terms.friction)
    set_unregistered(prim, "mjc:armature", terms.armature)
    if terms.stiffness > 0.0:
        set_unregistered(prim, "mjc:stiffness", terms.stiffness)
        set_unregistered(prim, "mjc:springref", terms.spring_reference * unit)
    for name, value in (("reflimit", reference), ("implimit", stiff), ("reffriction", reference),
                        ("impfriction", mujoco_options.FRICTION_SOLIMP)):  # fmt: skip
        set_unregistered(prim, f"mjc:sol{name}", value)
    if joint.effort is not None and joint.effort > 0.0:
        # MuJoCo counts in what a mechanism exerts.
        set_unregistered(prim, "mjc:actuatorfrcrange:min", min(terms.bias[2], 0.0) - joint.effort)
        set_unregistered(prim, "mjc:actuatorfrcrange:max", max(terms.bias[3], 0.0) + joint.effort)
    # Newton's own passive term, for those who read the variant without MuJoCo's names; per degree where it turns.
    set_unregistered(prim, "newton:damping", terms.damping / unit)


def write_mechanism(stage: Usd.Stage, joint: ExportJoint, prim: Usd.Prim, names: PrimPaths) -> None:
    """A mechanism's effort on its joint (a seal, a catch) as an actuator that no control moves, as in the MJCF."""
    slope, none_at, least, most, period = joint.dynamics.bias
    if slope == 0.0 or period > 0.0:
        return
    actuator = stage.DefinePrim(f"{names.top}/mechanisms/{prim.GetName()}", "MjcActuator")
    actuator.CreateRelationship("mjc:target", custom=False).SetTargets([names.joints[joint.name]])
    set_unregistered(actuator, "mjc:gainType", "fixed")
    set_unregistered(actuator, "mjc:gainPrm", [0.0] * 10)
    set_unregistered(actuator, "mjc:biasType", "affine")
    set_unregistered(actuator, "mjc:biasPrm", [-slope * none_at, slope, *[0.0] * 8])
    set_unregistered(actuator, "mjc:forceRange:min", least)
    set_unregistered(actuator, "mjc:forceRange:max", most)


def write_mimic(
    prim: Usd.Prim, joint: ExportJoint, names: PrimPaths, turning: Mapping[str, bool], zeros: Mapping[str, float]
) -> None:
    """Bind a joint to the one that it follows: UsdPhysics has no schema for it. ``turning`` says which positions are
    angles, which USD has in degrees, ``zeros`` where each position is zero in the variant.

    ``PhysxMimicJointAPI`` (Isaac Sim) states q + gearing · q_leader + offset = 0, and ``NewtonMimicAPI`` (Newton, and
    MuJoCo's USD reader) q = coef0 + coef1 · q_leader.
    """
    mimic = joint.tree.mimic
    assert mimic is not None
    own, leader = unit_of(joint.turns), unit_of(turning[mimic.joint])
    ratio = mimic.multiplier * own / leader
    offset = (mimic.offset + mimic.multiplier * zeros[mimic.joint] - zeros[joint.name]) * own
    for schema, relation in (
        (f"PhysxMimicJointAPI:{PHYSX_AXIS}", f"physxMimicJoint:{PHYSX_AXIS}:referenceJoint"),
        ("NewtonMimicAPI", "newton:mimicJoint"),
    ):
        prim.AddAppliedSchema(schema)
        prim.CreateRelationship(relation, custom=False).SetTargets([names.joints[mimic.joint]])
    set_unregistered(prim, f"physxMimicJoint:{PHYSX_AXIS}:gearing", -ratio)
    set_unregistered(prim, f"physxMimicJoint:{PHYSX_AXIS}:offset", -offset)
    set_unregistered(prim, f"physxMimicJoint:{PHYSX_AXIS}:referenceJointAxis", PHYSX_AXIS)
    set_unregistered(prim, "newton:mimicCoef0", offset)
    set_unregistered(prim, "newton:mimicCoef1", ratio)


def set_unregistered(prim: Usd.Prim, name: str, value: bool | int | float | str | Sequence[float]) -> None:
    """Set an attribute of a schema that usd-core does not know, by name. MuJoCo's are uniform and in double precision,
    the others' vary and are single."""
    kinds, mujoco = Sdf.ValueTypeNames, name.startswith("mjc:")
    number = kinds.Double if mujoco else kinds.Float
    kind = next((found for sort, found in ((bool, kinds.Bool), (int, kinds.Int), (float, number), (str, kinds.Token))
                 if isinstance(value, sort)), kinds.DoubleArray)  # fmt: skip
    variability = Sdf.VariabilityUniform if mujoco else Sdf.VariabilityVarying
    attribute = prim.CreateAttribute(name, kind, custom=False, variability=variability)
    attribute.Set(Vt.DoubleArray(value) if kind == kinds.DoubleArray else value)


def unit_of(turns: bool) -> float:
    """USD's units in one of ours: degrees in a radian, or metres."""
    return math.degrees(1.0) if turns else 1.0


def instance_name(joint: ExportJoint) -> str:
    """The instance of the drive and state schemas that a joint of its kind takes."""
    return "angular" if joint.turns else "linear"


def axis_frame(joint: ExportJoint) -> Array:
    """(3, 3) frame whose x axis is the joint's."""
    return rotation_from_x(joint.tree.axis) if joint.moves else np.eye(3)


def rotation_from_x(axis: Array) -> Array:
    """A (3, 3) rotation that takes x to the unit (3,) ``axis``, by the shortest way."""
    x, y, z = (float(v) for v in axis)
    if x < -1.0 + 1e-12:
        return np.diag([-1.0, -1.0, 1.0])
    cross = np.array([[0.0, -y, -z], [y, 0.0, 0.0], [z, 0.0, 0.0]])
    return np.asarray(np.eye(3) + cross + cross @ cross / (1.0 + x))
