"""Contacts between an object and what uses it, in MuJoCo's data: where they press, how hard, with what power."""

from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from asset2sim.gym.world import ObjectWorld
from asset2sim.physics.arrays import Array

LEAST_N = 1e-6
"""Force from which a contact counts as one, N."""


class ToolContacts:
    """The contacts between tool and object, ``part_geoms`` the geoms of the part that a task moves."""

    def __init__(self, world: ObjectWorld, part_geoms: NDArray[np.int64]) -> None:
        tool, part = world.tool_geoms.astype(bool), np.zeros(world.model.ngeom, dtype=bool)
        part[part_geoms] = True
        self.on_object, self.on_part = (geom_pairs(tool, other) for other in (world.object_geoms.astype(bool), part))
        self.mine = world.object_dofs.astype(float)

    def touches(self, data: mujoco.MjData) -> bool:
        """Whether the tool pressed on the part in the last step."""
        contact = data.contact
        first, second = contact.geom.T
        between = self.on_part[first, second]
        if not np.count_nonzero(between):
            return False
        rows = contact.efc_address[between]
        return bool((data.efc_force[rows[rows >= 0]] > LEAST_N).any())

    def power(self, data: mujoco.MjData) -> float:
        """The power that the tool exerted on the object in the last step, W."""
        contact = data.contact
        first, second = contact.geom.T
        between = self.on_object[first, second] & (contact.efc_address >= 0)
        if not np.count_nonzero(between):
            return 0.0
        firsts, sizes = contact.efc_address[between], contact.dim[between]
        # The rows of a contact follow each other, and mostly contacts do.
        rows = np.repeat(firsts - np.cumsum(sizes) + sizes, sizes) + np.arange(int(sizes.sum()))
        jacobian = data.efc_J.reshape(-1, len(self.mine))[rows]
        return float(data.efc_force[rows] @ (jacobian @ (data.qvel * self.mine)))


def geom_pairs(some: NDArray[np.bool_], others: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n, n) whether one of two geoms is of some and the other of others."""
    return np.outer(some, others) | np.outer(others, some)


def pressures(world: ObjectWorld) -> Iterator[tuple[int, int, int, Array]]:
    """Each contact of a tool with the object: its number, both geoms, and the (3,) force on the object, N, world."""
    data, tools, mine = world.data, world.tool_geoms, world.object_geoms
    if not data.ncon:
        return
    geoms, force = data.contact.geom, np.zeros(6)
    for column in (0, 1):
        for number in np.flatnonzero(tools[geoms[:, column]] & mine[geoms[:, 1 - column]]):
            mujoco.mj_contactForce(world.model, data, number, force)
            pressed = data.contact.frame[number].reshape(3, 3).T @ force[:3]
            tool, other = int(geoms[number, column]), int(geoms[number, 1 - column])
            yield int(number), tool, other, pressed if column == 0 else -pressed
