"""Which joints may be checked in one run, and how a check is run over all joints at once.

With the root held, the mass matrix couples two joints only where one is an ancestor of the other: a link moves with
both. Joints of which none is an ancestor of another are therefore independent, and one run checks them all; what is
left to couple them is contact between the parts that they move, which the boxes that they sweep foretell. So joints
that do badly in company are checked again in smaller company, at last alone.
"""

import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

import numpy as np

from asset2sim.checks.mechanism import Mechanism, poses_at, span_of
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import apply, in_chains, joint_motion
from schemas.interaction import Effort, Hold
from schemas.overlay import JointPhysics

CLEARANCE_M = 1e-3
"""Distance that boxes are kept apart, m: engines keep margins around shapes."""


def swept_box(item: Mechanism, joint: JointPhysics, poses: dict[str, Array], samples: int) -> tuple[Array, Array]:
    """(3,) least and greatest corner of all that the joint moves, over its range, in the root's frame, m; without
    bounds where others follow it, so that it is moved alone."""
    if joint.name in item.followers:
        return np.full(3, -np.inf), np.full(3, np.inf)
    entry = next(found for found in item.tree if found.name == joint.name)
    frame = poses[entry.parent] @ entry.child_to_parent
    base = frame @ joint_motion(entry, joint.initial_position)
    back = np.linalg.inv(base)
    parts = [apply(back @ poses[link], item.boxes[link]) for link in item.moved[joint.name] if link in item.boxes]
    if not parts:
        return np.full(3, np.inf), np.full(3, -np.inf)
    points = np.vstack(parts)
    lower, upper = span_of(joint)
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for position in np.linspace(lower, upper, samples):
        placed = apply(frame @ joint_motion(entry, float(position)), points)
        low, high = np.minimum(low, placed.min(axis=0)), np.maximum(high, placed.max(axis=0))
    margin = CLEARANCE_M / 2.0
    if entry.type != "prismatic":
        # Between two samples a corner goes on an arc, beyond its chord by the sagitta.
        reach = float(np.linalg.norm(points, axis=1).max())
        margin += reach * (1.0 - math.cos((upper - lower) / (samples - 1) / 2.0))
    return low - margin, high + margin


def apart_groups(item: Mechanism, samples: int) -> list[tuple[JointPhysics, ...]]:
    """The joints in groups of which no two move a common link or sweep boxes that meet, filled first come first served.

    Moving a whole group at once then shows each joint exactly the overlaps that it has alone: its parts meet those of
    the rest of the object where they are initially, and never another of its group.
    """
    poses = poses_at(item, item.start)
    groups: list[tuple[list[JointPhysics], set[str], list[tuple[Array, Array]]]] = []
    for joint in item.asked:
        low, high = swept_box(item, joint, poses, samples)
        fitting = (
            group
            for group in groups
            if group[1].isdisjoint(item.moved[joint.name]) and is_clear_of(low, high, group[2])
        )
        group = next(fitting, None)
        if group is None:
            group = ([], set(), [])
            groups.append(group)
        group[0].append(joint)
        group[1].update(item.moved[joint.name])
        group[2].append((low, high))
    return [tuple(members) for members, _, _ in groups]


def is_clear_of(low: Array, high: Array, boxes: Iterable[tuple[Array, Array]]) -> bool:
    """Whether a box meets none of the others."""
    return not any(np.all(low <= other_high) and np.all(other_low <= high) for other_low, other_high in boxes)


OfJoint = TypeVar("OfJoint", Hold, Effort)


def by_joint(records: Iterable[OfJoint]) -> list[tuple[str, list[OfJoint]]]:
    """Each joint with its records: one is held at several positions, and moved both ways."""
    grouped: dict[str, list[OfJoint]] = {}
    for item in records:
        grouped.setdefault(item.joint, []).append(item)
    return list(grouped.items())


MOST_RUNS = 16
"""Runs of one check after which no batch is halved any more: one bad key among a hundred takes 14 to be found."""
Record = TypeVar("Record")


def depth_groups(item: Mechanism, names: Iterable[str]) -> list[tuple[str, ...]]:
    """The joints in groups, by depth among the named ones, so that no group has a joint and its ancestor."""
    wanted = set(names)
    groups: dict[int, list[str]] = {}
    for joint in item.joints:
        if joint.name in wanted:
            child = next(entry.child for entry in item.tree if entry.name == joint.name)
            depth = sum(1 for above in item.chain[child] if above in wanted)
            groups.setdefault(depth, []).append(joint.name)
    return [tuple(groups[depth]) for depth in sorted(groups)]


def run_in_groups(
    item: Mechanism,
    names: Iterable[str],
    run: Callable[[Sequence[str]], dict[str, Record]],
    good: Callable[[Record], bool],
) -> dict[str, Record]:
    """Run a check on independent joints together, and on all of a chain, which moves as a whole; those whose record is
    not ``good`` again in halves, at last alone."""
    records: dict[str, Record] = {}
    chained, names = {*in_chains(item.tree)}, tuple(names)
    whole = tuple(name for name in names if name in chained)
    waiting = [whole] * bool(whole) + depth_groups(item, [name for name in names if name not in chained])
    for number in itertools.count():
        if not waiting:
            break
        group = waiting.pop(0)
        together = run(group)
        records |= together
        doubtful = tuple(name for name in group if name in together and not good(together[name]))
        if doubtful and len(group) > 1 and number < MOST_RUNS:
            half = len(doubtful) // 2
            waiting += [part for part in (doubtful[:half], doubtful[half:]) if part]
    return records
