"""Forward kinematics of a joint tree: plain arrays in, plain arrays out."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from scipy.spatial.transform import Rotation

from asset2sim.physics.arrays import Array, floats_of
from schemas.features import Features, JointFeatures, Mimic
from schemas.overlay import PhysicsOverlay


@dataclass(frozen=True)
class TreeJoint:
    """One joint of a tree. ``child_to_parent`` is the (4, 4) transform at position zero, ``axis`` the (3,) unit axis in
    the joint's frame, ``mimic`` what a joint without a position of its own follows."""

    name: str
    type: str
    parent: str
    child: str
    child_to_parent: Array
    axis: Array
    mimic: Mimic | None = None

    def position(self, positions: Mapping[str, float]) -> float:
        """The joint's position, rad or m: its leader's counts where it follows one; zero where it is not named."""
        if self.mimic is not None:
            return self.mimic.at(positions.get(self.mimic.joint, 0.0))
        return positions.get(self.name, 0.0)


def origin_transform(xyz: Sequence[float], rpy: Sequence[float] = (0.0, 0.0, 0.0)) -> Array:
    """(4, 4) transform of a URDF origin: translation in metres, fixed-axis roll, pitch and yaw in radians."""
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_euler("xyz", rpy).as_matrix()
    matrix[:3, 3] = xyz
    return matrix


def rpy_of(rotation: Array) -> Array:
    """(3,) fixed-axis roll, pitch and yaw of a (3, 3) rotation, rad, as URDF writes them."""
    pitch = math.atan2(-rotation[2, 0], math.hypot(rotation[0, 0], rotation[1, 0]))
    if abs(math.cos(pitch)) < 1e-9:
        return np.array([math.atan2(-rotation[1, 2], rotation[1, 1]), pitch, 0.0])
    return np.array([math.atan2(rotation[2, 1], rotation[2, 2]), pitch, math.atan2(rotation[1, 0], rotation[0, 0])])


def tree_of(joints: Sequence[JointFeatures], scale: float = 1.0) -> tuple[TreeJoint, ...]:
    """The joints as a tree in topological order (parents first), with every length multiplied by ``scale``."""
    found = []
    sliders = {joint.name for joint in joints if joint.prismatic}
    for joint in joints:
        pose = origin_transform([scale * v for v in joint.origin_xyz], joint.origin_rpy)
        axis = np.asarray(joint.axis, dtype=float)
        mimic = None if joint.mimic is None else scaled_mimic(joint.mimic, joint.name, sliders, scale)
        found.append(TreeJoint(joint.name, joint.type, joint.parent, joint.child, pose, axis, mimic))
    return parents_first(found)


def scaled_mimic(mimic: Mimic, name: str, sliders: Collection[str], scale: float) -> Mimic:
    """The mimic of the named joint, with every length multiplied by ``scale``; ``sliders`` have positions in m."""
    own, leader = (scale if joint in sliders else 1.0 for joint in (name, mimic.joint))
    return mimic.model_copy(update={"multiplier": mimic.multiplier * own / leader, "offset": mimic.offset * own})


def follower_positions(mimics: Mapping[str, Mimic], positions: Mapping[str, float]) -> dict[str, float]:
    """The joint positions with those of the followers (joint → what it follows) as their leaders' have them."""
    return {**positions, **{name: mimic.at(positions.get(mimic.joint, 0.0)) for name, mimic in mimics.items()}}


def mimics_of(tree: Sequence[TreeJoint]) -> dict[str, Mimic]:
    """Joint → what it follows, of those that follow another."""
    return {joint.name: joint.mimic for joint in tree if joint.mimic is not None}


def with_mimics(tree: Sequence[TreeJoint], mimics: Mapping[str, Mimic]) -> tuple[TreeJoint, ...]:
    """The tree with these joints following others."""
    return tuple(replace(joint, mimic=mimics.get(joint.name)) for joint in tree)


def parents_first(joints: Sequence[TreeJoint]) -> tuple[TreeJoint, ...]:
    """The joints in topological order; ValueError where they do not form a tree."""
    remaining = list(joints)
    children = {joint.child for joint in remaining}
    known = {joint.parent for joint in remaining if joint.parent not in children}
    ordered: list[TreeJoint] = []
    while remaining:
        ready = [joint for joint in remaining if joint.parent in known]
        if not ready:
            raise ValueError("the joints do not form a tree: " + ", ".join(joint.name for joint in remaining))
        ordered.extend(ready)
        known.update(joint.child for joint in ready)
        remaining = [joint for joint in remaining if joint.child not in known]
    return tuple(ordered)


