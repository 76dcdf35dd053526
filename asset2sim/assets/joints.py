"""One joint as authored, and which end of its range is closed."""

import math
from collections.abc import Mapping
from pathlib import Path

import yourdfpy

from asset2sim.assets.meshes.openness import DrawnTree, joint_ends
from asset2sim.assets.urdf.read import tree_joint
from asset2sim.physics.arrays import Array, floats_of
from asset2sim.physics.kinematics import rpy_of
from schemas.errors import AssetError
from schemas.features import JointFeatures
from schemas.finding import Finding, warning
from schemas.vocabulary import FailureMode, Stage


def read_joint(joint: yourdfpy.Joint, urdf: Path) -> JointFeatures:
    """One joint as authored, ends not yet known. Raises AssetError where a limited joint states no usable limits."""
    placed = tree_joint(joint)
    origin, axis = placed.child_to_parent, placed.axis
    limit, dynamics = joint.limit, joint.dynamics
    lower = None if limit is None else limit.lower
    upper = None if limit is None else limit.upper
    # A hinge without limits turns freely; a slider without them is given some.
    kind = "continuous" if joint.type == "revolute" and lower is None and upper is None else joint.type
    limited = kind in ("revolute", "prismatic")
    if limited and (lower is None) != (upper is None):
        problem = f"{urdf.name}: joint '{joint.name}' states one limit of two; state both lower and upper"
        raise AssetError(FailureMode.INVALID_JOINT_CONFIGURATION, "half_limits", problem, joint=joint.name)
    return JointFeatures(
        name=joint.name,
        type=kind,
        parent=joint.parent,
        child=joint.child,
        origin_xyz=floats_of(origin[:3, 3]),
        origin_rpy=floats_of(rpy_of(origin[:3, :3])),
        axis=floats_of(axis),
        axis_in_root=floats_of(axis),
        lower=lower if limited else None,
        upper=upper if limited else None,
        effort=None if limit is None else limit.effort,
        velocity=None if limit is None else limit.velocity,
        damping=None if dynamics is None else dynamics.damping,
        friction=None if dynamics is None else dynamics.friction,
        mimic=joint.mimic,
        closed=None,
        open=None,
        openness_confidence=0.0,
    )


def with_ends(joint: JointFeatures, drawn: DrawnTree, rest: Mapping[str, Array], diagonal: float) -> JointFeatures:
    """The joint with its axis in the root frame and its closed and open ends."""
    node = drawn.joint(joint.name)
    turned = (rest[joint.parent] @ node.child_to_parent)[:3, :3] @ node.axis
    changes: dict[str, object] = {"axis_in_root": floats_of(turned)}
    if joint.type == "continuous":
        changes |= {"closed": 0.0, "open": 0.0}
    elif joint.movable and joint.lower is not None and joint.upper is not None:
        # Validation repairs inverted limits; here they only bound the search.
        low, high = sorted((joint.lower, joint.upper))
        ends = joint_ends(drawn, node, low, high, diagonal)
        changes |= {"closed": ends.closed, "open": ends.open, "openness_confidence": ends.confidence}
    return joint.model_copy(update=changes)


LONGEST_RANGE_RAD = 3.0 * 2.0 * math.pi
"""Longest range that a hinge with limits is believed to have, rad: a screw cap comes off after three turns. As a
number it is 19: a range in degrees that is smaller than 19 is not recognised."""
LARGEST_DEGREES = 720.0
"""Largest limit that may be degrees; beyond it, the number stands for no limit at all."""

QUARTERS_SHARE = 1e-3
"""Share by which a limit may differ from a number of quarter turns that it is: a valve's 12.56 rad are two turns."""


def in_quarters(limit_rad: float) -> bool:
    """Whether a limit is a whole number of quarter turns in radians: such limits were meant as radians."""
    quarters = limit_rad / (math.pi / 2.0)
    whole = limit_rad.is_integer() and limit_rad != 0.0
    return (
        not whole
        and abs(limit_rad) <= LARGEST_DEGREES
        and abs(quarters - round(quarters)) <= QUARTERS_SHARE * abs(quarters)
    )


def believed_limits(joint: JointFeatures, longest_m: float) -> tuple[JointFeatures, Finding | None]:
    """The joint with an implausibly long hinge range read as degrees, or as none, and a finding; a slider without
    limits with those of the object's longest link, m; else unchanged, and None."""
    if joint.type == "prismatic" and joint.lower is None:
        message = (
            f"joint '{joint.name}' slides without limits; it may go {longest_m:.4g} m to either side, the "
            "length of the longest link: state lower and upper"
        )
        finding = warning(Stage.EXTRACT, "limits_supplied", message, joint=joint.name, value=longest_m)
        return joint.model_copy(update={"lower": -longest_m, "upper": longest_m}), finding
    if joint.type != "revolute" or joint.lower is None or joint.upper is None:
        return joint, None
    range_rad, largest = abs(joint.upper - joint.lower), max(abs(joint.lower), abs(joint.upper))
    if range_rad <= LONGEST_RANGE_RAD or all(in_quarters(end) for end in (joint.lower, joint.upper)):
        return joint, None
    if largest > LARGEST_DEGREES:
        code = "limits_unlimited"
        changes: dict[str, object] = {"type": "continuous", "lower": None, "upper": None}
        taken = "taken for none: write the joint as continuous, or state radians"
    else:
        lower, upper = math.radians(joint.lower), math.radians(joint.upper)
        code, changes = "limits_in_degrees", {"lower": lower, "upper": upper}
        taken = f"read as degrees, {lower:.4g} to {upper:.4g} rad: state radians"
    limits = f"limits {joint.lower:.4g} to {joint.upper:.4g} rad are {range_rad / math.tau:.3g} turns"
    where = {"joint": joint.name, "value": range_rad, "limit": LONGEST_RANGE_RAD}
    finding = warning(Stage.EXTRACT, code, f"joint '{joint.name}': {limits}; {taken}", **where)
    return joint.model_copy(update=changes), finding
