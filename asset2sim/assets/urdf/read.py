"""Reading a URDF into yourdfpy's typed model, and refusing what no simulator could load."""

import io
import logging
import math
from collections import Counter
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
import yourdfpy
from lxml import etree

from asset2sim.assets.urdf.capsule import as_cylinders, read_capsules
from asset2sim.assets.urdf.document import invalid_joint_error, known_robot, unreadable_error
from asset2sim.assets.urdf.mimic import read_mimics
from asset2sim.assets.urdf.numbers import BIAS
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint, origin_transform
from schemas.errors import AssetError
from schemas.features import LinkContact
from schemas.vocabulary import FailureMode

JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed")
"""The joint types that PyBullet, MuJoCo and PhysX all load; ``read_document`` says what becomes of others."""
MOST_LINKS = 128
"""Links of an object, its root among them, that PyBullet simulates (measured: with 129 of them, joints fixed or not, it
loads the object and then tells no state of it, nor of any other). The keyboard of 115 keys has 117."""

PARTNET_TURN = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""The rotation of PartNet-Mobility's fixed root joint: its objects are authored y-up and facing +z."""

logging.getLogger("yourdfpy").setLevel(logging.ERROR)


def read_urdf(path: Path) -> yourdfpy.Robot:
    """The URDF as yourdfpy's robot: links, joints, origins as (4, 4), no mesh loaded; what a joint follows in the end
    is its ``mimic``, a ``Mimic``, and capsules are ``Capsule``. Raises AssetError:
    unreadable_asset if the file is not XML, not a URDF or not one tree of known joint types;
    invalid_joint_configuration where a joint's numbers make no sense."""
    document = known_robot(path)
    try:
        graphs = {"build_scene_graph": False, "build_collision_scene_graph": False}
        content = io.BytesIO(etree.tostring(as_cylinders(document)))
        model = yourdfpy.URDF.load(content, **graphs, load_meshes=False, load_collision_meshes=False)
    except Exception as error:  # yourdfpy raises what its parsers raise: any of them means a URDF that cannot be read
        raise unreadable_error(path, "not_urdf", f"yourdfpy cannot read it: {type(error).__name__}: {error}") from error
    check_tree(path, model.robot)
    read_capsules(document, model.robot)
    mimics = read_mimics(document)
    for joint in model.robot.joints:
        joint.mimic = mimics.get(joint.name)
    return model.robot


def root_of(robot: yourdfpy.Robot) -> str:
    """Name of the root link."""
    children = {joint.child for joint in robot.joints}
    return next(str(link.name) for link in robot.links if link.name not in children)


def tree_joint(joint: yourdfpy.Joint) -> TreeJoint:
    """The ``TreeJoint`` of a joint, with URDF's defaults: no offset, and x for an axis."""
    origin = np.eye(4) if joint.origin is None else np.asarray(joint.origin, dtype=float)
    axis = np.array([1.0, 0.0, 0.0]) if joint.axis is None else np.asarray(joint.axis, dtype=float)
    axis = axis / max(float(np.linalg.norm(axis)), 1e-12)
    return TreeJoint(joint.name, joint.type, joint.parent, joint.child, origin, axis, joint.mimic)


def numbers_of_attribute(element: "etree._Element | None", key: str, default: str) -> list[float]:
    """The numbers of one attribute, or of the default where element or attribute is absent or empty."""
    return [float(word) for word in str((element is not None and element.get(key)) or default).split()]


def element_pose(element: "etree._Element") -> Array:
    """(4, 4) transform of the origin of a URDF's ``<joint>``, ``<inertial>``, ``<visual>`` or ``<collision>``."""
    origin = element.find("origin")
    return origin_transform(numbers_of_attribute(origin, "xyz", "0 0 0"), numbers_of_attribute(origin, "rpy", "0 0 0"))


def element_joint(element: "etree._Element") -> TreeJoint:
    """As ``tree_joint``, of a ``<joint>`` element; yourdfpy's transforms differ from it in the last digits."""
    axis = np.array(numbers_of_attribute(element.find("axis"), "xyz", "1 0 0"))
    parent, child = element.find("parent"), element.find("child")
    return TreeJoint(
        str(element.get("name")),
        str(element.get("type")),
        str("" if parent is None else parent.get("link")),
        str("" if child is None else child.get("link")),
        element_pose(element),
        axis / max(float(np.linalg.norm(axis)), 1e-12),
    )


