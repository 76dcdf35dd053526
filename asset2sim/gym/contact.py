"""Contacts of the tool with the object at this moment, as cheaply as an environment needs it, 500 times a second."""

import mujoco
import numpy as np

from asset2sim.gym.arm.scene import CompiledScene

TOUCHING, LEAST_N = 3, 1e-6
"""Sum of the sides of a contact between tool and object, and the force that counts as one, N."""


class ToolContacts:
    """The contacts between tool and object: ``trials.record.powers`` and ``felt`` of these alone."""

    def __init__(self, stage: CompiledScene) -> None:
        self.sides = stage.tool_geoms.astype(np.int8) + 2 * stage.object_geoms.astype(np.int8)
        self.mine = stage.object_dofs.astype(float)

    def felt(self, data: mujoco.MjData) -> tuple[bool, float]:
        """Whether the tool pressed on the object in the last step, and the power that it exerted on it, W."""
        contact = data.contact
        sides = self.sides[contact.geom]
        between = sides[:, 0] + sides[:, 1] == TOUCHING
        if not between.any():
            return False, 0.0
        firsts, sizes = contact.efc_address[between], contact.dim[between]
        known = firsts >= 0
        if not known.any():
            return False, 0.0
        firsts, sizes = firsts[known], sizes[known]
        # The rows of a contact follow each other, and mostly contacts do.
        rows = np.repeat(firsts - np.cumsum(sizes) + sizes, sizes) + np.arange(int(sizes.sum()))
        forces = data.efc_force
        jacobian = data.efc_J.reshape(-1, len(self.mine))[rows]
        return bool((forces[firsts] > LEAST_N).any()), float(forces[rows] @ (jacobian @ (data.qvel * self.mine)))
