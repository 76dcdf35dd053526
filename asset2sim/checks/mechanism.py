"""A written URDF as the checks need it: joint tree, masses, gravity's pull along a joint's range, bounding boxes."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from lxml import etree

from asset2sim.assets.urdf.collision_points import link_corners
from asset2sim.assets.urdf.document import parsed_root
from asset2sim.assets.urdf.mimic import read_mimics
from asset2sim.assets.urdf.read import element_joint, element_pose, numbers_of_attribute
from asset2sim.physics.arrays import Array, cross
from asset2sim.physics.inertia import tensor_of
from asset2sim.physics.kinematics import TreeJoint, in_chains, link_to_root, moved_links, rigid_links, with_mimics
from asset2sim.physics.mass_matrix import GRAVITY_M_S2, Body, Pull
from schemas.overlay import JointPhysics, PhysicsOverlay

FEW_OF_A_CHAIN = 5
"""Joints of a chain of alike ones that are moved one by one, its first and last among them: a joint of a hose does as
its neighbours do, and checks of all its 40 take minutes."""


@dataclass(frozen=True)
class Mechanism:
    """The object that is checked. ``joints`` are those of the overlay that move in the URDF, in the tree's order; those
    that follow others are moved with these (``followers``) and not checked by themselves.

    ``moved`` is the links that each movable joint moves, in the tree's order, on which the last digits of sums over
    them depend, ``chain`` the movable joints from the root to each link, for one that follows another that one,
    ``boxes`` the corners (8, 3) of each link's collision shapes in its own frame (links without any are left out).
    """

    root: str
    tree: tuple[TreeJoint, ...]
    bodies: dict[str, Body]
    joints: tuple[JointPhysics, ...]
    efforts: dict[str, float]
    moved: dict[str, tuple[str, ...]]
    chain: dict[str, tuple[str, ...]]
    boxes: dict[str, Array]

    @cached_property
    def followers(self) -> dict[str, tuple[TreeJoint, ...]]:
        """Joint → the joints that follow it, of those that have any."""
        found: dict[str, tuple[TreeJoint, ...]] = {}
        for joint in self.tree:
            if joint.mimic is not None:
                found[joint.mimic.joint] = (*found.get(joint.mimic.joint, ()), joint)
        return found

    @cached_property
    def asked(self) -> tuple[JointPhysics, ...]:
        """The joints that are moved one by one: of a chain's joints of one type and range, in a row, a few."""
        passed_over = {
            name
            for names in alike_in_chains(self.tree, self.joints)
            for name in {*names}
            - {names[i] for i in np.linspace(0, len(names) - 1, FEW_OF_A_CHAIN).round().astype(int)}
        }
        return tuple(joint for joint in self.joints if joint.name not in passed_over)

    def moves_apart(self, joint: str, a: str, b: str) -> bool:
        """Whether a joint, with what follows it, moves two links against each other."""
        names = [joint, *(item.name for item in self.followers.get(joint, ()))]
        return any((a in self.rigid[name]) != (b in self.rigid[name]) for name in names)

    @cached_property
    def rigid(self) -> dict[str, frozenset[str]]:
        """Movable joint → the links that move with it as one."""
        return {
            joint.name: frozenset(rigid_links(self.tree, joint.name)) for joint in self.tree if joint.type != "fixed"
        }

    @property
    def start(self) -> dict[str, float]:
        """Joint name → initial position, rad or m, of those that follow none."""
        return {joint.name: joint.initial_position for joint in self.joints}


def alike_in_chains(tree: Sequence[TreeJoint], joints: Sequence[JointPhysics]) -> list[list[str]]:
    """The joints of chains, those of one type and range together, parents first."""
    known, alike = {joint.name: joint for joint in joints}, dict[tuple[str, str], list[str]]()
    for name in in_chains(tree):
        if name in known:
            lower, upper = span_of(known[name])
            alike.setdefault((known[name].type, f"{upper - lower:.1e}"), []).append(name)
    return list(alike.values())


def written_tree(urdf: etree._Element) -> tuple[TreeJoint, ...]:
    """The joints of a URDF that this project has written, parents first."""
    return with_mimics(ordered([element_joint(joint) for joint in urdf.findall("joint")]), read_mimics(urdf))


def mechanism(urdf: Path, overlay: PhysicsOverlay) -> Mechanism:
    """Read a URDF that this project has written: one tree, every link with an inertial."""
    root_element = parsed_root(urdf)
    tree = written_tree(root_element)
    children = {joint.child for joint in tree}
    links = {str(element.get("name")): element for element in root_element.findall("link")}
    root = next(name for name in links if name not in children)
    movable = [joint for joint in tree if joint.type != "fixed"]
    chain: dict[str, tuple[str, ...]] = {root: ()}
    for joint in tree:
        name = joint.name if joint.mimic is None else joint.mimic.joint
        chain[joint.child] = chain[joint.parent] + (() if joint.type == "fixed" else (name,))
    known = {joint.name: joint for joint in overlay.joints}
    efforts = {
        str(element.get("name")): float(limit.get("effort", math.inf))
        for element in root_element.findall("joint")
        if (limit := element.find("limit")) is not None
    }
    folder = urdf.parent
    boxes = {name: corners for name, element in links.items() if (corners := link_corners(element, folder)) is not None}
    return Mechanism(
        root=root,
        tree=tree,
        bodies={name: body_of(element) for name, element in links.items()},
        joints=tuple(known[joint.name] for joint in movable if joint.name in known),
        efforts=efforts,
        moved={joint.name: moved_links(tree, joint.name) for joint in movable},
        chain=chain,
        boxes=boxes,
    )


