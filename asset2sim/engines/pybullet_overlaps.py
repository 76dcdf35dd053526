"""Overlaps between single convex hulls in PyBullet: depth and direction of the shortest way out."""

from collections.abc import Iterable, Mapping

import numpy as np
import pybullet
from pybullet_utils.bullet_client import BulletClient

from asset2sim.arrays import Array
from asset2sim.collision.hulls import Hulls
from asset2sim.collision.trim import CLEARANCE_M, ROUNDS, Cut, Overlap, Trimmer

MARGIN_M = 1e-3
"""PyBullet's margin around every mesh hull, m: two hulls touch for it while they are twice this apart."""


def cleared(
    hulls: Hulls,
    poses: Mapping[str, Array],
    pairs: Iterable[tuple[str, str]],
    exact: frozenset[str] = frozenset(),
) -> tuple[Hulls, tuple[Cut, ...]]:
    """The hulls cut until none of the link pairs overlap at these link-to-root poses, and what each link lost.

    Overlaps that would take too much of a hull are left as they are; links in ``exact`` may lose least.
    """
    trimmer = Trimmer(hulls, poses, exact)
    client = BulletClient(connection_mode=pybullet.DIRECT)
    try:
        bodies: dict[tuple[str, int], int] = {}
        pairs, stuck = list(pairs), set[tuple[tuple[str, int], tuple[str, int]]]()
        for _ in range(ROUNDS):
            changed = False
            for a, b in candidates(trimmer, pairs):
                if (a, b) in stuck:
                    continue
                for key in (a, b):
                    if key not in bodies:
                        bodies[key] = place(client, trimmer.placed(key))
                overlap = deepest(client, bodies[a], bodies[b], a, b)
                if overlap is None:
                    continue
                if not trimmer.clear(overlap, MARGIN_M):
                    stuck.add((a, b))
                changed = True
                for key in (a, b):
                    client.removeBody(bodies.pop(key))
            if not changed:
                break
        return trimmer.result(), tuple(trimmer.cuts.values())
    finally:
        client.disconnect()


def candidates(trimmer: Trimmer, pairs: Iterable[tuple[str, str]]) -> list[tuple[tuple[str, int], tuple[str, int]]]:
    """The hull pairs of these link pairs whose boxes come within the engine's margins of each other."""
    boxes = {
        (link, index): (trimmer.placed((link, index)).min(axis=0), trimmer.placed((link, index)).max(axis=0))
        for link, pieces in trimmer.hulls.items()
        for index in range(len(pieces))
    }
    found = []
    for first, second in pairs:
        for i in range(len(trimmer.hulls.get(first, []))):
            low, high = boxes[(first, i)]
            for j in range(len(trimmer.hulls.get(second, []))):
                other_low, other_high = boxes[(second, j)]
                if np.all(low <= other_high + 2.0 * MARGIN_M) and np.all(other_low <= high + 2.0 * MARGIN_M):
                    found.append(((first, i), (second, j)))
    return found


def place(client: BulletClient, points: Array) -> int:
    """A static body of one hull given in the root frame."""
    shape = client.createCollisionShape(pybullet.GEOM_MESH, vertices=points.tolist())
    return int(client.createMultiBody(0.0, shape))


def deepest(client: BulletClient, body_a: int, body_b: int, a: tuple[str, int], b: tuple[str, int]) -> Overlap | None:
    """The deepest point of two bodies' overlap, or None where they are apart by the margins."""
    points = client.getClosestPoints(body_a, body_b, 0.0)
    if not points:
        return None
    worst = min(points, key=lambda point: float(point[8]))
    if worst[8] >= -CLEARANCE_M / 10.0:
        return None
    return Overlap(a, b, np.array(worst[7], dtype=float), -float(worst[8]))
