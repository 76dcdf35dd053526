"""The ``World`` interface over one object in PyBullet."""

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pybullet
from scipy.spatial.transform import Rotation

from asset2sim.engines.contacts import ContactPoint
from asset2sim.engines.parallel_sliders import never_meeting
from asset2sim.engines.pybullet_object import PyBulletItem, keep_clients, loaded
from asset2sim.engines.pybullet_springs import ArmatureSprings
from asset2sim.engines.static_object import MARGIN_M
from asset2sim.engines.world import DeclaredEngine, bias_efforts, contact_distance_m, nothing_collides, with_followers
from asset2sim.physics.arrays import Array, norms
from asset2sim.physics.mass_matrix import GRAVITY_M_S2
from schemas.vocabulary import Engine

FAR_ABOVE_M = 20.0
"""A height, m, at which no part of a household object reaches the plane."""


@contextmanager
def open_pybullet(
    urdf: Path, *, plane: bool, timestep_s: float, contact_friction: float, gravity_m_s2: float = GRAVITY_M_S2
) -> Iterator["PyBulletWorld"]:
    """A world in PyBullet (see ``Opener``), the object placed with its joints at zero."""
    with loaded(urdf, fixed_base=not plane, timestep_s=timestep_s, gravity_m_s2=gravity_m_s2) as item:
        item.ignore(never_meeting(urdf, PyBulletWorld.skin_m))
        world = PyBulletWorld(item, timestep_s, plane)
        world.give_contacts(contact_friction)
        world.place({})
        yield world


class PyBulletWorld:
    """One object in one PyBullet client. Spring torques and pushes are set again at each step, as PyBullet requires;
    springs of joints with an armature are motors (``ArmatureSprings``)."""

    engine = Engine.PYBULLET
    skin_m = 2.0 * MARGIN_M

    def __init__(self, item: PyBulletItem, timestep_s: float, plane: bool) -> None:
        self.item = item
        self.timestep_s = timestep_s
        self.console = item.console
        self.links = sorted(item.link_names)
        self.link_names = tuple(item.link_names[index] for index in self.links)
        self.joint_names = tuple(item.joint_index)
        self.joints = list(item.joint_index.values())
        terms = [item.dynamics[name] for name in self.joint_names]
        self.stiffness = np.array([0.0 if term.armature > 0.0 else term.stiffness for term in terms])
        self.reference = np.array([term.spring_reference for term in terms])
        self.bias = np.array([term.bias for term in terms]).reshape(-1, 5)
        self.efforts = np.zeros(len(self.joints))
        self.springs = ArmatureSprings(item, timestep_s)
        self.geared = np.array([self.joint_names.index(name) for name in self.springs.names], dtype=int)
        self.biased = self.bias[:, 0] != 0.0
        self.driven = np.flatnonzero((self.stiffness > 0.0) | self.biased)
        self.driven_joints = [self.joints[i] for i in self.driven]
        client = item.client
        self.authored, self.upright = client.getBasePositionAndOrientation(item.body)
        self.plane = client.createMultiBody(0.0, client.createCollisionShape(pybullet.GEOM_PLANE)) if plane else None

    def give_contacts(self, contact_friction: float) -> None:
        """Set the Coulomb coefficient (Bullet multiplies those of a contact) and the distance of contact generation."""
        # The square root on every shape: the product is the same between two links as between a link and the plane.
        each, reach = math.sqrt(contact_friction), contact_distance_m(self.timestep_s)
        client, body = self.item.client, self.item.body
        if self.plane is not None:
            client.changeDynamics(self.plane, -1, lateralFriction=each)
        for link in self.links:
            client.changeDynamics(body, link, lateralFriction=each, contactProcessingThreshold=reach)

    def place(
        self,
        positions: Mapping[str, float],
        *,
        height_m: float = 0.0,
        shift_m: tuple[float, float] = (0.0, 0.0),
        tilt_rad: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> None:
        """See ``World``. Raises AssetError (engine_crash) where nothing could stand on the plane."""
        client, body = self.item.client, self.item.body
        self.push({})
        self.item.place(positions)
        self.springs.measure()
        if self.plane is None:
            return
        turned = Rotation.from_rotvec(tilt_rad) * Rotation.from_quat(self.upright)
        orientation = turned.as_quat().tolist()
        x, y = self.authored[0] + shift_m[0], self.authored[1] + shift_m[1]
        # Far above the plane first: a link's box is loose, its closest point to the plane is exact.
        client.resetBasePositionAndOrientation(body, (x, y, FAR_ABOVE_M), orientation)
        self.item.place(positions)
        lowest = self.lowest_m()
        if not math.isfinite(lowest):
            raise nothing_collides()
        client.resetBasePositionAndOrientation(body, (x, y, FAR_ABOVE_M - lowest + height_m), orientation)
        self.item.place(positions)

    def step(self, count: int = 1) -> None:
        client, body, driven = self.item.client, self.item.body, self.driven_joints
        advance, any_biased = client.stepSimulation, self.biased.any()
        for _ in range(count):
            efforts = self.efforts
            if any_biased:
                efforts = efforts + bias_efforts(self.bias, self.positions())
            if driven:
                states = client.getJointStates(body, driven)
                positions = np.array([state[0] for state in states])
                i = self.driven
                forces = self.stiffness[i] * (self.reference[i] - positions) + efforts[i]
                client.setJointMotorControlArray(body, driven, pybullet.TORQUE_CONTROL, forces=forces.tolist())
            self.springs.drive(efforts[self.geared])
            advance()

    def root_pose(self) -> tuple[Array, Array]:
        """See ``World``: the root's inertial frame."""
        position, orientation = self.item.client.getBasePositionAndOrientation(self.item.body)
        return np.array(position), np.array(orientation)

    def root_center(self) -> Array:
        """See ``World``: the origin of the inertial frame."""
        return np.array(self.item.client.getBasePositionAndOrientation(self.item.body)[0])

    def positions(self) -> Array:
        return self.item.positions()

    def velocities(self) -> Array:
        return self.item.velocities()

    def kick(self, velocities: Mapping[str, float]) -> None:
        present = dict(zip(self.joint_names, self.positions(), strict=True))
        for name, velocity in with_followers(self.item.mimics, velocities).items():
            self.item.client.resetJointState(self.item.body, self.item.joint_index[name], present[name], velocity)

    def push(self, efforts: Mapping[str, float]) -> None:
        self.efforts = np.array([efforts.get(name, 0.0) for name in self.joint_names])
        self.driven = np.flatnonzero((self.stiffness > 0.0) | self.biased | (self.efforts != 0.0))
        self.driven_joints = [self.joints[i] for i in self.driven]

    def link_speeds(self) -> Array:
        client, body = self.item.client, self.item.body
        speeds = [client.getBaseVelocity(body)[0]]
        if len(self.links) > 1:
            speeds += [state[6] for state in client.getLinkStates(body, self.links[1:], computeLinkVelocity=1)]
        return norms(np.array(speeds))

    def lowest_m(self) -> float:
        """See ``World``; infinite for what has no collision shape, or has flown out of reach of the plane."""
        points = self.item.client.getClosestPoints(self.plane, self.item.body, 2.0 * FAR_ABOVE_M)
        return min((float(point[8]) for point in points), default=math.inf)

    def contacts(self) -> list[ContactPoint]:
        """See ``World``: no contacts of a link with its parent."""
        return self.item.contacts()


ENGINE = DeclaredEngine(Engine.PYBULLET, open_pybullet, started=(pybullet, "connect"), ready=keep_clients)
