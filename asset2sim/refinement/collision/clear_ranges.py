"""Clear hulls and joint limits of overlaps over every joint's range.

Each joint moves through its range with the others at zero, then at their initial positions. Where two links overlap
that engines let collide, hulls are cut if the authored meshes overlap by at most 5 mm. Where the meshes overlap near an
end of the range, the joint's limit is narrowed to where they meet. Other overlaps are reported as jams.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import ConvexHull

from asset2sim.assets.authored_overlap import AuthoredShapes
from asset2sim.assets.hulls import Hulls
from asset2sim.engines.static_object import MARGIN_M
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint
from asset2sim.refinement.collision.hull_world import HullWorld, clear_pose
from asset2sim.refinement.collision.jams import (
    JAM_M,
    Causes,
    Hit,
    Jam,
    JamContext,
    all_hits,
    not_interlocked,
    pair_hits,
    rest_hits,
    worst_jams,
)
from asset2sim.refinement.collision.part_links import hull_world
from asset2sim.refinement.collision.travel import Limits, clamped, range_of, sampled_positions, stance_at, travel
from asset2sim.refinement.collision.trim import Cut, Key, PlaneCut, TrimBound, Trimmer
from schemas.vocabulary import OverlapCause

LEAST_RANGE = 0.5
"""Smallest share of a joint's range that must remain when its limits are narrowed."""
BISECTIONS = 8
"""Bisections of the step between two sampled positions when a limit is narrowed: a step of 4 % becomes 0.02 %."""


def draw_in(
    world: HullWorld,
    machine: JamContext,
    hits: Sequence[Hit],
    causes: Causes,
    limits: dict[str, tuple[float, float]],
    stops: dict[str, Jam],
) -> None:
    """Narrow ``limits`` to exclude hits near an end of a joint's range; the worst jam of each joint goes to ``stops``.

    The new range contains zero, the initial position and at least ``LEAST_RANGE`` of the old one; else no change.
    """
    hits = [hit for hit in hits if hit.freed_by is None and hit.joint in machine.limits]
    for name in dict.fromkeys(hit.joint for hit in hits if hit.joint is not None):
        own = [hit for hit in hits if hit.joint == name]
        whole = machine.limits[name]
        lower, upper = limits.get(name, whole)
        low, high = min(machine.kept(name)), max(machine.kept(name))
        below = [hit for hit in own if lower <= hit.position < low]
        above = [hit for hit in own if high < hit.position <= upper]
        if any(low <= hit.position <= high for hit in own) or not (below or above):
            continue
        lower = nearest_free(world, machine, below, max(hit.position for hit in below), low) if below else lower
        upper = nearest_free(world, machine, above, min(hit.position for hit in above), high) if above else upper
        if upper - lower >= LEAST_RANGE * (whole[1] - whole[0]):
            limits[name] = (lower, upper)
            stops.setdefault(name, worst_jams(own, causes)[0])


def nearest_free(world: HullWorld, machine: JamContext, hits: Sequence[Hit], blocked: float, kept: float) -> float:
    """Joint position closest to ``blocked`` (rad or m) at which none of these hits' link pairs jam, by bisection."""
    paths = {hit.links: hit.travel for hit in hits if hit.travel is not None}
    positions = next(iter(paths.values())).positions
    free = float(positions[positions < blocked].max() if kept < blocked else positions[positions > blocked].min())
    for _ in range(BISECTIONS):
        middle = (free + blocked) / 2.0
        jammed = any(
            next(pair_hits(world, path.at(np.array([middle]), machine.tree), *links, JAM_M), None) is not None
            for links, path in paths.items()
        )
        blocked, free = (middle, free) if jammed else (blocked, middle)
    return free


def within_limits(limits: Mapping[str, tuple[float, float]], hit: Hit) -> bool:
    """Whether a hit lies within its joint's proposed limits; true where none are proposed."""
    lower, upper = limits.get(hit.joint or "", (hit.position, hit.position))
    return lower <= hit.position <= upper


GENTLE_SHARE = 0.05
"""Volume share lost up to which a way of cutting is accepted without trying the others."""
ATTEMPTS = 40
"""Most cuts tried on one pair of hulls."""
WAYS: tuple[float | None, ...] = (None, 1.0, 0.0)
"""Share of the cut that the first hull takes: None in proportion to extents, 1.0 all of it, 0.0 none."""


def cut_pairs(
    world: HullWorld, hits: Sequence[Hit], margins: Sequence[float] = (MARGIN_M, 0.0), bound: TrimBound | None = None
) -> None:
    """Cut hulls apart pair by pair, deepest overlap first, each with the least volume lost."""
    groups: dict[tuple[Key, Key], list[Hit]] = {}
    for hit in hits:
        groups.setdefault((hit.overlap.a, hit.overlap.b), []).append(hit)
    for group in sorted(groups.values(), key=lambda group: -max(hit.overlap.depth for hit in group)):
        mend_pair(world, group, margins, bound)


def mend_pair(world: HullWorld, hits: Sequence[Hit], margins: Sequence[float], bound: TrimBound | None) -> None:
    """Cut two hulls apart at all these poses, with the first margin that some way of cutting reaches within bounds, and
    the least volume lost; no change where none does."""
    trimmer, a, b = world.trimmer, hits[0].overlap.a, hits[0].overlap.b
    before = trimmer.state(a, b)
    for margin in margins:
        best: tuple[float, tuple[tuple[Array, ...], dict[tuple[str, str], Cut]]] | None = None
        for way in WAYS:
            done = cut_two_hulls(world, hits, margin, way, bound)
            if done:
                loss = lost_share(before[0], trimmer.state(a, b)[0])
                if best is None or loss < best[0]:
                    best = (loss, trimmer.state(a, b))
            trimmer.restore(before, a, b)
            if best is not None and best[0] <= GENTLE_SHARE:
                break
        if best is not None:
            trimmer.restore(best[1], a, b)
            return