def check_tree(path: Path, robot: yourdfpy.Robot) -> None:
    """Refuse duplicate names, unknown parents, children and joint types, several roots, loops, and too many links."""
    links = [link.name for link in robot.links]
    if not links:
        raise unreadable_error(path, "no_links", "it has no link")
    if len(links) > MOST_LINKS:
        remedy = f"PyBullet simulates at most {MOST_LINKS}; merge those that are fixed to one another"
        message = f"{path.name}: it has {len(links)} links, and {remedy}"
        raise AssetError(FailureMode.ENGINE_REFUSED, "too_many_links", message)
    for kind, names in (("link", links), ("joint", [joint.name for joint in robot.joints])):
        twice = [name for name, count in Counter(names).items() if count > 1]
        if twice:
            raise unreadable_error(path, f"duplicate_{kind}", f"{kind} '{twice[0]}' is defined twice; rename one")
    for joint in robot.joints:
        check_joint(path, joint, links)
    parents = Counter(joint.child for joint in robot.joints)
    for name, count in parents.items():
        if count > 1:
            raise unreadable_error(
                path, "two_parents", f"link '{name}' is the child of {count} joints; a URDF is a tree"
            )
    roots = [name for name in links if name not in parents]
    if len(roots) != 1:
        listed = ", ".join(roots) or "none: its joints form a loop"
        raise unreadable_error(path, "roots", f"it must have one root link and has {len(roots)} ({listed})")
    lost = unreached_links(robot, roots[0], links)
    if lost:
        raise unreadable_error(path, "loop", f"links {', '.join(lost[:5])} are not connected to root '{roots[0]}'")


def check_joint(path: Path, joint: yourdfpy.Joint, links: list[str]) -> None:
    """Refuse one joint whose links do not exist, whose type no engine knows, or whose axis has no direction."""
    for role, name in (("parent", joint.parent), ("child", joint.child)):
        if name not in links:
            raise invalid_joint_error(path, "unknown_link", joint.name, f"its {role} '{name}' is not a link")
    if joint.parent == joint.child:
        raise invalid_joint_error(
            path, "loop", joint.name, f"its parent and its child are both '{joint.child}'; name two links"
        )
    if joint.type not in JOINT_TYPES:
        raise invalid_joint_error(
            path, "joint_type", joint.name, f"type '{joint.type}'; use one of {', '.join(JOINT_TYPES)}"
        )
    if joint.axis is not None and joint.type != "fixed":
        length = float(np.linalg.norm(joint.axis))
        if not math.isfinite(length) or length < 1e-9:
            raise invalid_joint_error(path, "zero_axis", joint.name, "its axis has no direction: state one, as 0 0 1")


def unreached_links(robot: yourdfpy.Robot, root: str, links: list[str]) -> list[str]:
    """The links that no chain of joints connects to the root."""
    reached, frontier = {root}, [root]
    while frontier:
        link = frontier.pop()
        for joint in robot.joints:
            if joint.parent == link and joint.child not in reached:
                reached.add(joint.child)
                frontier.append(joint.child)
    return [name for name in links if name not in reached]


@dataclass(frozen=True)
class Dynamics:
    """Damping (N·m·s/rad or N·s/m), friction (N·m or N), stiffness (N·m/rad or N/m), the spring's rest position, and
    armature (kg·m² or kg). ``bias`` is what a mechanism exerts besides: slope, position without any, least, most
    and period (``schemas.mechanism.Bias``). URDF has no field for the last four; our own adapters read them."""

    damping: float
    friction: float
    stiffness: float
    spring_reference: float
    armature: float = 0.0
    bias: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)


