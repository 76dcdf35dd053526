"""Joints that follow others in USD: UsdPhysics has no schema for it, so PhysX's and Newton's are written by name."""

import math
from typing import TYPE_CHECKING

from asset2sim.assets.exports.usd_looks import PrimPaths
from schemas.features import Mimic

if TYPE_CHECKING:
    from pxr import Usd

PHYSX_AXIS = "rotX"
"""The axis of every joint of ours, in PhysX's words; a slider's mimic has an instance of the same name, since PhysX
takes the degree of freedom of a one-axis joint whatever the instance is called."""


def write_mimic(prim: "Usd.Prim", mimic: Mimic, names: PrimPaths, turns: bool, leader_turns: bool) -> None:
    """Bind a joint's prim to the joint that it follows. ``turns`` and ``leader_turns`` say which positions are angles,
    which USD has in degrees.

    ``PhysxMimicJointAPI`` (Isaac Sim) states q + gearing · q_leader + offset = 0, and ``NewtonMimicAPI`` (Newton, and
    MuJoCo's USD reader) q = coef0 + coef1 · q_leader.
    """
    from pxr import Sdf

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
