"""Contacts of the tool with the object at this moment, as cheaply as an environment needs it, 500 times a second."""

from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from asset2sim.gym.arm.scene import CompiledScene
from asset2sim.physics.arrays import Array

TOUCHING, LEAST_N = 3, 1e-6
"""Sum of the sides of a contact between tool and object, and the force that counts as one, N."""


class ToolContacts:
    """The contacts between tool and object, ``part_geoms`` the geoms of the part that a task moves."""

    def __init__(self, stage: CompiledScene, part_geoms: NDArray[np.int64]) -> None:
        self.sides = stage.tool_geoms.astype(np.int8) + 2 * stage.object_geoms.astype(np.int8)
        self.mine = stage.object_dofs.astype(float)
        self.part = np.zeros(stage.model.ngeom, dtype=bool)
        self.part[part_geoms] = True

    def felt(self, data: mujoco.MjData) -> tuple[bool, float]:
        """Whether the tool pressed on the part in the last step, and the power that it exerted on the object, W."""
        contact = data.contact
        sides = self.sides[contact.geom]
        between = sides[:, 0] + sides[:, 1] == TOUCHING
        if not between.any():
            return False, 0.0
        between &= contact.efc_address >= 0
        if not between.any():
            return False, 0.0
        firsts, sizes = contact.efc_address[between], contact.dim[between]
        parts = self.part[contact.geom[between]].any(axis=1)
        # The rows of a contact follow each other, and mostly contacts do.
        rows = np.repeat(firsts - np.cumsum(sizes) + sizes, sizes) + np.arange(int(sizes.sum()))
        forces = data.efc_force
        jacobian = data.efc_J.reshape(-1, len(self.mine))[rows]
        return bool((forces[firsts[parts]] > LEAST_N).any()), float(forces[rows] @ (jacobian @ (data.qvel * self.mine)))


def pressures(
    model: mujoco.MjModel, data: mujoco.MjData, tools: Array, mine: Array
) -> Iterator[tuple[int, int, int, Array]]:
    """Each contact of a tool with an object, of whose geoms ``tools`` and ``mine`` are masks: its number, the tool's
    geom and the object's, and the (3,) force on the object, N, world."""
    if not data.ncon:
        return
    geoms, force = data.contact.geom, np.zeros(6)
    for column in (0, 1):
        for number in np.flatnonzero(tools[geoms[:, column]] & mine[geoms[:, 1 - column]]):
            mujoco.mj_contactForce(model, data, number, force)
            pressed = data.contact.frame[number].reshape(3, 3).T @ force[:3]
            tool, other = int(geoms[number, column]), int(geoms[number, 1 - column])
            yield int(number), tool, other, pressed if column == 0 else -pressed
