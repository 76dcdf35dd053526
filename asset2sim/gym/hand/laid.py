"""Three bodies laid into an interior of a link, and whether they are still there."""

import mujoco
import numpy as np
from scipy.spatial import KDTree

from asset2sim.assets.meshes.interior import FLOOR_CELLS, Interior
from asset2sim.gym.hand.content_world import BODIES, CONTENT, HALF_HIGH, PARKED_M, ContentWorld
from asset2sim.physics.arrays import Array

SUNK = 0.3
"""How far a body may lie below the floor that is seen, over its radius."""
LEANS = 0.7
"""Least upright part of a contact's normal, of a floor on which something lies: it leans by at most 45°."""


class Laid:
    """Three bodies of a radius, m, at (3, 3) places in the interior of a body, in a world with the joints closed."""

    def __init__(self, world: ContentWorld, body: int, inside: Interior, places: Array, radius: float) -> None:
        self.world, self.body, self.places, self.radius, self.near = world, body, places, radius, 2.0 * inside.cell_m
        self.turned, origin = world.data.xmat[body].reshape(3, 3).copy(), world.data.xpos[body].copy()
        low = inside.height_m <= inside.radius_m + (FLOOR_CELLS + 1.0) * inside.cell_m
        self.room = KDTree((inside.points - origin) @ self.turned)
        self.floor = KDTree((inside.points - inside.height_m[:, None] * [0.0, 0.0, 1.0] - origin)[low] @ self.turned)

    def put_down(self) -> None:
        """Put the bodies down at their places."""
        for name, at in zip(BODIES, self.places, strict=True):
            put_down(self.world, name, at, self.radius)
        mujoco.mj_forward(self.world.model, self.world.data)

    def left(self, when: str) -> str:
        """Why what lay there is not there any more: ``floor`` is what is seen below the interior's ``room``."""
        for name in BODIES:
            at = in_link(self.world, name, self.body)
            if not np.isfinite(at).all():
                return f"it flies away {when}"
            down = self.turned.T @ np.array([0.0, 0.0, HALF_HIGH[name] * self.radius])
            off, nearest = self.floor.query(at - down)
            sunk = float((self.floor.data[nearest] - at + down) @ down) / float(np.linalg.norm(down))
            if sunk > SUNK * self.radius + self.near and off < 2.0 * sunk:
                return f"the {name} falls through {when}"
            if self.room.query(at)[0] > self.radius + self.near:
                return f"the {name} rolls, falls or is thrown out {when}"
        return ""


def in_link(world: ContentWorld, name: str, body: int) -> Array:
    """(3,) middle of a body in the frame of a link's."""
    off: Array = (world.data.body(CONTENT + name).xpos - world.data.xpos[body]) @ world.data.xmat[body].reshape(3, 3)
    return off


def on_floor(world: ContentWorld, name: str, at: Array, radius: float) -> Array:
    """Where a body rests that is put down at a place that is clear of all faces: on the collision shape that is below
    it or, by at most its radius, above; there where none is."""
    source = at + np.array([0.0, 0.0, radius])
    gap, _ = world.first_met(source, np.array([0.0, 0.0, -1.0]))
    if gap > 3.0 * radius:
        return at
    found: Array = source + np.array([0.0, 0.0, HALF_HIGH[name] * radius + world.settings.gap_m - gap])
    return found


def put_down(world: ContentWorld, name: str, at: Array, radius: float) -> float:
    """Put a body down at a place, clear of a floor that leans below it: how deep it is in what it meets, m."""
    model, data = world.model, world.data
    geom, place = int(model.geom(CONTENT + name).id), on_floor(world, name, at, radius)
    for raised in (True, False):
        world.put(name, place)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        met = (data.contact.geom[: data.ncon] == geom).any(axis=1)
        depth = -data.contact.dist[: data.ncon][met]
        upward = np.abs(data.contact.frame[: data.ncon][met, 2])
        if raised:
            low = (upward > LEANS) & (depth < radius / 2.0)  # more is no floor that leans, but a body that fills it
            place = place + np.array([0.0, 0.0, float((depth[low] / upward[low]).max(initial=0.0))])
    return float(depth.max(initial=0.0))


def is_free(world: ContentWorld, at: Array, radius: float) -> bool:
    """Whether the ball, put down there and taken away again, is no deeper in a shape than is allowed."""
    ball = next(iter(BODIES))
    free = put_down(world, ball, at, radius) <= world.settings.deep_share * radius
    world.put(ball, np.array([PARKED_M, 0.0, radius]))
    mujoco.mj_kinematics(world.model, world.data)
    return free
