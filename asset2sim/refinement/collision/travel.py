"""Link poses while one joint moves through its range and the others stay."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint, link_to_root, motion, subtree

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
class Travel:
    """One joint moving through ``positions`` (p,), rad or m: ``moves`` are (p, 4, 4) transforms in the root's frame
    that multiply the poses of ``links``. ``lever`` is a hinge's point and unit axis in the root's frame, None for a
    slider."""

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
        """Largest distance that a moving link's (n, 3) points travel per unit of joint motion, m/rad or m/m."""
        if self.lever is None:
            return 1.0
        pose, (center, axis) = self.stance.poses[link], self.lever
        arms = points @ pose[:3, :3].T + pose[:3, 3] - center
        return float(np.linalg.norm(arms - np.outer(arms @ axis, axis), axis=1).max())


def stance_at(tree: Sequence[TreeJoint], root: str, positions: Mapping[str, float]) -> Stance:
    """Stance at these joint positions; joints not named are at zero."""
    full = {joint.name: float(positions.get(joint.name, 0.0)) for joint in tree}
    return Stance(full, link_to_root(tree, root, full))


def within(limits: Limits, joint: str, position: float) -> float:
    """A position held within the joint's limits, where it has any."""
    lower, upper = limits.get(joint, (position, position))
    return min(max(position, lower), upper)


def range_of(joint: TreeJoint, limits: Limits) -> tuple[float, float] | None:
    """Range through which a joint is moved, rad or m; None for an empty range, and without limits unless a hinge."""
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
    """Sampled positions of a range: evenly spaced, and those of ``also`` that lie inside."""
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
