"""Joints of a URDF brought to the types that every engine has: fixed, hinge, slider; limits as they are meant."""

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
from lxml import etree
from lxml.etree import _Element as Element

from asset2sim.assets.urdf.numbers import info, warning
from asset2sim.physics.arrays import Array
from schemas.errors import AssetError
from schemas.finding import Finding
from schemas.vocabulary import FailureMode

NO_BOUND = re.compile(r"[+-]?(inf|infinity)|nan", re.IGNORECASE)
"""A number that bounds nothing."""


def without_infinite_limits(robot: Element) -> list[Finding]:
    """Make a hinge with infinite limits continuous, with a finding; unbounded efforts and speeds are not stated."""
    findings = []
    for joint in robot.findall("joint"):
        limit = joint.find("limit")
        if limit is None:
            continue
        for key in ("effort", "velocity"):
            if NO_BOUND.fullmatch(limit.get(key, "").strip()):
                del limit.attrib[key]
        ends = [limit.get(key, "").strip() for key in ("lower", "upper")]
        if joint.get("type") == "revolute" and all(NO_BOUND.fullmatch(end) for end in ends):
            joint.set("type", "continuous")
            for key in ("lower", "upper"):
                del limit.attrib[key]
            message = f"joint '{joint.get('name')}': limits {ends[0]} to {ends[1]} are taken for none"
            findings.append(warning(code="limits_unlimited", message=message, joint=str(joint.get("name"))))
    return findings


def settle_joint_types(path: Path, robot: Element) -> list[Finding]:
    """Bring planar, spherical and floating joints to types that engines move; a finding for each.

    A planar joint becomes two sliders and a hinge about the plane's normal, a spherical one (Bullet's) three hinges. A
    root without a shape on which the rest
    floats is removed with the joint: they say only that the object is free. Any other part that floats is held where
    it stands, as the free parts of other formats' files are: ``--split`` makes it an object of its own. Raises
    AssetError (invalid_joint_configuration) for several objects that nothing holds.
    """
    findings = []
    children = {child.get("link") for child in robot.iterfind("joint/child")}
    empty = {
        str(link.get("name"))
        for link in robot.findall("link")
        if link.find("visual") is None and link.find("collision") is None
    }
    for joint in robot.findall("joint"):
        kind, name = str(joint.get("type")), str(joint.get("name"))
        parent, child = (str(end.get("link")) for tag in ("parent", "child") if (end := joint.find(tag)) is not None)
        if kind in IN_STEPS:
            steps, said = IN_STEPS[kind]
            in_steps(robot, joint, steps(joint))
            etree.SubElement(robot, "disable_collisions", link1=parent, link2=child, reason="Adjacent")
            message = f"joint '{name}': type '{kind}' is {said}"
            findings.append(info(code="joint_in_steps", message=message, joint=name))
        if kind != "floating":
            continue
        beside = {str(other.get("type")) for other in robot.iterfind(f"joint/parent[@link='{parent}']/..")}
        alone = len(robot.findall(f"joint/parent[@link='{parent}']")) == 1
        if parent not in children and parent in empty and not alone and beside == {"floating"}:
            problem = f"{path.name}: joint '{name}': it has several objects that nothing holds: cut it by --split"
            raise AssetError(FailureMode.INVALID_JOINT_CONFIGURATION, "joint_type", problem, joint=name)
        if parent in children or parent not in empty or not alone:
            joint.set("type", "fixed")
            message = f"joint '{name}': '{child}' floats; it is held where it stands: --split makes it an asset"
            findings.append(warning(code="part_floats", message=message, joint=name))
            continue
        robot.remove(joint)
        robot.remove(next(link for link in robot.findall("link") if link.get("name") == parent))
        message = f"joint '{name}': '{child}' floats on '{parent}', which has no shape: the whole object is free"
        message += ", and both are left out"
        findings.append(info(code="root_floats", message=message, joint=name))
    return findings


def plane_steps(joint: Element) -> list[tuple[str, Array]]:
    """Two sliders along axes in a planar joint's plane, and a hinge about its normal: kinds and (3,) axes."""
    axis = joint.find("axis")
    normal = np.array([float(word) for word in str("1 0 0" if axis is None else axis.get("xyz", "1 0 0")).split()])
    normal = normal / max(float(np.linalg.norm(normal)), 1e-12)
    first = np.cross(normal, np.eye(3)[int(np.abs(normal).argmin())])
    first /= max(float(np.linalg.norm(first)), 1e-12)
    return [("prismatic", first), ("prismatic", np.cross(normal, first)), ("continuous", normal)]


def in_steps(robot: Element, joint: Element, steps: Sequence[tuple[str, Array]]) -> None:
    """Put all but the last of these kinds and (3,) axes as joints of their own between a joint's parent and the joint,
    which then is the last. Its numbers, which have no units for three ways to move, are left out."""
    name = str(joint.get("name"))
    taken = {str(item.get("name")) for tag in ("link", "joint") for item in robot.findall(tag)}
    above: Element | None = joint.find("parent")
    origin = joint.find("origin")
    for number, (kind, along) in enumerate(steps[:-1], start=1):
        label = next(text for n in range(len(taken) + 1) if (text := f"{name}_{number}{'_' * n}") not in taken)
        etree.SubElement(robot, "link", name=label)
        step = etree.SubElement(robot, "joint", name=label, type=kind)
        for item in (above, origin):
            if item is not None:
                step.append(item)
        etree.SubElement(step, "child", link=label)
        etree.SubElement(step, "axis", xyz=" ".join(f"{value:.12g}" for value in along))
        above, origin = etree.Element("parent", link=label), None
    for tag in ("limit", "dynamics", "mimic", "axis"):
        for item in joint.findall(tag):
            joint.remove(item)
    kind, along = steps[-1]
    joint.set("type", kind)
    joint.extend([] if above is None else [above])
    etree.SubElement(joint, "axis", xyz=" ".join(f"{value:.12g}" for value in along))


IN_STEPS: Mapping[str, tuple[Callable[[Element], Sequence[tuple[str, Array]]], str]] = {
    "planar": (plane_steps, "two sliders and a hinge about the plane's normal"),
    "spherical": (lambda _: [("continuous", axis) for axis in np.eye(3)], "three hinges"),
}
"""Type of a joint that moves in three ways → its steps, and what they are, in words."""


def complete_limits(robot: Element) -> list[Finding]:
    """Set the one limit that is not stated to 0, as URDF has it, where that leaves a range; a finding for each."""
    findings = []
    for joint in robot.findall("joint"):
        limit = joint.find("limit")
        if limit is None or joint.get("type") not in ("revolute", "prismatic"):
            continue
        absent = [key for key in ("lower", "upper") if limit.get(key) is None]
        if len(absent) == 1 and any(float(limit.get(key) or 0.0) for key in ("lower", "upper")):
            limit.set(absent[0], "0")
            name = str(joint.get("name"))
            message = f"joint '{name}' states no {absent[0]} limit; it is 0, as URDF has it"
            findings.append(info(code="limit_completed", message=message, joint=name))
    return findings
