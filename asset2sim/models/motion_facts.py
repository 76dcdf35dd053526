"""How a joint moves its part, and what gravity does to it, in words: geometry alone, no simulator."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint, apply, joint_motion, link_to_root, rigid_links, tree_of
from asset2sim.physics.mass_matrix import Body, Pull, joint_space
from schemas.features import Features, JointFeatures, LinkFeatures
from schemas.settings import PhysicsSettings
from schemas.vocabulary import VolumeSource

UP = np.array([0.0, 0.0, 1.0])
OBLIQUE = 0.4
"""Component of a unit vector from which its direction is named."""
ALONG = 0.9
"""Component of a unit axis from which it counts as upright, left-right or front-back."""
CENTRAL = 0.2
"""Distance of an axis from its part's middle, as a share of the part's reach, below which the part spins in place."""
FAR_EDGE = 0.9
"""Share of its largest distance from the axis from which a corner belongs to a part's free edge."""
BALANCED = 0.05
"""Share of its weight's full leverage below which gravity does not move a part: less than any hinge's friction."""
SURE = PhysicsSettings().sure_of_closed
"""Confidence from which the closed end is taken to be known, as by validation."""


@dataclass(frozen=True)
class Motion:
    """Facts of one joint: its axis at rest, (3,) in the root frame, how its part ``opens``, what ``gravity`` does."""

    origin: Array
    opens: str
    gravity: str


def joint_motions(features: Features) -> dict[str, Motion]:
    """Joint → its motion in words, of the movable joints; every other joint at position 0."""
    tree = tree_of(features.joints)
    poses = link_to_root(tree, features.root, {})
    nodes = {node.name: node for node in tree}
    solid, shell = (gravity_pulls(features, tree, bodies) for bodies in mass_models(features))
    found = {}
    for joint in features.movable_joints:
        node = nodes[joint.name]
        frame = poses[node.parent] @ node.child_to_parent
        fits = carried_source(features, tree, joint) is VolumeSource.SIGNED
        first, second = (solid, shell) if fits else (shell, solid)
        opens = opening_words(features, tree, joint, poses, frame)
        weight = gravity_words(joint, first[joint.name], second[joint.name])
        found[joint.name] = Motion(frame[:3, 3], opens, weight)
    return found


def direction_words(vector: Array, front: Sequence[float], words: Sequence[str]) -> str:
    """The directions of a vector in words, its largest component first. ``words``: those for up, down, front, back,
    left and right, as seen by someone who stands before the object; "" for a vector without length."""
    length = float(np.linalg.norm(vector))
    if length < 1e-9:
        return ""
    left = np.cross(np.asarray(front, dtype=float), UP)
    parts = [float(vector @ axis) / length for axis in (UP, np.asarray(front, dtype=float), left)]
    named = [(abs(part), words[2 * index + (part < 0.0)]) for index, part in enumerate(parts) if abs(part) >= OBLIQUE]
    return " and ".join(word for _, word in sorted(named, key=lambda item: -round(item[0], 2)))


MOVES = ("up", "down", "forward", "backward", "to the left", "to the right")
PLACES = ("higher", "lower", "further forward", "further back", "further left", "further right")
SIDES = ("top", "bottom", "front", "back", "left", "right")


def axis_words(axis: Array, front: Sequence[float]) -> str:
    """The line along an axis in words, of an object that faces ``front``."""
    lines = (np.asarray(front), np.cross(front, UP), UP)
    for line, word in zip(lines, ("a front-to-back", "a left-to-right", "an upright"), strict=True):
        if abs(float(axis @ line)) >= ALONG:
            return word
    return "a slanting"


def box_corners(links: Iterable[LinkFeatures], poses: Mapping[str, Array]) -> Array:
    """(n, 3) the corners of the links' boxes in the root frame, m."""
    found = [np.zeros((0, 3))]
    for link in links:
        if link.has_geometry:
            grid = np.array(np.meshgrid(*zip(link.box_min, link.box_max, strict=True))).reshape(3, -1).T
            found.append(apply(poses[link.name], grid))
    return np.vstack(found)


