"""Baking a state into a URDF: the same object whose joint zero is the requested state, and the way back.

URDF has no field for an initial position. Here each joint's motion at its position is folded into its origin, and
everything that is measured from zero (limits, spring, mimic, safety and calibration) is shifted by it. The old text of
every attribute is recorded in the comment at the top and beside the file, so that ``unbake`` restores it exactly.
"""

import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from lxml import etree
from lxml.etree import _Element as Element

from asset2sim.assets.urdf.edit import POSITIONS, ensure_child, serialised
from asset2sim.assets.urdf.read import element_joint, element_pose
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import joint_motion
from schemas.base import Finite, Frozen
from schemas.errors import UsageError
from schemas.overlay import PhysicsOverlay

RECORD_NAME = "bake.json"
"""The record beside a baked URDF; the comment at its top holds the same."""
MARK = " asset2sim bake: "
STATE_MARK = " asset2sim: "
ROUNDING_TOLERANCE = 1e-7
"""Rounding error by which a position may lie outside the written limits, rad or m: it is set to the limit."""
SHIFTED = (
    ("limit", "lower"),
    ("limit", "upper"),
    ("dynamics", "spring_reference"),
    ("dynamics", "geared_reference"),
    ("dynamics", "bias_none_at"),
    *POSITIONS,
)
"""Attributes that are positions of their joint."""
MOVING = ("revolute", "continuous", "prismatic")


class BakedJoint(Frozen):
    """One joint of a baked URDF: ``position`` (rad or m, from the authored zero) is where its zero is now.

    ``authored`` maps ``tag/attribute`` to the text that the unbaked URDF has there, None where it has none.
    """

    name: str
    position: Finite
    authored: dict[str, str | None]


class Bake(Frozen):
    """The record that undoes a bake. ``comment`` is the URDF comment that stated the positions before baking."""

    comment: str | None
    joints: tuple[BakedJoint, ...]

    @property
    def positions(self) -> dict[str, float]:
        """Joint name → its baked zero, measured from the authored zero, rad or m."""
        return {joint.name: joint.position for joint in self.joints}


def bake(document: bytes, positions: Mapping[str, float]) -> tuple[bytes, Bake]:
    """The document with joint zero at ``positions`` (rad or m; joints not named stay), and the record of the change.
    Joint q of the result is joint q + q₀ of the original, whatever the pose. A document that is baked already is
    restored first, ``positions`` being of its authored zero. Raises UsageError for a position of no movable joint."""
    robot = parsed_with_comments(document)
    if record_of(robot) is not None:
        robot = parsed_with_comments(unbake(document))
    joints = {str(joint.get("name")): joint for joint in robot.findall("joint")}
    movable = {name: joint for name, joint in joints.items() if joint.get("type") in MOVING}
    unknown = sorted(set(positions) - set(movable))
    if unknown:
        raise UsageError(f"no movable joint {', '.join(unknown)} to bake; movable joints: {', '.join(movable)}")
    zeros = {name: within_limits(joint, positions.get(name, 0.0)) for name, joint in movable.items()}
    touched = [name for name in movable if zeros[name] != 0.0 or mimic_offset(movable[name], zeros) is not None]
    before = tuple(authored_attributes(movable[name], zeros[name]) for name in touched)
    record = Bake(comment=comment_text(robot, STATE_MARK), joints=before)
    for name in touched:
        shift_joint(movable[name], zeros[name], mimic_offset(movable[name], zeros))
    write_comment(robot, record)
    return serialised(robot), record


def unbake(document: bytes, record: Bake | None = None) -> bytes:
    """The document with its authored zero again: every attribute that baking changed has its old text. Without
    ``record`` the one in the document's comment is used. Raises UsageError where there is none."""
    robot = parsed_with_comments(document)
    record = record or record_of(robot)
    if record is None:
        raise UsageError("this URDF says nothing of a baked state; give the record in bake.json")
    joints = {str(joint.get("name")): joint for joint in robot.findall("joint")}
    for item in record.joints:
        joint = joints[item.name]
        for path, text in item.authored.items():
            tag, key = path.split("/")
            element = joint.find(tag)
            if text is not None:
                (etree.SubElement(joint, tag) if element is None else element).set(key, text)
            elif element is not None:
                if key in element.attrib:
                    del element.attrib[key]
                if tag == "origin" and not element.attrib:
                    joint.remove(element)
    remove_comments(robot)
    if record.comment is not None:
        robot.insert(0, etree.Comment(record.comment))
    return serialised(robot)


def bake_file(urdf: Path, positions: Mapping[str, float], target: Path) -> Bake:
    """Write the baked URDF to ``target`` (which may be ``urdf``) and its record beside it."""
    document, record = bake(urdf.read_bytes(), positions)
    target.write_bytes(document)
    (target.parent / RECORD_NAME).write_text(record.model_dump_json(indent=2), encoding="utf-8")
    return record


