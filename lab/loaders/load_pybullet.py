"""PyBullet's ``loadURDF``, with its default flags, and as its own examples use it."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np
import pybullet
from pybullet_utils.bullet_client import BulletClient

from asset2sim.assets.folder import URDF_NAME
from asset2sim.engines.console import captured_console
from asset2sim.physics.arrays import Array
from lab.loaders.loaded import BALL_MASS_KG, BALL_RADIUS_M, Loader, Setting
from schemas.vocabulary import Engine


class PlainPyBullet:
    """An object as ``loadURDF`` leaves it; efforts are ``TORQUE_CONTROL``."""

    def __init__(self, client: BulletClient, body: int, ball: int, *, motors: bool) -> None:
        self.client, self.body, self.ball = client, body, ball
        self.timestep_s = float(client.getPhysicsEngineParameters()["fixedTimeStep"])
        infos = [client.getJointInfo(body, index) for index in range(client.getNumJoints(body))]
        self.index = {info[1].decode(): info[0] for info in infos if info[2] != pybullet.JOINT_FIXED}
        if not motors:
            for index in self.index.values():
                client.setJointMotorControl2(body, index, pybullet.VELOCITY_CONTROL, force=0.0)

    def positions(self) -> dict[str, float]:
        return {name: float(self.client.getJointState(self.body, i)[0]) for name, i in self.index.items()}

    def velocity(self, joint: str) -> float:
        return float(self.client.getJointState(self.body, self.index[joint])[1])

    def place(self, positions: Mapping[str, float], velocities: Mapping[str, float]) -> None:
        for name, index in self.index.items():
            self.client.resetJointState(self.body, index, positions.get(name, 0.0), velocities.get(name, 0.0))

    def step(self, efforts: Mapping[str, float]) -> None:
        for name, effort in efforts.items():
            self.client.setJointMotorControl2(self.body, self.index[name], pybullet.TORQUE_CONTROL, force=effort)
        self.client.stepSimulation()

    def root_position(self) -> Array:
        return np.array(self.client.getBasePositionAndOrientation(self.body)[0])

    def ball_position(self) -> Array:
        return np.array(self.client.getBasePositionAndOrientation(self.ball)[0])


@contextmanager
def open_pybullet(folder: Path, setting: Setting, *, flags: int, motors: bool) -> Iterator[PlainPyBullet]:
    """The folder's URDF in a client of its own."""
    client = BulletClient(connection_mode=pybullet.DIRECT)
    try:
        if setting.timestep_s is not None:
            client.setTimeStep(setting.timestep_s)
        client.setGravity(*setting.gravity)
        if setting.floor:
            client.createMultiBody(0.0, client.createCollisionShape(pybullet.GEOM_PLANE))
        options = {} if setting.held is None else {"useFixedBase": setting.held}
        with captured_console():
            body = client.loadURDF(
                str(folder / URDF_NAME), basePosition=(0.0, 0.0, setting.height_m), flags=flags, **options
            )
        ball = -1
        if setting.ball is not None:
            shape = client.createCollisionShape(pybullet.GEOM_SPHERE, radius=BALL_RADIUS_M)
            ball = client.createMultiBody(BALL_MASS_KG, shape, basePosition=setting.ball)
        yield PlainPyBullet(client, body, ball, motors=motors and not setting.loose)
    finally:
        client.disconnect()


LOADERS = (
    Loader(
        "PyBullet", Engine.PYBULLET, "loadURDF(path)", partial(open_pybullet, flags=0, motors=True)
    ),
    Loader(
        "PyBullet, inertia from file, motors off",
        Engine.PYBULLET,
        "loadURDF(path, flags=URDF_USE_INERTIA_FROM_FILE), and setJointMotorControl2(…, VELOCITY_CONTROL, force=0)",
        partial(open_pybullet, flags=pybullet.URDF_USE_INERTIA_FROM_FILE, motors=False),
    ),
)  # fmt: skip
