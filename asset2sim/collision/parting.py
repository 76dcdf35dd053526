"""Parting hulls that jam: cut where they overlap, over all positions at once, in the way that takes least of them."""

from collections.abc import Sequence

from scipy.spatial import ConvexHull

from asset2sim.collision.jams import JAM_M, Hit
from asset2sim.collision.trim import Bound, Cut, Key
from asset2sim.engines.pybullet_object import MARGIN_M
from asset2sim.engines.pybullet_overlaps import HullWorld
from asset2sim.physics.arrays import Array

GENTLE_SHARE = 0.05
"""Share of two hulls' volumes up to which the first way of cutting is taken as it is."""
ATTEMPTS = 40
"""Cuts on one pair of hulls after which it is given up."""
WAYS: tuple[float | None, ...] = (None, 1.0, 0.0)
"""Ways of cutting two hulls apart: each by its extent, only the first, only the second."""


def mend(
    world: HullWorld, hits: Sequence[Hit], margins: Sequence[float] = (MARGIN_M, 0.0), bound: Bound | None = None
) -> None:
    """Cut hulls apart pair by pair, the deepest first, in the way that takes least of them."""
    groups: dict[tuple[Key, Key], list[Hit]] = {}
    for hit in hits:
        groups.setdefault((hit.overlap.a, hit.overlap.b), []).append(hit)
    for group in sorted(groups.values(), key=lambda group: -max(hit.overlap.depth for hit in group)):
        mend_pair(world, group, margins, bound)


def mend_pair(world: HullWorld, hits: Sequence[Hit], margins: Sequence[float], bound: Bound | None) -> None:
    """Cut two hulls apart at all these poses: the way that takes the least share, with the first of these margins for
    which one is within bounds; left as they are where none is."""
    trimmer, a, b = world.trimmer, hits[0].overlap.a, hits[0].overlap.b
    before = trimmer.state(a, b)
    for margin in margins:
        best: tuple[float, tuple[tuple[Array, ...], dict[tuple[str, str], Cut]]] | None = None
        for way in WAYS:
            done = part(world, hits, margin, way, bound)
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


def part(world: HullWorld, hits: Sequence[Hit], margin: float, way: float | None, bound: Bound | None) -> bool:
    """Cut two hulls at the deepest of these hits until none is left; whether that was within bounds."""
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
    """The sum of the shares of their volumes that hulls lost."""
    return sum(1.0 - ConvexHull(now).volume / ConvexHull(then).volume for then, now in zip(before, after, strict=True))


def still(world: HullWorld, hit: Hit) -> bool:
    """Whether a hit is still there; what cutting without margins leaves touching is not."""
    over = hit.overlap
    return world.overlap(over.a, over.b, over.pose_a, over.pose_b, 2.0 * MARGIN_M) is not None
