"""Link poses while one joint moves through its range and the others stay."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint, joint_motion, link_to_root, rigid_links

SAMPLES = 25
"""Positions sampled over a joint's range; overlaps that matter span more than 1/24 of it."""
TURN = (-np.pi, np.pi)
"""The range of a hinge without limits, rad."""

Limits = Mapping[str, tuple[float, float]]
"""Movable joint → lower and upper limit, rad or m; joints without limits are not in it."""


@dataclass(frozen=True)
class Stance:
    """Joint positions (rad or m) at which all joints but one stay, and the (4, 4) link-to-root poses there."""

    positions: Mapping[str, float]
    poses: Mapping[str, Array]


@dataclass(frozen=True)
class Drive:
    """Links that one joint moves: ``links``, ``ratio`` as far (rad or m) as the joint that travels. ``lever`` is a
    hinge's
    point and unit axis in the root's frame, None for a slider."""

    links: tuple[str, ...]
    ratio: float
    lever: tuple[Array, Array] | None


@dataclass(frozen=True)
class Travel:
    """One joint moving through ``positions`` (p,), rad or m, with those that follow it: ``moves`` are, for each link
    that moves, (p, 4, 4) transforms in the root's frame that multiply its pose."""

    joint: str
    stance: Stance
    positions: Array
    moves: Mapping[str, Array]
    drives: tuple[Drive, ...]

    @property
    def links(self) -> tuple[str, ...]:
        """The links that move."""
        return tuple(self.moves)

    def poses(self, link: str) -> Array:
        """(p, 4, 4) link-to-root poses of a link that moves."""
        placed: Array = self.moves[link] @ self.stance.poses[link]
        return placed

    def at(self, positions: Array, tree: Sequence[TreeJoint]) -> "Travel":
        """The same joint from the same stance at other positions (k,)."""
        return travel(tree, self.joint, self.stance, positions)

    def speed(self, link: str, points: Array) -> float:
        """Largest distance that a moving link's (n, 3) points travel per unit of joint motion, m/rad or m/m."""
        pose, total = self.stance.poses[link], 0.0
        for drive in self.drives:
            if link not in drive.links:
                continue
            distance = 1.0
            if drive.lever is not None:
                center, axis = drive.lever
                arms = points @ pose[:3, :3].T + pose[:3, 3] - center
                distance = float(np.linalg.norm(arms - np.outer(arms @ axis, axis), axis=1).max())
            total += drive.ratio * distance
        return total


def stance_at(tree: Sequence[TreeJoint], root: str, positions: Mapping[str, float]) -> Stance:
    """Stance at these joint positions; joints not named are at zero."""
    full = {joint.name: float(positions.get(joint.name, 0.0)) for joint in tree}
    return Stance(full, link_to_root(tree, root, full))


def clamped(limits: Limits, joint: str, position: float) -> float:
    """A position held within the joint's limits, where it has any."""
    lower, upper = limits.get(joint, (position, position))
    return min(max(position, lower), upper)


def range_of(joint: TreeJoint, limits: Limits) -> tuple[float, float] | None:
    """Range through which a joint is moved, rad or m; None for an empty range, and without limits unless a hinge. A
    joint that follows another is moved by that one."""
    if joint.mimic is not None:
        return None
    if joint.name in limits:
        lower, upper = limits[joint.name]
        return (lower, upper) if upper > lower else None
    return TURN if joint.type in ("revolute", "continuous") else None


def travel(tree: Sequence[TreeJoint], name: str, stance: Stance, positions: Array) -> Travel:
    """The named joint's travel through ``positions`` (p,) from a stance."""
    joint = next(joint for joint in tree if joint.name == name)
    frame = stance.poses[joint.parent] @ joint.child_to_parent
    back = np.linalg.inv(joint_motion(joint, stance.positions[name])) @ np.linalg.inv(frame)
    moves = np.array([frame @ joint_motion(joint, float(position)) @ back for position in positions])
    drives = [Drive(rigid_links(tree, name), 1.0, lever_of(joint, stance))]
    moved = dict.fromkeys(drives[0].links, moves)
    followers = [item for item in tree if item.mimic is not None and item.mimic.joint == name]
    if followers:
        root = next(iter(stance.poses))  # poses begin with the root's
        drives += [
            Drive(rigid_links(tree, item.name), abs(mimic.multiplier), lever_of(item, stance))
            for item in followers
            if (mimic := item.mimic) is not None
        ]
        placed = [link_to_root(tree, root, {**stance.positions, name: float(position)}) for position in positions]
        for link in (link for drive in drives[1:] for link in drive.links):
            back = np.linalg.inv(stance.poses[link])
            moved[link] = np.array([poses[link] @ back for poses in placed])
    return Travel(name, stance, np.asarray(positions, dtype=float), moved, tuple(drives))


def lever_of(joint: TreeJoint, stance: Stance) -> tuple[Array, Array] | None:
    """A hinge's point and unit axis in the root's frame, None for a slider."""
    frame = stance.poses[joint.parent] @ joint.child_to_parent
    return None if joint.type == "prismatic" else (frame[:3, 3], frame[:3, :3] @ joint.axis)


def sampled_positions(lower: float, upper: float, also: Iterable[float]) -> Array:
    """Sampled positions of a range: evenly spaced, and those of ``also`` that lie inside."""
    spread = np.linspace(lower, upper, SAMPLES)
    return np.unique(np.concatenate([spread, [value for value in also if lower <= value <= upper]]))


def joints_to_root(tree: Sequence[TreeJoint], link: str) -> tuple[str, ...]:
    """The movable joints from a link up to the root; for one that follows another, that one."""
    above = {joint.child: joint for joint in tree}
    names = []
    while link in above:
        joint = above[link]
        if joint.type != "fixed":
            names.append(joint.name if joint.mimic is None else joint.mimic.joint)
        link = joint.parent
    return tuple(names)
