"""Poses of a hand at places of a part, and which of them are inside the object, for all of them at once."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from asset2sim.gym.hand.gripper import HandWorld
from asset2sim.gym.hand.surfaces import OFF_M
from asset2sim.physics.arrays import Array

Kind = Literal["press", "hook", "grasp", "rub"]
TURNS = 8
"""Directions from which the hand comes to a place, about the normal there or the part's way."""
AT_ONCE = 64
"""Poses that are compared with all places at once: their distances fit a processor's cache."""


def at_places(
    world: HandWorld, kind: Kind, points: Array, normals: Array, turns: NDArray[np.int64], widths: Array
) -> tuple[Array, Array]:
    """(n, 4, 4) poses of the hand at (n, 3) places of a part, world, and (n,) half the openings with which it comes, m:
    pointing at it, or with a finger beside it, or about what is ``widths`` thick there. ``turns`` number the directions
    about it from which the hand comes, with the middle of its pads, and from ``TURNS`` on with their tips: for what is
    shallow."""
    tool, poses = world.tool, np.tile(np.eye(4), (len(points), 1, 1))
    points_at = turns == TURNS if kind == "rub" else np.full(len(points), kind == "press")
    aside = np.where(points_at[:, None], [0.0, 0.0, 1.0], normals)
    towards = np.where(points_at[:, None], -normals, directions_around(normals, 2.0 * math.pi * turns / TURNS))
    poses[:, :3, :3] = hand_rotations(towards, aside)
    tips = np.where(turns >= TURNS, tool.tip_m, 0.0)[:, None] * poses[:, :3, 2]
    if kind == "grasp":
        poses[:, :3, 3] = points - tips - normals * widths[:, None] / 2.0
        return poses, np.minimum(widths / 2.0 + tool.room_m, tool.opening_m / 2.0)
    beside = points - tips + normals * (2.0 * tool.finger[1] + OFF_M)
    before = points + normals * (tool.tip_m + OFF_M)
    poses[:, :3, 3] = np.where(points_at[:, None], before, beside)
    return poses, np.zeros(len(points))


def hand_rotations(towards: Array, beside: Array) -> Array:
    """(n, 3, 3) rotations of a hand that points ``towards``, and closes as far as it can along ``beside``."""
    z = towards / np.linalg.norm(towards, axis=1)[:, None]
    y = beside - np.einsum("ij,ij->i", beside, z)[:, None] * z
    along = np.einsum("ij,ij->i", y, y) < 1e-12
    y[along] = np.cross(z[along], np.eye(3)[np.argmin(np.abs(z[along]), axis=1)])
    y /= np.linalg.norm(y, axis=1)[:, None]
    return np.stack([np.cross(y, z), y, z], axis=2)


def directions_around(normals: Array, angles: Array) -> Array:
    """(n, 3) directions square to (n, 3) normals, at (n,) angles about them, from as near to down as there is."""
    down = np.where(np.abs(normals[:, 2:]) < 0.9, [0.0, 0.0, -1.0], [1.0, 0.0, 0.0])
    first = down - np.einsum("ij,ij->i", down, normals)[:, None] * normals
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.asarray(np.cos(angles)[:, None] * first + np.sin(angles)[:, None] * np.cross(normals, first))


@dataclass(frozen=True, eq=False)
class SolidPlaces:
    """(n, 3) places in an object's collision shapes, world, and (n,) how deep each may be in a hand's box, m; the
    lowest height at which a hand may be, m."""

    points: Array
    into_m: Array
    lowest_m: float

    def free(self, world: HandWorld, poses: Array, halves: Array, back_m: float) -> Iterator[int]:
        """Which of (n, 4, 4) poses, ``halves`` the openings, m, have none of the places deeper in the palm or a finger,
        there and on the last ``back_m`` before. A box and a convex shape are at least as deep in each other as a place
        of one is in the other, so that where the hand has room is always among them."""
        for first in range(0, len(poses), AT_ONCE):
            some = slice(first, first + AT_ONCE)
            yield from (first + np.flatnonzero(~self.hits(world, poses[some], halves[some], back_m))).tolist()

    def hits(self, world: HandWorld, poses: Array, halves: Array, back_m: float) -> NDArray[np.bool_]:
        """Which of (n, 4, 4) poses have such a place."""
        tool, up = world.tool, poses[:, 2, :3].T
        middles_m, sizes = np.array([tool.behind_m, tool.tip_m - tool.finger[2]]), np.stack([tool.palm, tool.finger])
        low_m = poses[:, 2, 3] + middles_m[:, None] * up[2] - sizes @ np.abs(up)  # of palm and fingers, (2, n)
        low_m[1] -= np.abs(up[1]) * (tool.finger[1] + halves)
        found = np.asarray((low_m < self.lowest_m).any(axis=0))
        turned = poses[:, :3, :3].astype(np.float32)
        off = np.einsum("nij,ni->nj", poses[:, :3, :3], poses[:, :3, 3]).astype(np.float32)
        x, y, z = np.moveaxis(self.points.astype(np.float32) @ turned - off[:, None], 2, 0)
        into = self.into_m.astype(np.float32)
        x, y = np.abs(x), np.abs(y)
        beside = np.abs(y - (tool.finger[1] + halves).astype(np.float32)[:, None])
        for across, center, size in zip((y, beside), middles_m, sizes, strict=True):
            high, low = np.float32(center + size[2]), np.float32(center - size[2] - back_m)
            there = (x < np.float32(size[0]) - into) & (across < np.float32(size[1]) - into)
            found |= (there & (z < high - into) & (z > low + into)).any(axis=1)
        return found