def read_dynamics(urdf: Path) -> dict[str, Dynamics]:
    """Joint name → dynamics for every joint that is not fixed, springs as with armature; absent attributes are 0."""
    terms: dict[str, Dynamics] = {}
    for joint in known_robot(urdf).findall("joint"):
        if joint.get("type") == "fixed":
            continue
        element = joint.find("dynamics")
        values = dict[str, str]() if element is None else {str(k): str(text) for k, text in element.attrib.items()}
        spring = "geared" if "geared_stiffness" in values else "spring"
        keys = ("damping", "friction", f"{spring}_stiffness", f"{spring}_reference", "armature")
        damping, friction, stiffness, reference, armature = (float(values.get(key, 0.0)) for key in keys)
        slope, none_at, least, most, period = (float(values.get(key, 0.0)) for key in BIAS)
        found = Dynamics(damping, friction, stiffness, reference, armature, (slope, none_at, least, most, period))
        terms[str(joint.get("name"))] = found
    return terms


def read_starts(robot: "etree._Element") -> dict[str, float]:
    """Joint → where its file says that it starts, rad or m, of those that have a ``start`` beside their dynamics: URDF
    has no field for it, and our converters write it there."""
    stated = ((joint, joint.find("dynamics")) for joint in robot.findall("joint"))
    found = {str(joint.get("name")): item.get("start") for joint, item in stated if item is not None}
    return {name: float(text) for name, text in found.items() if text}


def read_contacts(robot: "etree._Element") -> dict[str, LinkContact]:
    """Link → friction and restitution of its contacts, as Bullet's ``<contact>`` or Gazebo's ``mu1`` state them."""
    found: dict[str, LinkContact] = {}
    for link in robot.findall("link"):
        values = {key: link.find(f"contact/{key}") for key in ("lateral_friction", "restitution")}
        friction, restitution = (None if item is None else item.get("value") for item in values.values())
        name = str(link.get("name"))
        for gazebo in robot.findall("gazebo"):
            if gazebo.get("reference") == name and friction is None:
                friction = gazebo.findtext("mu1")
        if friction or restitution:
            numbers = (float(text) if text else None for text in (friction, restitution))
            found[name] = LinkContact(**dict(zip(("friction", "restitution"), numbers, strict=True)))
    return found


def passing_pairs(robot: "etree._Element") -> tuple[tuple[str, str], ...]:
    """The pairs of a URDF's links that pass through each other: those stated as SRDF does, and those that fixed joints
    hold at their places, which can neither push each other apart nor jam. Links of one joint pass anyhow."""
    links = [str(link.get("name")) for link in robot.findall("link")]
    stated = [(str(item.get("link1")), str(item.get("link2"))) for item in robot.findall("disable_collisions")]
    ends = {
        str(child.get("link")): (str(parent.get("link")), joint.get("type") == "fixed")
        for joint in robot.findall("joint")
        if (parent := joint.find("parent")) is not None and (child := joint.find("child")) is not None
    }
    groups: dict[str, list[str]] = {}
    for link in links:
        held = link
        for _ in ends:  # a file that is not checked yet may have a loop
            held = ends[held][0] if ends.get(held, ("", False))[1] else held
        groups.setdefault(held, []).append(link)
    adjacent = {frozenset((child, parent)) for child, (parent, _) in ends.items()}
    unmoved = [pair for group in groups.values() for pair in combinations(group, 2) if {*pair} not in adjacent]
    every = {frozenset(pair): pair for pair in (*unmoved, *stated) if {*links}.issuperset(pair)}
    return tuple(every.values())


def front_of(robot: yourdfpy.Robot, urdf_file: Path) -> Array:
    """(3,) the horizontal direction in the root frame that the object's front faces. PartNet-Mobility's objects face -x
    once its root joint has turned them z-up; an object is taken for one of them by that joint, by its robot's name or
    by the ``semantics.txt`` beside it. Others follow the ROS custom: x forward."""
    root = root_of(robot)
    turned = any(
        joint.parent == root
        and joint.type == "fixed"
        and joint.origin is not None
        and np.allclose(np.asarray(joint.origin)[:3, :3], PARTNET_TURN, atol=1e-3)
        for joint in robot.joints
    )
    named = (robot.name or "").startswith("partnet_") or (urdf_file.parent / "semantics.txt").is_file()
    return np.array([-1.0 if turned or named else 1.0, 0.0, 0.0])