def joint_motion(joint: TreeJoint, position: float) -> Array:
    """(4, 4) transform of the joint's own motion at ``position`` (radians or metres), in the joint's frame."""
    matrix = np.eye(4)
    if joint.type in ("revolute", "continuous"):
        matrix[:3, :3] = Rotation.from_rotvec(joint.axis * position).as_matrix()
    elif joint.type == "prismatic":
        matrix[:3, 3] = joint.axis * position
    return matrix


def locked_joint(joint: JointFeatures) -> JointFeatures:
    """A fixed joint in place of one whose limits leave no range, its child at the lower limit."""
    pose = origin_transform(joint.origin_xyz, joint.origin_rpy) @ joint_motion(tree_of([joint])[0], joint.lower or 0.0)
    place = {"origin_xyz": floats_of(pose[:3, 3]), "origin_rpy": floats_of(rpy_of(pose[:3, :3]))}
    return joint.model_copy(update={"type": "fixed", "mimic": None, **place})


def link_to_root(
    tree: Sequence[TreeJoint],
    root: str,
    positions: Mapping[str, float],
    known: Mapping[str, Array] = MappingProxyType({}),
) -> dict[str, Array]:
    """Link name → (4, 4) link-to-root transform at these positions; joints not named are at zero, followers where their
    leaders have them. Links that are ``known`` stay there: ``tree`` may be what lies beyond them."""
    poses: dict[str, Array] = {root: np.eye(4), **known}
    for joint in tree:
        position = 0.0 if joint.type == "fixed" else joint.position(positions)
        step = joint.child_to_parent if position == 0.0 else joint.child_to_parent @ joint_motion(joint, position)
        poses[joint.child] = poses[joint.parent] @ step
    return poses


def rigid_links(tree: Sequence[TreeJoint], joint: str) -> tuple[str, ...]:
    """The links that turn or slide with the named joint as one: its child and everything beyond."""
    moved: dict[str, None] = {}  # in order, and found at once in a chain of a thousand links
    for item in tree:
        if item.name == joint or item.parent in moved:
            moved[item.child] = None
    return tuple(moved)


CHAIN_JOINTS = 8
"""Joints one after the other from which on they are a chain or a hose: it is laid as a whole, and no hand turns one of
its joints alone. Arms of robots and lamps have up to seven."""


def in_chains(tree: Sequence[TreeJoint]) -> tuple[str, ...]:
    """The joints that are part of at least ``CHAIN_JOINTS`` that move one after the other, parents first."""
    paths: dict[str, tuple[str, ...]] = {}
    chained: dict[str, None] = {}
    for joint in tree:
        moves = joint.type != "fixed" and joint.mimic is None
        paths[joint.child] = paths.get(joint.parent, ()) + ((joint.name,) if moves else ())
        if len(paths[joint.child]) >= CHAIN_JOINTS:
            chained |= dict.fromkeys(paths[joint.child])
    return tuple(chained)


def moved_links(tree: Sequence[TreeJoint], joint: str) -> tuple[str, ...]:
    """The links that the named joint moves: those beyond it, and beyond the joints that follow it."""
    names = [joint, *(item.name for item in tree if item.mimic is not None and item.mimic.joint == joint)]
    return tuple(dict.fromkeys(link for name in names for link in rigid_links(tree, name)))


def apply(matrix: Array, points: Array) -> Array:
    """(n, 3) points moved by a (4, 4) transform."""
    moved: Array = points @ matrix[:3, :3].T + matrix[:3, 3]
    return moved


def written_joints(features: Features, overlay: PhysicsOverlay) -> list[JointFeatures]:
    """Joints as in the written URDF: those locked by validation are fixed."""
    kept = {joint.name for joint in (*overlay.joints, *overlay.followers)}
    return [joint if joint.name in kept or not joint.movable else locked_joint(joint) for joint in features.joints]


def pose_of(position: Sequence[float] | Array, xyzw: Sequence[float] | Array) -> Array:
    """(4, 4) transform of a position and an xyzw quaternion."""
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_quat(xyzw).as_matrix()
    matrix[:3, 3] = position
    return matrix
