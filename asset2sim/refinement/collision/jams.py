"""Jams: overlaps of hulls over a joint's range that stop it, and their causes.

A jam is an overlap of two links that engines let collide, deeper than the pair's overlap at rest, that moving no joint
of the obstacle clears: a rack behind a closed door is not jammed.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from asset2sim.assets.authored_overlap import TOUCHING_M, AuthoredShapes, authored_depth
from asset2sim.assets.meshes.hull import boxes_meet
from asset2sim.engines.static_object import MARGIN_M
from asset2sim.physics.arrays import corners_of_box
from asset2sim.physics.kinematics import TreeJoint
from asset2sim.refinement.collision.hull_world import FAR_M, REACH_M, HullWorld, boxes_at, candidates
from asset2sim.refinement.collision.travel import (
    Limits,
    Stance,
    Travel,
    joints_to_root,
    range_of,
    sampled_positions,
    stance_at,
    travel,
)
from asset2sim.refinement.collision.trim import CLEARANCE_M, Overlap
from schemas.vocabulary import OverlapCause

JAM_M = 1e-4
"""Overlap from which a joint counts as jammed, m, with the engine's margins (2 mm in all): margins do not yield."""
LARGEST_AUTHORED_M = 5e-3
"""Deepest overlap of authored meshes that is cleared by cutting hulls, m: parts that touch or are slightly misplaced.
A deeper overlap is taken as intended by the author."""


@dataclass(frozen=True)
class Jam:
    """Two links that overlap where ``joint`` is at ``position`` (rad or m); joint None is the whole object at rest.

    ``freed_by`` is a joint further up that lets the first link pass when it is at one of its limits, if there is one.
    """

    joint: str | None
    position: float
    link_a: str
    link_b: str
    depth_m: float
    cause: OverlapCause
    freed_by: str | None = None


@dataclass(frozen=True, eq=False)
class Hit:
    """Overlap of two hulls in a stance, with one joint at ``position`` along ``travel`` (None: at rest)."""

    stance: Stance
    travel: Travel | None
    position: float
    overlap: Overlap
    freed_by: str | None = None

    @property
    def joint(self) -> str | None:
        """Joint that moves, None at rest."""
        return None if self.travel is None else self.travel.joint

    @property
    def links(self) -> tuple[str, str]:
        """Moving link and obstacle."""
        return self.overlap.a[0], self.overlap.b[0]


@dataclass(frozen=True)
class JamContext:
    """Constants of one asset while its hulls are cut: joint tree, limits, stances, and link pairs that collide."""

    tree: tuple[TreeJoint, ...]
    root: str
    limits: Limits
    stances: tuple[Stance, ...]
    pairs: tuple[tuple[str, str], ...]

    @cached_property
    def known_pairs(self) -> frozenset[tuple[str, str]]:
        """``pairs`` as a set."""
        return frozenset(self.pairs)

    def collide(self, a: str, b: str) -> bool:
        """Whether engines let these links collide."""
        return (a, b) in self.known_pairs or (b, a) in self.known_pairs

    def kept(self, joint: str) -> tuple[float, ...]:
        """The positions of a joint that must stay within its limits: zero, and the initial one."""
        return tuple(stance.positions[joint] for stance in self.stances)


class Causes:
    """Overlap depths of the authored meshes at hits, cached by pair and position."""

    def __init__(self, authored: AuthoredShapes) -> None:
        self.authored = authored
        self.known: dict[tuple[int, str | None, float, str, str], float] = {}

    def depth(self, hit: Hit) -> float:
        """Overlap depth of the authored meshes of a hit's links, m."""
        key = (id(hit.stance), hit.joint, hit.position, *hit.links)
        if key not in self.known:
            over, back = hit.overlap, np.linalg.inv(hit.overlap.pose_b)
            self.known[key] = authored_depth(self.authored, *hit.links, back @ over.pose_a, back[:3, :3] @ over.normal)
        return self.known[key]

    def blocked(self, hit: Hit) -> bool:
        """Whether the meshes overlap by more than ``LARGEST_AUTHORED_M``, so that no hull is cut."""
        return self.depth(hit) > LARGEST_AUTHORED_M

    def of(self, hit: Hit) -> OverlapCause:
        """Cause of a hit's overlap."""
        return OverlapCause.AUTHORED if self.depth(hit) > TOUCHING_M else OverlapCause.HULL


def rest_hits(world: HullWorld, machine: JamContext) -> list[Hit]:
    """Overlaps of hulls in every stance, no joint moved."""
    found = []
    for stance in machine.stances:
        for a, b in candidates(world.trimmer, stance.poses, machine.pairs):
            over = world.overlap(a, b, stance.poses[a[0]], stance.poses[b[0]], CLEARANCE_M)
            if over is not None:
                found.append(Hit(stance, None, 0.0, over))
    return found


def all_hits(world: HullWorld, machine: JamContext, number: int, rest: Sequence[Hit]) -> Iterator[Hit]:
    """Overlaps of hulls over every joint's range in one stance, where deeper than the pair's overlap at rest."""
    stance = machine.stances[number]
    depths: dict[frozenset[str], float] = {}
    for hit in rest:
        depths[frozenset(hit.links)] = max(hit.overlap.depth, depths.get(frozenset(hit.links), 0.0))
    for joint in machine.tree:
        span = range_of(joint, machine.limits)
        if span is None:
            continue
        path = travel(machine.tree, joint.name, stance, sampled_positions(*span, machine.kept(joint.name)))
        for a, b in near_links(world, machine, path):
            if number == 0 or not same_as_at_zero(machine, number, joint.name, a, b):
                yield from pair_hits(world, path, a, b, depths.get(frozenset((a, b)), 0.0) + JAM_M)


