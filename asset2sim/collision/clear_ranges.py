"""Collision shapes that let joints move: overlaps over every joint's range are found, and mended where they may be.

Each joint moves through its range with the others at zero and at their initial positions. Where two links that engines
let collide overlap then, hulls are cut if the meshes themselves hardly overlap; where the meshes do, and near an end of
the range, the joint's limit is drawn in to where they meet; the rest is told.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from asset2sim.assets.authored_overlap import AuthoredShapes
from asset2sim.assets.hulls import Hulls
from asset2sim.collision.draw_in import draw_in, inside
from asset2sim.collision.jams import (
    Causes,
    Hit,
    Jam,
    Mechanism,
    all_hits,
    not_interlocked,
    pair_hits,
    rest_hits,
    worst_jams,
)
from asset2sim.collision.parting import mend, still
from asset2sim.collision.ranges import Limits, range_of, samples, stance_at, travel, within
from asset2sim.collision.trim import Bound, Cut, Trimmer
from asset2sim.engines.pybullet_object import MARGIN_M
from asset2sim.engines.pybullet_overlaps import HullWorld, clear_pose, hull_world
from asset2sim.physics.kinematics import TreeJoint
from schemas.vocabulary import OverlapCause

AUTHORED_AT_ZERO = Bound(share=0.25)
"""The most that is cut for parts that stand in each other as authored, at a joint zero that is not where the object
starts: a checker looks there, and a user rarely does."""
RELATED = Bound(share=0.2, depth_m=0.01)
"""The most that is cut for an overlap with the link's own parent or child, which most engines do not see: a gap of a
centimetre lets nothing through that matters."""
RELATED_M = 1e-4
"""Overlap from which that is done, margins not counted, m."""


@dataclass(frozen=True)
class Cleared:
    """Hulls that let joints move, what was cut, limits to draw in (joint → lower, upper) and the jams that caused it
    (``stops``), and the jams that are left."""

    hulls: Hulls
    cuts: tuple[Cut, ...] = ()
    limits: dict[str, tuple[float, float]] = field(default_factory=dict)
    stops: dict[str, Jam] = field(default_factory=dict)
    jams: tuple[Jam, ...] = ()


def clear_ranges(
    hulls: Hulls,
    tree: Sequence[TreeJoint],
    root: str,
    limits: Limits,
    initial: Mapping[str, float],
    pairs: Sequence[tuple[str, str]],
    authored: AuthoredShapes,
    exact: frozenset[str] = frozenset(),
) -> Cleared:
    """Clear the hulls of overlaps at rest (initial positions, joint zero) and over every joint's range.

    ``tree`` and ``limits`` are at the final scale (rad, m); ``pairs`` are the link pairs that engines let collide;
    links in ``exact`` may lose least. Deterministic: nothing depends on the time it takes.
    """
    at_zero = {joint.name: within(limits, joint.name, 0.0) for joint in tree}
    zero, start = stance_at(tree, root, at_zero), stance_at(tree, root, {**at_zero, **initial})
    start = zero if start.positions == zero.positions else start
    stances = (zero,) if start is zero else (zero, start)
    machine = Mechanism(tuple(tree), root, limits, stances, tuple(pairs))
    trimmer, causes = Trimmer(hulls, exact), Causes(authored)
    proposed: dict[str, tuple[float, float]] = {}
    stops: dict[str, Jam] = {}
    left: list[Hit] = []
    with hull_world(trimmer) as world:
        clear_pose(world, start.poses, list(pairs))
        rest = rest_hits(world, machine)
        apart = [hit for hit in rest if hit.stance is not start and causes.blocked(hit)]
        mend(world, [hit for hit in rest if hit not in apart])
        mend(world, apart, bound=AUTHORED_AT_ZERO)
        rest = [hit for hit in rest if still(world, hit)]
        for number in range(len(stances)):
            hits = not_interlocked(world, machine, list(all_hits(world, machine, number, rest)))
            deep = [hit for hit in hits if causes.blocked(hit)]
            draw_in(world, machine, deep, causes, proposed, stops)
            hits = [hit for hit in hits if inside(proposed, hit)]
            mend(world, [hit for hit in hits if not causes.blocked(hit)])
            left += [hit for hit in hits if still(world, hit)]
            authored_left = [hit for hit in left if causes.of(hit) is OverlapCause.AUTHORED]
            draw_in(world, machine, authored_left, causes, proposed, stops)
            left = [hit for hit in left if inside(proposed, hit)]
        jams = worst_jams([*rest, *left], causes)
        clear_related(world, machine, proposed)
    return Cleared(trimmer.result(), tuple(trimmer.cuts.values()), proposed, stops, jams)


def clear_related(world: HullWorld, machine: Mechanism, limits: Mapping[str, tuple[float, float]]) -> None:
    """Cut what reaches a little way from a link into its parent over the range of its joint.

    Where that does not clear the two of each other, nothing is cut: a part that is set into its parent stays so, and
    half a clearance is worth nothing.
    """
    for joint in machine.tree:
        a, b = joint.child, joint.parent
        span = range_of(joint, {**machine.limits, **limits})
        if span is None or not world.trimmer.hulls.get(a) or not world.trimmer.hulls.get(b):
            continue
        path = travel(machine.tree, joint.name, machine.stances[0], samples(*span, machine.kept(joint.name)))
        hits = list(pair_hits(world, path, a, b, 2.0 * MARGIN_M + RELATED_M))
        keys = tuple(dict.fromkeys(key for hit in hits for key in (hit.overlap.a, hit.overlap.b)))
        before = world.trimmer.state(*keys)
        mend(world, hits, (0.0,), RELATED)
        if any(still(world, hit) for hit in hits):
            world.trimmer.restore(before, *keys)
