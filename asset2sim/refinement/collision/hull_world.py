"""Overlaps between single convex hulls in PyBullet: depth and direction of the shortest way out."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from math import sqrt

import numpy as np
import pybullet
from pybullet_utils.bullet_client import BulletClient

from asset2sim.assets.hulls import Hulls
from asset2sim.assets.meshes.hull import boxes_meet
from asset2sim.engines.pybullet_object import MARGIN_M, empty_client
from asset2sim.physics.arrays import Array
from asset2sim.refinement.collision.trim import CLEARANCE_M, ROUNDS, Cut, Key, Overlap, Trimmer

LEAST_GAP_M = CLEARANCE_M / 2.0
"""Gap beyond the engine's margins below which two links count as touching, m: two doors whose edges touch cannot open
in a rigid engine, for the inner corner of each swings out a little."""
REACH_M = 2.0 * MARGIN_M + LEAST_GAP_M
"""Distance within which the engine's margins of two hulls meet or touch, m."""
FAR_M = 1e3
"""Distance up to which hulls are measured against each other, m: any object is smaller."""


class HullWorld:
    """A world with a static body for every hull of a trimmer, each placed by its link's pose when it is asked about."""

    def __init__(self, client: BulletClient, trimmer: Trimmer) -> None:
        self.client = client
        self.trimmer = trimmer
        self.bodies: dict[Key, tuple[int, Array]] = {}
        self.places: dict[Key, Array] = {}

    def closest(self, a: Key, b: Key, pose_a: Array, pose_b: Array, reach: float = 0.0) -> tuple[float, Array] | None:
        """The distance (m, negative where they overlap, PyBullet's margins counted) of two hulls whose links are at
        these (4, 4) poses, and the unit (3,) normal from B to A; None where they are more than ``reach`` apart."""
        points = self.client.getClosestPoints(self._placed(a, pose_a), self._placed(b, pose_b), reach)
        if not points:
            return None
        worst = min(points, key=lambda point: float(point[8]))
        return float(worst[8]), np.array(worst[7], dtype=float)

    def overlap(self, a: Key, b: Key, pose_a: Array, pose_b: Array, tolerance: float) -> Overlap | None:
        """The two hulls' overlap at these poses if it is deeper than ``tolerance`` (m, margins counted), else None."""
        found = self.closest(a, b, pose_a, pose_b, max(-tolerance, 0.0))
        if found is None or found[0] >= -tolerance:
            return None
        return Overlap(a, b, pose_a, pose_b, found[1], -found[0])

    def _placed(self, key: Key, pose: Array) -> int:
        """Body index of a hull in its present shape, moved to the pose of its link."""
        points = self.trimmer.hull(key)
        known = self.bodies.get(key)
        if known is None or known[1] is not points:
            if known is not None:
                self.client.removeBody(known[0])
                self.places.pop(key, None)
            shape = self.client.createCollisionShape(pybullet.GEOM_MESH, vertices=points.tolist())
            self.bodies[key] = known = (int(self.client.createMultiBody(0.0, shape)), points)
        if self.places.get(key) is not pose:
            self.client.resetBasePositionAndOrientation(known[0], pose[:3, 3].tolist(), quaternion(pose))
            self.places[key] = pose
        return known[0]


@contextmanager
def hull_world(trimmer: Trimmer) -> Iterator[HullWorld]:
    """A world for the hulls of a trimmer; it follows later cuts."""
    with empty_client() as client:
        yield HullWorld(client, trimmer)


def cleared(
    hulls: Hulls, poses: Mapping[str, Array], pairs: Iterable[tuple[str, str]], exact: frozenset[str] = frozenset()
) -> tuple[Hulls, tuple[Cut, ...]]:
    """The hulls cut until none of the link pairs overlap at these link-to-root poses, and what each link lost.

    Overlaps that would take too much of a hull are left as they are; links in ``exact`` may lose least.
    """
    trimmer = Trimmer(hulls, exact)
    with hull_world(trimmer) as world:
        clear_pose(world, poses, list(pairs))
    return trimmer.result(), tuple(trimmer.cuts.values())


def clear_pose(world: HullWorld, poses: Mapping[str, Array], pairs: list[tuple[str, str]]) -> None:
    """Cut the world's hulls until none of the link pairs overlap at these link-to-root poses, nor touch, as far as that
    goes."""
    trimmer, stuck = world.trimmer, set[tuple[Key, Key]]()
    for _ in range(ROUNDS):
        changed = False
        for a, b in candidates(trimmer, poses, pairs):
            if (a, b) in stuck:
                continue
            overlap = world.overlap(a, b, poses[a[0]], poses[b[0]], -LEAST_GAP_M)
            if overlap is None:
                continue
            if not trimmer.clear(overlap, MARGIN_M):
                stuck.add((a, b))
            changed = True
        if not changed:
            break


def candidates(trimmer: Trimmer, poses: Mapping[str, Array], pairs: Iterable[tuple[str, str]]) -> list[tuple[Key, Key]]:
    """The hull pairs of these link pairs whose boxes come within ``REACH_M`` of each other at these poses."""
    boxes = {link: boxes_at(pieces, poses[link]) for link, pieces in trimmer.hulls.items() if pieces}
    found = []
    for first, second in pairs:
        if first in boxes and second in boxes:
            near = boxes_meet(boxes[first], boxes[second], REACH_M)
            found += [((first, int(i)), (second, int(j))) for i, j in np.argwhere(near)]
    return found


def boxes_at(pieces: list[Array], pose: Array) -> tuple[Array, Array]:
    """The (n, 3) lowest and highest corners of each hull's box, its link at this (4, 4) pose."""
    placed = [points @ pose[:3, :3].T + pose[:3, 3] for points in pieces]
    return np.array([points.min(axis=0) for points in placed]), np.array([points.max(axis=0) for points in placed])


def quaternion(pose: Array) -> tuple[float, float, float, float]:
    """The rotation of a (4, 4) pose as x, y, z, w; SciPy's takes thirty times as long for a single one."""
    (xx, xy, xz, _), (yx, yy, yz, _), (zx, zy, zz, _), _ = pose.tolist()
    # Divided by the largest of the four, which is at least a half (Shepperd 1978).
    squares = (1.0 + xx - yy - zz, 1.0 - xx + yy - zz, 1.0 - xx - yy + zz, 1.0 + xx + yy + zz)
    most = squares.index(max(squares))
    double = sqrt(squares[most])
    ways = (
        (squares[0], yx + xy, zx + xz, zy - yz),
        (yx + xy, squares[1], zy + yz, xz - zx),
        (zx + xz, zy + yz, squares[2], yx - xy),
        (zy - yz, xz - zx, yx - xy, squares[3]),
    )
    x, y, z, w = ways[most]
    return x / (2.0 * double), y / (2.0 * double), z / (2.0 * double), w / (2.0 * double)