def opening_words(
    features: Features, tree: Sequence[TreeJoint], joint: JointFeatures, poses: Mapping[str, Array], frame: Array
) -> str:
    """Which way the part goes from its closed end to its open end. ``frame`` is the joint's (4, 4) frame at rest."""
    moved = [features.link(name) for name in rigid_links(tree, joint.name)]
    closed, opened = joint.closed or 0.0, joint.open or 0.0
    node = next(item for item in tree if item.name == joint.name)
    axis, origin = frame[:3, :3] @ node.axis, frame[:3, 3]
    points = box_corners(moved, poses) @ frame[:3, :3] - origin @ frame[:3, :3]
    at_closed = apply(frame @ joint_motion(node, closed - node.position({})), points)
    if not len(points):
        return "moves no shape"
    way = math.copysign(1.0, opened - closed)
    sure = "" if joint.openness_confidence >= SURE or joint.type == "continuous" else "which end is closed is a guess; "
    if joint.prismatic:
        share = abs(opened - closed) / max(max(features.closed_size), 1e-12)
        goes = direction_words(way * axis, features.front, MOVES)
        return f"{sure}slides {goes} by {share:.0%} of the object's longest edge"
    arms = at_closed - origin
    arms = arms - np.outer(arms @ axis, axis)
    reach = np.linalg.norm(arms, axis=1)
    middle = (arms.min(axis=0) + arms.max(axis=0)) / 2.0
    line = f"{axis_words(axis, features.front)} line"
    turn = "without end" if joint.type == "continuous" else f"by {math.degrees(abs(opened - closed)):.0f}°"
    if float(np.linalg.norm(middle)) < CENTRAL * float(reach.max()):
        said = f"{sure}turns {turn} about {line} through its own middle"
        return said if joint.type == "continuous" else said + middle_edge_words(arms, way * axis, features.front)
    side = direction_words(-middle, features.front, SIDES)
    if joint.type == "continuous":
        return f"turns {turn} about {line} at its {side}"
    edge = at_closed[reach >= FAR_EDGE * float(reach.max())] - origin
    start = (way * np.cross(axis, edge)).mean(axis=0)
    pivot = np.eye(4)
    pivot[:3, :3] = joint_motion(TreeJoint("", "revolute", "", "", np.eye(4), axis), opened - closed)[:3, :3]
    end = (apply(pivot, edge) - edge).mean(axis=0)
    begins, ends = direction_words(start, features.front, MOVES), direction_words(end, features.front, PLACES)
    return f"{sure}turns {turn} about {line} at its {side}; its far edge sets off {begins}, ends {ends}"


def middle_edge_words(arms: Array, axis: Array, front: Sequence[float]) -> str:
    """Which way an edge goes of a part that opens about its own middle. ``arms`` are the (n, 3) corners from the axis,
    ``axis`` the unit axis about which it opens right-handedly."""
    ways = [np.asarray(front, dtype=float), np.cross(np.asarray(front, dtype=float), UP), UP]
    way = max(ways, key=lambda item: float((arms @ item).max()))
    edge = arms[arms @ way >= FAR_EDGE * float((arms @ way).max())]
    goes = direction_words(np.cross(axis, edge).mean(axis=0), front, MOVES)
    return f"; its {direction_words(way, front, SIDES)} edge sets off {goes}" if goes else ""


def mass_models(features: Features) -> tuple[dict[str, Body], dict[str, Body]]:
    """The links as solids of one density, and as walls of one thickness; their inertia is not needed."""
    nothing = np.zeros((3, 3))
    solid = {link.name: Body(link.volume_m3, np.asarray(link.center), nothing) for link in features.links}
    shell = {
        link.name: Body(link.outer_m2, np.asarray(link.shell_center if link.outer_m2 else link.center), nothing)
        for link in features.links
    }
    return solid, shell


