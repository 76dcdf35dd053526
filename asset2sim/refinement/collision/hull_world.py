"""Overlaps between single convex hulls: depth and direction of the shortest way out, and what clears them."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping

import numpy as np

from asset2sim.assets.meshes.hull import boxes_meet
from asset2sim.engines.static_object import MARGIN_M
from asset2sim.physics.arrays import Array
from asset2sim.refinement.collision.trim import CLEARANCE_M, ROUNDS, Key, Overlap, Trimmer

LEAST_GAP_M = CLEARANCE_M / 2.0
"""Gap beyond the engine's margins below which two links count as touching, m: two doors whose edges touch cannot open
in a rigid engine, for the inner corner of each swings out a little."""
REACH_M = 2.0 * MARGIN_M + LEAST_GAP_M
"""Distance within which the engine's margins of two hulls meet or touch, m."""
FAR_M = 1e3
"""Distance up to which hulls are measured against each other, m: any object is smaller."""


class HullWorld(ABC):
    """A world with every hull of a trimmer, each placed by its link's pose when it is asked about; it follows cuts."""

    def __init__(self, trimmer: Trimmer) -> None:
        self.trimmer = trimmer

    @abstractmethod
    def closest(self, a: Key, b: Key, pose_a: Array, pose_b: Array, reach: float = 0.0) -> tuple[float, Array] | None:
        """The distance (m, negative where they overlap, PyBullet's margins counted) of two hulls whose links are at
        these (4, 4) poses, and the unit (3,) normal from B to A; None where they are more than ``reach`` apart."""

    def overlap(self, a: Key, b: Key, pose_a: Array, pose_b: Array, tolerance: float) -> Overlap | None:
        """The two hulls' overlap at these poses if it is deeper than ``tolerance`` (m, margins counted), else None."""
        found = self.closest(a, b, pose_a, pose_b, max(-tolerance, 0.0))
        if found is None or found[0] >= -tolerance:
            return None
        return Overlap(a, b, pose_a, pose_b, found[1], -found[0])


def clear_pose(world: HullWorld, poses: Mapping[str, Array], pairs: list[tuple[str, str]]) -> None:
    """Cut the world's hulls until none of the link pairs overlap or touch at these poses, as far as that goes."""
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
    known = [(first, second) for first, second in pairs if first in boxes and second in boxes]
    if not known:
        return []
    # Whole links first, all at once: a keyboard has thousands of pairs, and a hundred that come near.
    whole = {link: np.array([low.min(axis=0), high.max(axis=0)]) for link, (low, high) in boxes.items()}
    a, b = (np.array([whole[pair[end]] for pair in known]) for end in (0, 1))
    meet = np.all((a[:, 0] <= b[:, 1] + REACH_M) & (b[:, 0] <= a[:, 1] + REACH_M), axis=1)
    found = []
    for first, second in (known[i] for i in np.flatnonzero(meet)):
        near = boxes_meet(boxes[first], boxes[second], REACH_M)
        found += [((first, int(i)), (second, int(j))) for i, j in np.argwhere(near)]
    return found


def boxes_at(pieces: list[Array], pose: Array) -> tuple[Array, Array]:
    """The (n, 3) lowest and highest corners of each hull's box, its link at this (4, 4) pose."""
    placed = [points @ pose[:3, :3].T + pose[:3, 3] for points in pieces]
    return np.array([points.min(axis=0) for points in placed]), np.array([points.max(axis=0) for points in placed])