def ordered(joints: list[TreeJoint]) -> tuple[TreeJoint, ...]:
    """The joints with parents first."""
    beyond: dict[str, list[TreeJoint]] = {}
    for joint in joints:
        beyond.setdefault(joint.parent, []).append(joint)
    children = {joint.child for joint in joints}
    frontier = [name for name in beyond if name not in children]
    found: list[TreeJoint] = []
    while frontier:
        for joint in beyond.get(frontier.pop(0), []):
            found.append(joint)
            frontier.append(joint.child)
    return tuple(found)


def body_of(element: "etree._Element") -> Body:
    """The inertial of one ``<link>``; a link without one weighs nothing."""
    inertial = element.find("inertial")
    if inertial is None:
        return Body(0.0, np.zeros(3), np.zeros((3, 3)))
    frame, moments = element_pose(inertial), inertial.find("inertia")
    ixx, ixy, ixz, iyy, iyz, izz = (
        numbers_of_attribute(moments, key, "0")[0] for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    )
    tensor = frame[:3, :3] @ tensor_of((ixx, ixy, ixz, iyy, iyz, izz)) @ frame[:3, :3].T
    return Body(numbers_of_attribute(inertial.find("mass"), "value", "0")[0], frame[:3, 3], tensor)


def pull_on(item: Mechanism, joint: str, positions: Mapping[str, float], poses: Mapping[str, Array]) -> Pull:
    """Gravity's pull along the joint and what follows it, the others at ``positions``, whose link-to-root transforms
    are ``poses``. With followers it is exact there, and further on as far as all move by the same angle."""
    pull = own_pull(item, joint, positions, poses)
    force, slope = pull.force, pull.slope
    for follower in item.followers.get(joint, ()):
        if follower.mimic is not None:
            ratio, other = follower.mimic.multiplier, own_pull(item, follower.name, positions, poses)
            force, slope = force + ratio * other.force, slope + ratio**2 * other.slope
    return Pull(pull.position, force, slope, pull.prismatic)


def own_pull(item: Mechanism, joint: str, positions: Mapping[str, float], poses: Mapping[str, Array]) -> Pull:
    """Gravity's pull along the joint alone, the others at ``positions``, whose link-to-root transforms are ``poses``.

    −m g z·(a × R(θ) r) for a hinge of unit axis a with the centre of mass of all it moves at r from it, and −m g z·a
    for a slider: gravity is along −z of the root frame, as in ``physics.mass_matrix.joint_space``.
    """
    hinge = next(entry for entry in item.tree if entry.name == joint)
    frame = poses[hinge.parent] @ hinge.child_to_parent
    axis = frame[:3, :3] @ hinge.axis
    mass, moment = 0.0, np.zeros(3)
    for link in item.rigid[joint]:
        body, pose = item.bodies[link], poses[link]
        mass += body.mass
        moment += body.mass * (pose[:3, :3] @ body.com + pose[:3, 3])
    at = positions.get(joint, 0.0)
    if hinge.type == "prismatic" or mass <= 0.0:
        return Pull(at, -mass * GRAVITY_M_S2 * float(axis[2]), prismatic=True)
    across = cross(axis, moment / mass - frame[:3, 3])
    weight = mass * GRAVITY_M_S2
    return Pull(at, -weight * float(across[2]), -weight * float(cross(axis, across)[2]))


def moved_inertia(item: Mechanism, joint: str, poses: Mapping[str, Array]) -> float:
    """Inertia that the joint and its followers move, all else held, with armature: kg·m² about its axis, or kg."""
    total = next((entry.armature for entry in item.joints if entry.name == joint), 0.0)
    drives = [(entry, 1.0) for entry in item.tree if entry.name == joint]
    drives += [(entry, entry.mimic.multiplier) for entry in item.followers.get(joint, ()) if entry.mimic is not None]
    for link in item.moved[joint]:
        body, pose = item.bodies[link], poses[link]
        center, speed, turning = pose[:3, :3] @ body.com + pose[:3, 3], np.zeros(3), np.zeros(3)
        for entry, ratio in drives:
            if link not in item.rigid[entry.name]:
                continue
            frame = poses[entry.parent] @ entry.child_to_parent
            axis = ratio * frame[:3, :3] @ entry.axis
            slides = entry.type == "prismatic"
            speed = speed + (axis if slides else cross(axis, center - frame[:3, 3]))
            turning = turning + (0.0 if slides else axis)
        turned = pose[:3, :3].T @ turning
        total += body.mass * float(speed @ speed) + float(turned @ body.inertia @ turned)
    return total


def poses_at(item: Mechanism, positions: Mapping[str, float]) -> dict[str, Array]:
    """Link name → (4, 4) link-to-root transform."""
    return link_to_root(item.tree, item.root, positions)


def span_of(joint: JointPhysics) -> tuple[float, float]:
    """The lower and upper end of a joint's range, rad or m: one turn about its initial position where it has none."""
    if joint.lower is None or joint.upper is None:
        return joint.initial_position - math.pi, joint.initial_position + math.pi
    return joint.lower, joint.upper