def gravity_pulls(
    features: Features, tree: Sequence[TreeJoint], bodies: Mapping[str, Body]
) -> dict[str, tuple[Pull, float]]:
    """Joint → gravity's pull on it, and the largest that it could be in any direction of gravity."""
    space = joint_space(tree, features.root, bodies, {})
    return dict(zip(space.names, zip(space.pulls, space.largest_gravity.tolist(), strict=True), strict=True))


def carried_source(features: Features, tree: Sequence[TreeJoint], joint: JointFeatures) -> VolumeSource:
    """How the volume of the largest link that a joint moves was found."""
    moved = [features.link(name) for name in rigid_links(tree, joint.name)]
    return max(moved, key=lambda link: link.area_m2).volume_source if moved else VolumeSource.NONE


def gravity_words(joint: JointFeatures, pull: tuple[Pull, float], other: tuple[Pull, float]) -> str:
    """Effect of its weight alone on a part at its ends, half way and at rest, neither friction nor spring holding it,
    and where that turns round. ``other`` is the pull for another place of its centre of mass: where the two do not
    agree, it is unclear."""
    own, most = pull
    if joint.type == "continuous":
        wave = math.hypot(own.force, own.slope)
        if wave <= BALANCED * most:
            return "does not turn it"
        return f"swings until it hangs at {hanging_angle(own):.2f} rad"
    closed, opened = joint.closed or 0.0, joint.open or 0.0
    span = opened - closed
    if span == 0.0 or most <= 0.0:
        return "does not move it"
    places = {"closed": closed, "half open": closed + span / 2.0, "fully open": opened}
    low, high = sorted((closed, opened))
    if all(abs(at) > 0.05 * abs(span) for at in places.values()) and low < 0.0 < high:
        places["at position 0"] = 0.0
    said = {name: fate_of_part(at, joint, pull, other) for name, at in places.items()}
    if set(said.values()) == {"stays"}:
        return "stays wherever it is left"
    text = "; ".join(f"{name}: {word}" for name, word in said.items())
    return text + turning_words(own, most, closed, opened)


def fate_of_part(at: float, joint: JointFeatures, pull: tuple[Pull, float], other: tuple[Pull, float]) -> str:
    """Fate of a part that is left at a position, rad or m."""
    closed, opened = joint.closed or 0.0, joint.open or 0.0
    way = math.copysign(1.0, opened - closed)
    shares = [way * float(item.at(at)) / most if most > 0.0 else 0.0 for item, most in (pull, other)]
    if abs(shares[0]) <= BALANCED:
        return "stays"
    if shares[0] * shares[1] < 0.0:
        return "unclear, near its balance"
    if shares[0] > 0.0:
        return "stays open" if at == opened else "falls open"
    return "stays shut" if at == closed else "falls shut"


def turning_words(pull: Pull, most: float, closed: float, opened: float) -> str:
    """Where along a hinge's range gravity's pull turns round, in words; "" where it does not."""
    if pull.prismatic or math.hypot(pull.force, pull.slope) <= BALANCED * most:
        return ""
    low, high = sorted((closed, opened))
    said = ""
    first = pull.position + math.atan2(-pull.force, pull.slope)
    for turn in range(-4, 5):
        at = first + turn * math.pi
        if low < at < high:
            upright = float(pull.at(at + 1e-3)) > 0.0
            said += (
                f"; balances at {round(at, 3) + 0.0:g} rad and falls away from there to either side"
                if upright
                else (f"; hangs at {round(at, 3) + 0.0:g} rad")
            )
    return said


def hanging_angle(pull: Pull) -> float:
    """The angle at which a part hangs that turns freely, rad, nearest to zero."""
    at = pull.position + math.atan2(-pull.force, pull.slope)
    if float(pull.at(at + 1e-3)) > 0.0:
        at += math.pi
    return math.remainder(at, 2.0 * math.pi)
