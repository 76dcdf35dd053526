"""Joints that follow others in SAPIEN, whose PhysX has no mimic joint: efforts that bind each to its leader.

SAPIEN's own URDF loader binds them by tendons. Those want all joints between the two to move, and let a pair of bars of
ratio 2 accelerate 2.5 times as fast as they should (their ``recip_coefficients``), so that no effort could be measured.
Here a spring and a damper act on the error, and, times the ratio, back on the leader. Both are as stiff as a step
allows, by the inertia that an error moves at the pose where the object was placed.
"""

from collections.abc import Mapping

import numpy as np
import yourdfpy

from asset2sim.assets.links import read_inertial
from asset2sim.assets.urdf.read import root_of, tree_joint
from asset2sim.physics.arrays import Array
from asset2sim.physics.inertia import tensor_of
from asset2sim.physics.kinematics import mimics_of, parents_first
from asset2sim.physics.mass_matrix import Body, joint_space

TAKEN_BACK = 0.25
"""Share of an error that a step takes back. An acceleration a that the coupling bears leaves an error of a·Δt² over
this: 0.7 mrad at 10 rad/s² and 1/240 s."""
DAMPED = 0.5
"""Share of an error's speed that a step takes away. With both, what an error moves may weigh a third of what it did
where the object was placed before the coupling oscillates (semi-implicit steps are stable while a + 2 d < 4)."""


class Coupling:
    """The mimics of one object of n joints, in ``names``' order."""

    def __init__(self, robot: yourdfpy.Robot, names: tuple[str, ...], held: bool, timestep_s: float) -> None:
        self.tree = parents_first([tree_joint(joint) for joint in robot.joints])
        self.root, self.names, self.held, self.step = root_of(robot), names, held, timestep_s
        self.mimics = mimics_of(self.tree)
        self.bodies = {str(link.name): body_of(link) for link in robot.links} if self.mimics else {}
        # Rows of q_follower − multiplier · q_leader = offset.
        self.rows, self.offsets = np.zeros((len(self.mimics), len(names))), np.zeros(len(self.mimics))
        for row, (name, mimic) in enumerate(self.mimics.items()):
            self.rows[row, names.index(name)] = 1.0
            self.rows[row, names.index(mimic.joint)] -= mimic.multiplier
            self.offsets[row] = mimic.offset
        self.inertia: Array = np.zeros((len(self.mimics), len(self.mimics)))

    def measure(self, positions: Mapping[str, float], armature: Mapping[str, float]) -> None:
        """Take the inertia that errors move from the object with its joints at ``positions``."""
        if not self.mimics:
            return
        space = joint_space(self.tree, self.root, self.bodies, positions).geared(armature)
        order = [space.names.index(name) for name in self.names]
        mobility = (np.linalg.inv(space.matrix[6:, 6:]) if self.held else space.mobility)[np.ix_(order, order)]
        self.inertia = np.asarray(np.linalg.inv(self.rows @ mobility @ self.rows.T), dtype=np.float64)

    def efforts(self, positions: Array, velocities: Array) -> Array:
        """(n,) efforts of the coupling, N·m or N, at these (n,) joint positions and velocities."""
        error, speed = self.rows @ positions - self.offsets, self.rows @ velocities
        wanted = -(TAKEN_BACK * error / self.step + DAMPED * speed) / self.step
        found: Array = self.rows.T @ (self.inertia @ wanted)
        return found


def body_of(link: yourdfpy.Link) -> Body:
    """A link's mass, centre of mass and inertia; nothing where it states none."""
    inertial = read_inertial(link.inertial)
    if inertial is None:
        return Body(0.0, np.zeros(3), np.zeros((3, 3)))
    return Body(inertial.mass_kg, np.asarray(inertial.com), tensor_of(inertial.inertia))