def cut_two_hulls(
    world: HullWorld, hits: Sequence[Hit], margin: float, way: float | None, bound: TrimBound | None
) -> bool:
    """Cut two hulls at the deepest of these hits until none is left; False where a cut exceeds its bound."""
    tolerance = JAM_M if margin > 0.0 else 2.0 * MARGIN_M
    for _ in range(ATTEMPTS):
        seen = (world.overlap(h.overlap.a, h.overlap.b, h.overlap.pose_a, h.overlap.pose_b, tolerance) for h in hits)
        found = [over for over in seen if over is not None]
        if not found:
            return True
        if not world.trimmer.clear(max(found, key=lambda over: over.depth), margin, way, bound):
            return False
    return False


def lost_share(before: Sequence[Array], after: Sequence[Array]) -> float:
    """Sum over the hulls of the share of volume lost."""
    return sum(1.0 - ConvexHull(now).volume / ConvexHull(then).volume for then, now in zip(before, after, strict=True))


def still_overlaps(world: HullWorld, hit: Hit) -> bool:
    """Whether a hit's hulls still overlap; contact within the engine's margins does not count."""
    over = hit.overlap
    return world.overlap(over.a, over.b, over.pose_a, over.pose_b, 2.0 * MARGIN_M) is not None


AUTHORED_AT_ZERO = TrimBound(share=0.25)
"""Largest cut for parts whose authored meshes overlap at a joint zero that is not the initial state: a checker tests
that pose, a user rarely sees it."""
RELATED = TrimBound(share=0.2, depth_m=0.01)
"""Largest cut for an overlap of a link with its parent or child, whose contacts most engines filter out: objects do
not fall through a gap of 1 cm."""
RELATED_M = 1e-4
"""Overlap of a link with its parent from which it is cut, m, without the engine's margins."""


@dataclass(frozen=True)
class Cleared:
    """Cleared hulls, the cuts made, narrowed limits (joint → lower, upper), the jam that stops each narrowed joint
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
    planes: list[PlaneCut] | None = None,
) -> Cleared:
    """Clear the hulls of overlaps at rest (initial positions, joint zero) and over every joint's range.

    ``tree`` and ``limits`` are at the final scale (rad, m); ``pairs`` are the link pairs that engines let collide;
    links in ``exact`` are bound by ``LARGEST_EXACT_SHARE``; ``planes`` gets the cuts that were tried. Deterministic: no
    step depends on wall time.
    """
    at_zero = {joint.name: clamped(limits, joint.name, 0.0) for joint in tree}
    zero, start = stance_at(tree, root, at_zero), stance_at(tree, root, {**at_zero, **initial})
    start = zero if start.positions == zero.positions else start
    stances = (zero,) if start is zero else (zero, start)
    machine = JamContext(tuple(tree), root, limits, stances, tuple(pairs))
    trimmer, causes = Trimmer(hulls, exact, planes), Causes(authored)
    proposed: dict[str, tuple[float, float]] = {}
    stops: dict[str, Jam] = {}
    left: list[Hit] = []
    with hull_world(trimmer) as world:
        clear_pose(world, start.poses, list(pairs))
        rest = rest_hits(world, machine)
        apart = [hit for hit in rest if hit.stance is not start and causes.blocked(hit)]
        cut_pairs(world, [hit for hit in rest if hit not in apart])
        cut_pairs(world, apart, bound=AUTHORED_AT_ZERO)
        rest = [hit for hit in rest if still_overlaps(world, hit)]
        for number in range(len(stances)):
            hits = not_interlocked(world, machine, list(all_hits(world, machine, number, rest)))
            deep = [hit for hit in hits if causes.blocked(hit)]
            draw_in(world, machine, deep, causes, proposed, stops)
            hits = [hit for hit in hits if within_limits(proposed, hit)]
            cut_pairs(world, [hit for hit in hits if not causes.blocked(hit)])
            left += [hit for hit in hits if still_overlaps(world, hit)]
            authored_left = [hit for hit in left if causes.of(hit) is OverlapCause.AUTHORED]
            draw_in(world, machine, authored_left, causes, proposed, stops)
            left = [hit for hit in left if within_limits(proposed, hit)]
        jams = worst_jams([*rest, *left], causes)
        clear_related(world, machine, proposed)
    return Cleared(trimmer.result(), tuple(trimmer.cuts.values()), proposed, stops, jams)


def clear_related(world: HullWorld, machine: JamContext, limits: Mapping[str, tuple[float, float]]) -> None:
    """Cut shallow overlaps between each link and its parent over the range of the joint.

    All cuts of a pair are undone unless they clear it completely: a part embedded in its parent stays as it is, and a
    partial clearance does not free the joint.
    """
    for joint in machine.tree:
        a, b = joint.child, joint.parent
        span = range_of(joint, {**machine.limits, **limits})
        if span is None or not world.trimmer.hulls.get(a) or not world.trimmer.hulls.get(b):
            continue
        path = travel(machine.tree, joint.name, machine.stances[0], sampled_positions(*span, machine.kept(joint.name)))
        hits = list(pair_hits(world, path, a, b, 2.0 * MARGIN_M + RELATED_M))
        keys = tuple(dict.fromkeys(key for hit in hits for key in (hit.overlap.a, hit.overlap.b)))
        before = world.trimmer.state(*keys)
        cut_pairs(world, hits, (0.0,), RELATED)
        if any(still_overlaps(world, hit) for hit in hits):
            world.trimmer.restore(before, *keys)
