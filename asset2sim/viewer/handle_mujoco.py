"""``Handle`` of a world in MuJoCo."""

from collections.abc import Sequence
from typing import cast

import mujoco
import numpy as np

from asset2sim.engines.mujoco_world import MuJoCoWorld
from asset2sim.engines.world import World
from asset2sim.physics.arrays import Array
from asset2sim.viewer.handles import GROUND, WorldContact


class MuJoCoHandle:
    """See ``Handle``. Body 0 is the world, link i is body i + 1."""

    def __init__(self, world: World) -> None:
        self.world = cast(MuJoCoWorld, world)
        self.model, self.data = self.world.model, self.world.data
        self.names = (GROUND, *self.world.link_names)
        self.body = {name: index for index, name in enumerate(self.names)}

    def poses(self) -> dict[str, Array]:
        mujoco.mj_kinematics(self.model, self.data)
        found = {}
        for name, index in self.body.items():
            if index:
                found[name] = np.eye(4)
                found[name][:3, :3] = self.data.xmat[index].reshape(3, 3)
                found[name][:3, 3] = self.data.xpos[index]
        return found

    def masses(self) -> dict[str, float]:
        return {name: float(self.model.body_mass[index]) for name, index in self.body.items() if index}

    def point_velocity(self, link: str, point: Array) -> Array:
        mujoco.mj_comPos(self.model, self.data)
        jacobian = np.zeros((3, self.model.nv))
        mujoco.mj_jac(self.model, self.data, jacobian, None, point, self.body[link])
        velocity: Array = jacobian @ self.data.qvel
        return velocity

    def pull(self, link: str, point: Array, force: Array, against: str | None = None) -> None:
        self.data.xfrc_applied[:] = 0.0
        for name, sign in ((link, 1.0), *([] if against is None else [(against, -1.0)])):
            index = self.body[name]
            self.data.xfrc_applied[index, :3] = sign * force
            self.data.xfrc_applied[index, 3:] = np.cross(point - self.data.xipos[index], sign * force)

    def set_gravity(self, gravity: Sequence[float]) -> None:
        self.model.opt.gravity[:] = gravity

    def touches(self) -> list[WorldContact]:
        contact = self.data.contact
        bodies = self.model.geom_bodyid[contact.geom]
        found = []
        for (a, b), distance, place in zip(bodies.tolist(), contact.dist.tolist(), contact.pos, strict=True):
            names = (self.names[a], self.names[b]) if a else (self.names[b], self.names[a])
            found.append(WorldContact(*names, float(distance), np.array(place)))
        return found

    def kinetic_energy(self) -> float:
        """See ``Handle``; with what armature takes up."""
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_comVel(self.model, self.data)
        mujoco.mj_crb(self.model, self.data)
        mujoco.mj_energyVel(self.model, self.data)
        return float(self.data.energy[1])
