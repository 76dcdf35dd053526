"""Where links are while one joint moves through its range and the others stay."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint, link_to_root, motion, subtree

SAMPLES = 25
"""Positions over a joint's range; overlaps that matter last longer than a twenty-fourth of it."""
TURN = (-np.pi, np.pi)
"""The range of a hinge without limits, rad."""

Limits = Mapping[str, tuple[float, float]]
"""Movable joint → lower and upper limit, rad or m; joints without limits are not in it."""


@dataclass(frozen=True)
class Stance:
    """Joint positions that the others keep while one joint moves, with the (4, 4) link-to-root poses there."""

    positions: Mapping[str, float]
    poses: Mapping[str, Array]


@dataclass(frozen=True)
class Travel:
    """One joint moving through ``positions`` (p,): what its subtree's poses are multiplied by, (p, 4, 4) in the root's
    frame, and the links that move. ``lever`` is the point and unit axis of a hinge in the root's frame, None if it
    slides."""

    joint: str
    stance: Stance
    positions: Array
    moves: Array
    links: tuple[str, ...]
    lever: tuple[Array, Array] | None

    def poses(self, link: str) -> Array:
        """(p, 4, 4) link-to-root poses of a link that moves."""
        placed: Array = self.moves @ self.stance.poses[link]
        return placed

    def at(self, positions: Array, tree: Sequence[TreeJoint]) -> "Travel":
        """The same joint from the same stance at other positions (k,)."""
        return travel(tree, self.joint, self.stance, positions)

    def speed(self, link: str, points: Array) -> float:
        """How far any of a moving link's (n, 3) points goes for a unit of the joint, m/rad or m/m."""
        if self.lever is None:
            return 1.0
        pose, (center, axis) = self.stance.poses[link], self.lever
        arms = points @ pose[:3, :3].T + pose[:3, 3] - center
        return float(np.linalg.norm(arms - np.outer(arms @ axis, axis), axis=1).max())


def stance_at(tree: Sequence[TreeJoint], root: str, positions: Mapping[str, float]) -> Stance:
    """The stance at these positions; joints not named are at zero."""
    full = {joint.name: float(positions.get(joint.name, 0.0)) for joint in tree}
    return Stance(full, link_to_root(tree, root, full))


def within(limits: Limits, joint: str, position: float) -> float:
    """A position held within the joint's limits, where it has any."""
    lower, upper = limits.get(joint, (position, position))
    return min(max(position, lower), upper)


def range_of(joint: TreeJoint, limits: Limits) -> tuple[float, float] | None:
    """The range that a joint is moved through; None where it has none."""
    if joint.name in limits:
        lower, upper = limits[joint.name]
        return (lower, upper) if upper > lower else None
    return TURN if joint.type in ("revolute", "continuous") else None


def travel(tree: Sequence[TreeJoint], name: str, stance: Stance, positions: Array) -> Travel:
    """The named joint's travel through ``positions`` (p,) from a stance."""
    joint = next(joint for joint in tree if joint.name == name)
    frame = stance.poses[joint.parent] @ joint.child_to_parent
    back = np.linalg.inv(motion(joint, stance.positions[name])) @ np.linalg.inv(frame)
    moves = np.array([frame @ motion(joint, float(position)) @ back for position in positions])
    lever = None if joint.type == "prismatic" else (frame[:3, 3], frame[:3, :3] @ joint.axis)
    return Travel(name, stance, np.asarray(positions, dtype=float), moves, subtree(tree, name), lever)


def samples(lower: float, upper: float, also: Iterable[float]) -> Array:
    """The positions at which a range is looked at: evenly spread, and ``also`` where it is inside."""
    spread = np.linspace(lower, upper, SAMPLES)
    return np.unique(np.concatenate([spread, [value for value in also if lower <= value <= upper]]))


def chain(tree: Sequence[TreeJoint], link: str) -> tuple[str, ...]:
    """The movable joints from a link up to the root."""
    above = {joint.child: joint for joint in tree}
    names = []
    while link in above:
        if above[link].type != "fixed":
            names.append(above[link].name)
        link = above[link].parent
    return tuple(names)
