"""``Handle`` of a world in PyBullet."""

from collections.abc import Sequence
from typing import cast

import numpy as np
import pybullet
from scipy.spatial.transform import Rotation

from asset2sim.engines.pybullet_world import PyBulletWorld
from asset2sim.engines.world import World
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import pose_of
from asset2sim.viewer.handles import GROUND, WorldContact

BASE = -1
"""PyBullet's index of the root link."""


class PyBulletHandle:
    """See ``Handle``."""

    def __init__(self, world: World) -> None:
        self.world = cast(PyBulletWorld, world)
        self.client, self.body = self.world.item.client, self.world.item.body
        self.names = self.world.item.link_names
        self.index = {name: index for index, name in self.names.items()}
        self.inner = [index for index in sorted(self.names) if index != BASE]
        self.terms = {index: self.client.getDynamicsInfo(self.body, index) for index in self.names}
        # PyBullet gives the pose of a root's inertial frame.
        self.root_in_inertial = np.linalg.inv(pose_of(self.terms[BASE][3], self.terms[BASE][4]))

    def poses(self) -> dict[str, Array]:
        base = pose_of(*self.client.getBasePositionAndOrientation(self.body)) @ self.root_in_inertial
        states = self._states(computeForwardKinematics=1)
        return {self.names[BASE]: base} | {
            self.names[index]: pose_of(state[4], state[5]) for index, state in zip(self.inner, states, strict=True)
        }

    def masses(self) -> dict[str, float]:
        return {name: float(self.terms[index][0]) for index, name in self.names.items()}

    def point_velocity(self, link: str, point: Array) -> Array:
        center, _, linear, angular = self._motion(self.index[link])
        velocity: Array = linear + np.cross(angular, point - center)
        return velocity

    def pull(self, link: str, point: Array, force: Array, against: str | None = None) -> None:
        for name, sign in ((link, 1.0), *([] if against is None else [(against, -1.0)])):
            applied = (sign * force).tolist()
            self.client.applyExternalForce(self.body, self.index[name], applied, point.tolist(), pybullet.WORLD_FRAME)

    def set_gravity(self, gravity: Sequence[float]) -> None:
        self.client.setGravity(*gravity)

    def touches(self) -> list[WorldContact]:
        found = []
        for point in self.client.getContactPoints(bodyA=self.body):
            a, b = (
                self.names[link] if body == self.body else GROUND
                for body, link in ((point[1], point[3]), (point[2], point[4]))
            )
            found.append(WorldContact(*((a, b) if a != GROUND else (b, a)), float(point[8]), np.array(point[6])))
        return found

    def kinetic_energy(self) -> float:
        total = 0.0
        for index, terms in self.terms.items():
            _, orientation, linear, angular = self._motion(index)
            spin = Rotation.from_quat(orientation).inv().apply(angular)
            total += 0.5 * (terms[0] * float(linear @ linear) + float(np.array(terms[2]) @ spin**2))
        return total

    def _motion(self, index: int) -> tuple[Array, Array, Array, Array]:
        """Centre of mass, orientation (xyzw) of the inertial frame, and velocities of one link."""
        if index == BASE:
            place, velocity = (
                self.client.getBasePositionAndOrientation(self.body),
                self.client.getBaseVelocity(self.body),
            )
            return np.array(place[0]), np.array(place[1]), np.array(velocity[0]), np.array(velocity[1])
        state = self.client.getLinkState(self.body, index, computeLinkVelocity=1, computeForwardKinematics=1)
        return np.array(state[0]), np.array(state[1]), np.array(state[6]), np.array(state[7])

    def _states(self, **asked: int) -> Sequence[Sequence[Sequence[float]]]:
        # Asked for no links, PyBullet answers None.
        return self.client.getLinkStates(self.body, self.inner, **asked) if self.inner else ()