def baked(overlay: PhysicsOverlay) -> PhysicsOverlay:
    """The overlay of the baked URDF: every initial position 0, and all that is measured from zero shifted with it."""
    joints = []
    for joint in overlay.all_joints:
        zero = joint.initial_position
        changes = {
            "initial_position": 0.0,
            "lower": None if joint.lower is None else min(joint.lower - zero, 0.0),
            "upper": None if joint.upper is None else max(joint.upper - zero, 0.0),
            "closed": joint.closed - zero,
            "open": joint.open - zero,
            "spring_reference": joint.spring_reference - zero,
            "bias": joint.bias and joint.bias.model_copy(update={"none_at": joint.bias.none_at - zero}),
            # Both zeros are where the state has them.
            "mimic": None if joint.mimic is None else joint.mimic.model_copy(update={"offset": 0.0}),
        }
        joints.append(joint.model_copy(update=changes))
    count = len(overlay.joints)
    return overlay.model_copy(update={"joints": tuple(joints[:count]), "followers": tuple(joints[count:])})


def within_limits(joint: Element, position: float) -> float:
    """The position, set to a limit that it passes by no more than ``ROUNDING_TOLERANCE``."""
    limit = joint.find("limit")
    if limit is None or joint.get("type") == "continuous":
        return position
    for key, outside in (("lower", 1.0), ("upper", -1.0)):
        text = limit.get(key)
        if text is not None and 0.0 < outside * (float(text) - position) <= ROUNDING_TOLERANCE:
            return float(text)
    return position


def mimic_offset(joint: Element, zeros: Mapping[str, float]) -> float | None:
    """The offset that keeps q' + q₀ = m (p' + p₀) + o in the shifted coordinates; None where nothing changes."""
    mimic = joint.find("mimic")
    if mimic is None:
        return None
    own, leader = zeros[str(joint.get("name"))], zeros.get(str(mimic.get("joint")), 0.0)
    if own == 0.0 and leader == 0.0:
        return None
    return float(mimic.get("offset", "0")) + float(mimic.get("multiplier", "1")) * leader - own


def shift_joint(joint: Element, zero: float, offset: float | None) -> None:
    """Move one joint's zero to ``zero`` and set its mimic offset."""
    if offset is not None:
        ensure_child(joint, "mimic").set("offset", exact_number(offset))
    if zero == 0.0:
        return
    origin = ensure_child(joint, "origin")
    pose = element_pose(joint) @ joint_motion(element_joint(joint), zero)
    origin.set("xyz", " ".join(exact_number(value) for value in pose[:3, 3]))
    if joint.get("type") != "prismatic":
        origin.set("rpy", " ".join(exact_number(value) for value in roll_pitch_yaw(pose[:3, :3])))
    for tag, key in SHIFTED:
        element = joint.find(tag)
        text = None if element is None else element.get(key)
        if element is not None and text is not None:
            element.set(key, exact_number(float(text) - zero))


def roll_pitch_yaw(rotation: Array) -> Array:
    """(3,) fixed-axis roll, pitch and yaw of a (3, 3) rotation, rad. Roll is taken after yaw is undone, so that their
    rounding cancels where pitch comes near a right angle."""
    yaw = math.atan2(rotation[1, 0], rotation[0, 0])
    cosine, sine = math.cos(yaw), math.sin(yaw)
    roll = math.atan2(sine * rotation[0, 2] - cosine * rotation[1, 2], cosine * rotation[1, 1] - sine * rotation[0, 1])
    return np.array([roll, math.atan2(-rotation[2, 0], math.hypot(rotation[0, 0], rotation[1, 0])), yaw])


def authored_attributes(joint: Element, zero: float) -> BakedJoint:
    """The old text of every attribute of one joint that baking may change, None where it was absent."""
    paths = [("origin", "xyz"), ("origin", "rpy"), ("mimic", "offset"), *SHIFTED]
    texts: dict[str, str | None] = {}
    for tag, key in paths:
        element = joint.find(tag)
        if element is not None or tag == "origin":
            texts[f"{tag}/{key}"] = None if element is None else element.get(key)
    return BakedJoint(name=str(joint.get("name")), position=zero, authored=texts)


def record_of(robot: Element) -> Bake | None:
    """The record in a document's comment."""
    text = comment_text(robot, MARK)
    return None if text is None else Bake.model_validate_json(text[len(MARK) :])


def comment_text(robot: Element, mark: str) -> str | None:
    """The first comment with this mark. One of the initial positions no longer holds once they are baked."""
    return next((str(node.text) for node in comments(robot) if str(node.text).startswith(mark)), None)


def write_comment(robot: Element, record: Bake) -> None:
    """Put the record into a comment at the top. A comment may not hold two hyphens: names that do are escaped."""
    remove_comments(robot)
    text = json.dumps(record.model_dump(), separators=(",", ":")).replace("--", "-\\u002d")
    robot.insert(0, etree.Comment(f"{MARK}{text} "))


def remove_comments(robot: Element) -> None:
    """Remove our own comments and the whitespace after them."""
    for node in list(comments(robot)):
        if str(node.text).startswith((MARK, STATE_MARK)):
            robot.remove(node)


def comments(robot: Element) -> Iterator[Element]:
    """The comments at the top level of the document's root."""
    return (node for node in robot if isinstance(node, etree._Comment))


def parsed_with_comments(document: bytes) -> Element:
    """The document's root element, comments kept."""
    return etree.fromstring(document, etree.XMLParser(remove_comments=False))


def exact_number(value: float) -> str:
    """A number with every digit that it holds, no negative zero."""
    return repr(float(value) + 0.0)
