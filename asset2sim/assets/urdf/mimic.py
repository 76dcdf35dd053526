"""Joints that follow others: chains of ``<mimic>`` resolved, unusable ones found, and ranges that fit together."""

import math
from collections.abc import Mapping, Sequence

from lxml.etree import _Element as Element

from asset2sim.assets.urdf.numbers import info, warning
from schemas.features import JointFeatures, Mimic
from schemas.finding import Finding

MOVING = ("revolute", "continuous", "prismatic")
LEAST_RATIO, LARGEST_RATIO = 1e-9, 1e9
"""Bounds of a mimic's multiplier and, above, of its offset, rad or m."""
SAME_SHARE = 1e-3
"""Share of a leader's range by which a follower's limits may fall short of it by rounding."""


def read_mimics(robot: Element) -> dict[str, Mimic]:
    """Joint → what it follows, chains resolved to the joint that follows none; unusable ones are left out."""
    joints = {str(joint.get("name")): joint for joint in robot.findall("joint")}
    found = {name: last_leader(name, joints) for name, joint in joints.items() if joint.find("mimic") is not None}
    return {name: mimic for name, mimic in found.items() if isinstance(mimic, Mimic)}


def last_leader(name: str, joints: Mapping[str, Element]) -> Mimic | str:
    """The joint that the named one follows in the end, or why it cannot."""
    multiplier, offset, at, seen = 1.0, 0.0, name, [name]
    while (mimic := joints[at].find("mimic")) is not None:
        leader = str(mimic.get("joint"))
        try:
            ratio, shift = (float(mimic.get(key) or default) for key, default in (("multiplier", 1), ("offset", 0)))
        except ValueError:
            return f"the mimic of '{at}' has a multiplier or offset that is no number"
        if not (LEAST_RATIO <= abs(ratio) <= LARGEST_RATIO and abs(shift) <= LARGEST_RATIO):
            return f"the mimic of '{at}' has the multiplier {ratio:g} and the offset {shift:g}"
        if leader not in joints:
            return f"'{leader}' is no joint"
        if leader in seen:
            return "it follows itself" if leader == name else f"'{leader}' follows itself"
        if (
            joints[leader].get("type") not in MOVING
            or joints[at].get("type") not in MOVING
            or has_no_range(joints[leader])
        ):
            return f"'{leader}' does not move" if joints[at].get("type") in MOVING else f"'{at}' does not move"
        multiplier, offset, at = multiplier * ratio, offset + multiplier * shift, leader
        seen.append(at)
    return Mimic(joint=at, multiplier=multiplier, offset=offset)


def has_no_range(joint: Element) -> bool:
    """Whether a joint's limits are equal, so that it is fixed."""
    limit = joint.find("limit")
    ends = () if limit is None else (limit.get("lower"), limit.get("upper"))
    return joint.get("type") != "continuous" and None not in ends and len(set(map(str, ends))) == 1 and bool(ends)


def drop_unusable_mimics(robot: Element) -> list[Finding]:
    """Remove mimics that mean nothing, at which engines err; a finding for each, and for each that is honoured."""
    joints = {str(joint.get("name")): joint for joint in robot.findall("joint")}
    found = {name: last_leader(name, joints) for name, joint in joints.items() if joint.find("mimic") is not None}
    findings = []
    for name, problem in found.items():
        if isinstance(problem, str):
            mimic = joints[name].find("mimic")
            assert mimic is not None
            joints[name].remove(mimic)
            message = f"joint '{name}' is to follow '{mimic.get('joint')}', but {problem}"
            message += "; it moves by itself: mend its <mimic>"
            findings.append(warning(code="mimic_unusable", message=message, joint=name))
        else:
            moved = f"{problem.multiplier:g} × '{problem.joint}'" + (f" + {problem.offset:g}" if problem.offset else "")
            message = f"joint '{name}' follows: its position is {moved}, here and in what is written"
            findings.append(info(code="mimic", message=message, joint=name))
    return findings


def coupled(joints: Sequence[JointFeatures]) -> tuple[list[JointFeatures], list[Finding]]:
    """The joints with ranges that fit: a leader goes no further than its followers can, and these exactly as far as it
    takes them. A finding for every range that is narrowed so."""
    by_name = {joint.name: joint for joint in joints}
    findings: list[Finding] = []
    for joint in joints:
        if joint.mimic is not None:
            leader, found = narrowed(by_name[joint.mimic.joint], joint, joint.mimic)
            by_name[leader.name] = leader
            findings += found
    for name, joint in by_name.items():
        if joint.mimic is not None:
            leader = by_name[joint.mimic.joint]
            lower, upper = follower_range(joint.mimic, leader.lower, leader.upper)
            limited = joint.type != "continuous" and lower is not None
            by_name[name] = joint.model_copy(
                update={"lower": lower if limited else None, "upper": upper if limited else None}
            )
    return list(by_name.values()), findings


def narrowed(leader: JointFeatures, joint: JointFeatures, mimic: Mimic) -> tuple[JointFeatures, list[Finding]]:
    """A leader within what the limits of one follower allow; unchanged where these allow nothing of its range."""
    if joint.lower is None or joint.upper is None:
        return leader, []
    low, high = sorted((mimic.leader_at(joint.lower), mimic.leader_at(joint.upper)))
    own = (-math.inf, math.inf)
    if leader.lower is not None and leader.upper is not None:
        own = min(leader.lower, leader.upper), max(leader.lower, leader.upper)
    slack = SAME_SHARE * (own[1] - own[0]) if math.isfinite(own[1]) else 0.0
    if low <= own[0] + slack and high >= own[1] - slack:
        return leader, []
    lower, upper = max(low, own[0]), min(high, own[1])
    where = f"joint '{joint.name}' follows '{leader.name}', and its limits allow that one {low:.4g} to {high:.4g}"
    stated = "" if math.isinf(own[0]) else f" of {own[0]:.4g} to {own[1]:.4g}"
    if upper <= lower:
        message = f"{where}, nothing{stated}; they are replaced by where its leader takes it: mend one of the two"
        return leader, [warning(code="mimic_limits_apart", message=message, joint=joint.name)]
    message = f"{where}{stated}: '{leader.name}' is limited to {lower:.4g} to {upper:.4g}"
    kind = "revolute" if leader.type == "continuous" else leader.type
    changed = leader.model_copy(update={"type": kind, "lower": lower, "upper": upper})
    return changed, [warning(code="mimic_limits", message=message, joint=leader.name, value=upper - lower)]


def follower_range(mimic: Mimic, lower: float | None, upper: float | None) -> tuple[float | None, float | None]:
    """The range of a follower whose leader has this one; none where the leader has none."""
    if lower is None or upper is None:
        return None, None
    first, second = sorted((mimic.at(lower), mimic.at(upper)))
    return first, second


def with_followed_ends(joints: Sequence[JointFeatures]) -> list[JointFeatures]:
    """The joints, followers with the closed and open ends that their leaders' have."""
    by_name = {joint.name: joint for joint in joints}

    def ended(joint: JointFeatures) -> JointFeatures:
        if joint.mimic is None:
            return joint
        leader = by_name[joint.mimic.joint]
        ends = {
            key: None if end is None else joint.mimic.at(end)
            for key, end in (("closed", leader.closed), ("open", leader.open))
        }
        return joint.model_copy(update={**ends, "openness_confidence": leader.openness_confidence})

    return [ended(joint) for joint in joints]
