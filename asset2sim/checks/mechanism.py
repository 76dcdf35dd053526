"""A written URDF as the checks need it: joint tree, masses, gravity's pull along a joint's range, bounding boxes."""

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from lxml import etree

from asset2sim.assets.meshes.load import mesh_points
from asset2sim.assets.meshes.obj_file import read_obj
from asset2sim.assets.urdf.document import parsed
from asset2sim.assets.urdf.mimic import read_mimics
from asset2sim.assets.urdf.read import element_joint, element_pose, numbers
from asset2sim.physics.arrays import Array
from asset2sim.physics.inertia import tensor_of
from asset2sim.physics.kinematics import TreeJoint, beyond, in_chains, link_to_root, subtree, with_mimics
from asset2sim.physics.mass_matrix import GRAVITY_M_S2, Body, Pull
from schemas.overlay import JointPhysics, PhysicsOverlay

TURNS = np.linspace(0.0, 2.0 * math.pi, 48, endpoint=False)
ROUND = np.stack([np.cos(TURNS), np.sin(TURNS), np.ones(48)], axis=1)
"""(48, 3) rim of a cylinder of radius 1 and half length 1."""


FEW_OF_A_CHAIN = 5
"""Joints of a chain of alike ones that are moved one by one, its first and last among them: a joint of a hose does as
its neighbours do, and checks of all its 40 take minutes."""


@dataclass(frozen=True)
class Mechanism:
    """The object that is checked. ``joints`` are those of the overlay that move in the URDF, in the tree's order; those
    that follow others are moved with these (``followers``) and not checked by themselves.

    ``moved`` is the links that each movable joint moves, ``chain`` the movable joints from the root to each link, for
    one that follows another that one, ``boxes`` the corners (8, 3) of each link's collision shapes in its own frame
    (links without any are left out).
    """

    root: str
    tree: tuple[TreeJoint, ...]
    bodies: dict[str, Body]
    joints: tuple[JointPhysics, ...]
    efforts: dict[str, float]
    moved: dict[str, frozenset[str]]
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
        """The joints that are moved one by one: all but those of chains, and of joints of one type and range that move
        one after the other a few."""
        chained, alike = in_chains(self.tree), dict[tuple[str, str], list[str]]()
        for joint in self.joints:
            if joint.name in chained:
                lower, upper = span_of(joint)
                alike.setdefault((joint.type, f"{upper - lower:.1e}"), []).append(joint.name)
        passed_over = {
            name
            for names in alike.values()
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
        return {joint.name: frozenset(beyond(self.tree, joint.name)) for joint in self.tree if joint.type != "fixed"}

    @property
    def start(self) -> dict[str, float]:
        """Joint name → initial position, rad or m, of those that follow none."""
        return {joint.name: joint.initial_position for joint in self.joints}


def mechanism(urdf: Path, overlay: PhysicsOverlay) -> Mechanism:
    """Read a URDF that this project has written: one tree, every link with an inertial."""
    root_element = parsed(urdf)
    tree = ordered([element_joint(element) for element in root_element.findall("joint")])
    tree = with_mimics(tree, read_mimics(root_element))
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
        moved={joint.name: frozenset(subtree(tree, joint.name)) for joint in movable},
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
    ixx, ixy, ixz, iyy, iyz, izz = (numbers(moments, key, "0")[0] for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
    tensor = frame[:3, :3] @ tensor_of((ixx, ixy, ixz, iyy, iyz, izz)) @ frame[:3, :3].T
    return Body(numbers(inertial.find("mass"), "value", "0")[0], frame[:3, 3], tensor)


def link_corners(element: "etree._Element", folder: Path) -> Array | None:
    """(8, 3) corners of the box about a link's collision shapes, in the link's frame, m; None where it has none."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for collision in element.findall("collision"):
        extent = shape_box(collision.find("geometry"), folder)
        if extent is None:
            continue
        frame = element_pose(collision)
        points = corners(*extent) @ frame[:3, :3].T + frame[:3, 3]
        low, high = np.minimum(low, points.min(axis=0)), np.maximum(high, points.max(axis=0))
    return corners(low, high) if np.all(low <= high) else None


def collision_points(element: "etree._Element", folder: Path) -> Array:
    """(n, 3) points that span a link's collision shapes, in the link's frame, m; balls by the box about them."""
    clouds = [np.zeros((0, 3))]
    for collision in element.findall("collision"):
        mesh = collision.find("geometry/mesh")
        if mesh is not None:
            points = points_of(folder / str(mesh.get("filename"))) * np.array(numbers(mesh, "scale", "1 1 1"))
        else:
            extent = shape_box(collision.find("geometry"), folder)
            points = np.zeros((0, 3)) if extent is None else corners(*extent)
            if extent is not None and collision.find("geometry/cylinder") is not None:
                points = np.vstack([ROUND * extent[1], ROUND * extent[1] * [1.0, 1.0, -1.0]])
        frame = element_pose(collision)
        clouds.append(points @ frame[:3, :3].T + frame[:3, 3])
    return np.vstack(clouds)


def corners(low: Array, high: Array) -> Array:
    """(8, 3) corners of a box."""
    return np.array([(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])


def shape_box(geometry: "etree._Element | None", folder: Path) -> tuple[Array, Array] | None:
    """The (3,) least and greatest corner of one URDF geometry in its own frame, or None where there is none."""
    shape = None if geometry is None or not len(geometry) else geometry[0]
    if shape is None:
        return None
    if shape.tag == "box":
        half = np.array(numbers(shape, "size", "0 0 0")) / 2.0
    elif shape.tag == "sphere":
        half = np.full(3, numbers(shape, "radius", "0")[0])
    elif shape.tag in ("cylinder", "capsule"):
        radius, length = numbers(shape, "radius", "0")[0], numbers(shape, "length", "0")[0]
        half = np.array([radius, radius, length / 2.0 + (radius if shape.tag == "capsule" else 0.0)])
    else:
        points = points_of(folder / str(shape.get("filename")))
        if not len(points):
            return None
        scale = np.array(numbers(shape, "scale", "1 1 1"))
        low, high = points.min(axis=0) * scale, points.max(axis=0) * scale
        return np.minimum(low, high), np.maximum(low, high)
    return -half, half


def points_of(file: Path) -> Array:
    """(n, 3) vertices of a mesh file; none where it is missing or holds no triangle."""
    try:
        return mesh_points(file) if file.is_file() else np.zeros((0, 3))
    except ValueError:
        return np.zeros((0, 3))


def know_points(urdf: Path) -> None:
    """Read the small collision meshes of a URDF: this process, and those forked from it, then know their points."""
    with suppress(etree.XMLSyntaxError, OSError):
        for mesh in parsed(urdf).iterfind("link/collision/geometry/mesh"):
            file = urdf.parent / str(mesh.get("filename"))
            if file.suffix == ".obj":
                read_obj(file.read_bytes())


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
    across = np.cross(axis, moment / mass - frame[:3, 3])
    weight = mass * GRAVITY_M_S2
    return Pull(at, -weight * float(across[2]), -weight * float(np.cross(axis, across)[2]))


def moved_inertia(item: Mechanism, joint: str, poses: Mapping[str, Array]) -> float:
    """The inertia that the joint moves with what follows it, the root and all other joints held, with its armature:
    kg·m² about its axis, or kg."""
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
            speed = speed + (axis if slides else np.cross(axis, center - frame[:3, 3]))
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
