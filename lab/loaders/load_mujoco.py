"""MuJoCo's URDF reader with its default options, and the MJCF that we export."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import mujoco
import numpy as np

from asset2sim.assets.exports.mjcf import HOME
from asset2sim.assets.exports.refined_object import MJCF_NAME
from asset2sim.assets.folder import URDF_NAME
from asset2sim.physics.arrays import Array
from lab.loaders.loaded import BALL_MASS_KG, BALL_RADIUS_M, Loader, Setting
from schemas.vocabulary import Engine

BALL = "dropped_ball"


class PlainMuJoCo:
    """A compiled model; every joint has a motor (gear 1, no control range), through which efforts act."""

    def __init__(self, model: mujoco.MjModel, root: str) -> None:
        self.model, self.data, self.root = model, mujoco.MjData(model), root
        self.timestep_s = float(model.opt.timestep)
        # As the export's documentation says: it holds its state in a keyframe.
        key = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_KEY, HOME)
        if key >= 0:
            mujoco.mj_resetDataKeyframe(model, self.data, key)
        mujoco.mj_forward(model, self.data)
        kinds = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
        self.joints = {model.joint(i).name: i for i in range(model.njnt) if int(model.jnt_type[i]) in kinds}

    def positions(self) -> dict[str, float]:
        return {name: float(self.data.qpos[self.model.jnt_qposadr[i]]) for name, i in self.joints.items()}

    def velocity(self, joint: str) -> float:
        return float(self.data.qvel[self.model.jnt_dofadr[self.joints[joint]]])

    def place(self, positions: Mapping[str, float], velocities: Mapping[str, float]) -> None:
        mujoco.mj_resetData(self.model, self.data)
        for name, i in self.joints.items():
            self.data.qpos[self.model.jnt_qposadr[i]] = positions.get(name, 0.0)
            self.data.qvel[self.model.jnt_dofadr[i]] = velocities.get(name, 0.0)

    def step(self, efforts: Mapping[str, float]) -> None:
        self.data.ctrl[:] = 0.0
        for name, effort in efforts.items():
            self.data.actuator(name).ctrl[0] = effort
        mujoco.mj_step(self.model, self.data)

    def root_position(self) -> Array:
        # The world, where MuJoCo has merged the two.
        body = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, self.root)
        return np.array(self.data.xpos[max(body, 0)])

    def ball_position(self) -> Array:
        return np.array(self.data.body(BALL).xpos)


@contextmanager
def open_mujoco(folder: Path, setting: Setting, *, file: str) -> Iterator[PlainMuJoCo]:
    """The folder's URDF or MJCF, read by MuJoCo, with what the setting asks for added to it."""
    spec = mujoco.MjSpec.from_file(str(folder / file))
    if setting.timestep_s is not None:
        spec.option.timestep = setting.timestep_s
    spec.option.gravity = setting.gravity
    root = spec.worldbody.first_body()
    if setting.held is not None:
        hold(spec, root, setting)
    for joint in spec.joints:
        if joint.type in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE):
            motor = spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
            motor.set_to_motor()
    if setting.floor:
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0.0, 0.0, 0.05))
    if setting.ball is not None:
        ball = spec.worldbody.add_body(name=BALL, pos=setting.ball)
        ball.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(BALL_RADIUS_M, 0.0, 0.0))
        # Stated, since our MJCF takes no inertia from shapes.
        ball.mass, ball.explicitinertial = BALL_MASS_KG, True
        ball.inertia = (0.4 * BALL_MASS_KG * BALL_RADIUS_M**2,) * 3
        ball.add_freejoint()
    yield PlainMuJoCo(spec.compile(), root.name)


def hold(spec: mujoco.MjSpec, root: mujoco.MjsBody, setting: Setting) -> None:
    """Fix the root or free it, as the setting says; the keyframe, which then has another size, goes."""
    for key in list(spec.keys):
        spec.delete(key)
    free = [joint for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_FREE]
    if setting.held:
        for joint in free:
            spec.delete(joint)
    elif not free:
        root.add_freejoint()
    root.pos = (0.0, 0.0, setting.height_m)


LOADERS = (
    Loader("MuJoCo, the URDF", Engine.MUJOCO, "MjModel.from_xml_path(urdf)", partial(open_mujoco, file=URDF_NAME)),
    Loader(
        "MuJoCo, our MJCF",
        Engine.MUJOCO,
        "MjModel.from_xml_path(mobility.xml), and mj_resetDataKeyframe(model, data, 0)",
        partial(open_mujoco, file=MJCF_NAME),
    ),
)
