"""Contacts of the tool with the object at this moment, as cheaply as an environment needs it, 500 times a second."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from asset2sim.gym.arm.scene import CompiledScene

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