def same_as_at_zero(machine: JamContext, number: int, joint: str, a: str, b: str) -> bool:
    """Whether this stance repeats stance 0 for two links: all other joints between them have the same positions."""
    between = set(joints_to_root(machine.tree, a)) ^ set(joints_to_root(machine.tree, b))
    first, second = machine.stances[0].positions, machine.stances[number].positions
    return all(first[name] == second[name] for name in between - {joint})


def near_links(world: HullWorld, machine: JamContext, path: Travel) -> list[tuple[str, str]]:
    """(moving link, obstacle) pairs that engines let collide and whose bounding boxes meet along the path."""
    hulls, poses = world.trimmer.hulls, path.stance.poses
    moving = [link for link in path.links if hulls.get(link)]
    still_ones = [link for link in poses if link not in path.links and hulls.get(link)]
    if not moving or not still_ones:
        return []
    boxes = [boxes_at(hulls[link], poses[link]) for link in still_ones]
    low, high = np.array([box[0].min(axis=0) for box in boxes]), np.array([box[1].max(axis=0) for box in boxes])
    found = []
    for a in moving:
        corners = corners_of_box(np.vstack(hulls[a]))
        placed = np.einsum("pij,kj->pki", path.poses(a)[:, :3, :3], corners) + path.poses(a)[:, None, :3, 3]
        meet = boxes_meet((placed.min(axis=1), placed.max(axis=1)), (low, high), REACH_M).any(axis=0)
        found += [(a, still_ones[j]) for j in np.flatnonzero(meet) if machine.collide(a, still_ones[j])]
    return found


def pair_hits(world: HullWorld, path: Travel, a: str, b: str, tolerance: float) -> Iterator[Hit]:
    """Overlaps deeper than ``tolerance`` (m) between hulls of moving link ``a`` and obstacle ``b`` along a path."""
    pose_b = path.stance.poses[b]
    poses = list(path.poses(a))
    boxes_b = boxes_at(world.trimmer.hulls[b], pose_b)
    near = np.array([boxes_meet(boxes_at(world.trimmer.hulls[a], pose), boxes_b, REACH_M) for pose in poses])
    for i, j in np.argwhere(near.any(axis=0)):
        first, second = (a, int(i)), (b, int(j))
        speed, clear_until = path.speed(a, world.trimmer.hull(first)), -np.inf
        for index in np.flatnonzero(near[:, i, j]):
            position = float(path.positions[index])
            if position < clear_until:
                continue
            found = world.closest(first, second, poses[index], pose_b, FAR_M)
            if found is None:
                continue
            gap, normal = found
            if gap < -tolerance:
                yield Hit(path.stance, path, position, Overlap(first, second, poses[index], pose_b, normal, -gap))
            elif speed > 0.0:
                # ``speed`` bounds every point of the hull: before this position the two cannot meet.
                clear_until = position + max(gap, 0.0) / speed


def not_interlocked(world: HullWorld, machine: JamContext, hits: list[Hit]) -> list[Hit]:
    """Hits that no joint of the obstacle clears; ``freed_by`` is set where a joint above the moving link does."""
    groups: dict[tuple[str | None, str, str], list[Hit]] = {}
    for hit in hits:
        groups.setdefault((hit.joint, *hit.links), []).append(hit)
    kept: list[Hit] = []
    for group in groups.values():
        own, others = (joints_to_root(machine.tree, link) for link in group[0].links)
        left, _ = hits_left(world, machine, group, [name for name in others if name not in own])
        if left:
            stuck, by = hits_left(world, machine, left, [name for name in own if name not in (left[0].joint, *others)])
            kept += left if stuck else [replace(hit, freed_by=by) for hit in left]
    return kept


def hits_left(
    world: HullWorld, machine: JamContext, hits: list[Hit], joints: Sequence[str]
) -> tuple[list[Hit], str | None]:
    """Fewest hits of one pair and travel that remain after moving one of these joints, and that joint (None if none
    helps). Positions tried are the joint's limits, and zero where the stance is not at zero."""
    (a, b), path = hits[0].links, hits[0].travel
    best: tuple[list[Hit], str | None] = hits, None
    if path is None:
        return best
    positions = np.unique([hit.position for hit in hits])
    for name in joints:
        here = path.stance.positions[name]
        for position in (*machine.limits.get(name, ()), machine.stances[0].positions[name]):
            if abs(position - here) < 1e-9:
                continue
            stance = stance_at(machine.tree, machine.root, {**path.stance.positions, name: position})
            other = travel(machine.tree, path.joint, stance, positions)
            blocked = {hit.position for hit in pair_hits(world, other, a, b, JAM_M)}
            left = [hit for hit in hits if hit.position in blocked]
            best = (left, name) if len(left) < len(best[0]) else best
            if not left:
                return best
    return best


def worst_jams(hits: Sequence[Hit], causes: Causes) -> tuple[Jam, ...]:
    """The deepest hit of each joint and link pair, deepest first; depths without the engine's margins."""
    worst: dict[tuple[str | None, str, str], Hit] = {}
    for hit in hits:
        key = (hit.joint, *hit.links)
        if key not in worst or hit.overlap.depth > worst[key].overlap.depth:
            worst[key] = hit
    jams = []
    for hit in sorted(worst.values(), key=lambda hit: -hit.overlap.depth):
        depth = max(hit.overlap.depth - 2.0 * MARGIN_M, 0.0)
        jams.append(Jam(hit.joint, hit.position, *hit.links, depth, causes.of(hit), hit.freed_by))
    return tuple(jams)
