"""The world of an arm in MuJoCo: an object on a floor, and the arm beside it."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import mujoco
import numpy as np

from asset2sim.gym.arm.gripper import PANDA, Gripper
from asset2sim.gym.world import TOOL, Mask, ObjectWorld, compiled_object, object_spec
from asset2sim.load import GAP_M, Description
from asset2sim.physics.arrays import Array

TIMESTEP_S = 1e-3
"""Time step, s: a quarter of the checks', so that what is seen is not the integrator's."""
SAMPLE_STEPS = 4
"""Steps between two samples."""
LOST_M = 5.0
"""Distance from the origin at which an object has flown away and the recording ends."""


@dataclass(eq=False)
class CompiledScene(ObjectWorld):
    """A refined object and a tool. ``base`` is the (4, 4) pose of the arm's base; ``tool_places`` are the places of the
    tool's joints among positions, (joints, k) ``ratios`` times its servos' commands is where these lead them."""

    base: Array
    tool_places: Array
    ratios: Array
    gripper: Gripper

    @cached_property
    def tip_geoms(self) -> Mask:
        """(n,) mask of geoms: those of the tool that are meant to touch."""
        tips = [f"{TOOL}{tip}" for tip in self.gripper.tips]
        return np.array([self.model.body(int(body)).name in tips for body in self.model.geom_bodyid])


def build_stage(
    folder: Path,
    tool: mujoco.MjSpec | None,
    base: Array,
    gripper: Gripper = PANDA,
    furnish: Callable[[mujoco.MjSpec], None] = lambda spec: None,
) -> CompiledScene:
    """The world with a refined object at the origin in its initial state, a tool, as the arm with this gripper, with
    its base at this (4, 4) pose, and what else it is to be furnished with. Raises LoadError as ``load`` does,
    ValueError where MuJoCo refuses the model."""
    spec, loaded = object_spec(folder, TIMESTEP_S)
    joints: list[str] = []
    ratios = np.zeros((0, 0))
    if tool is not None:
        joints = [joint.name for joint in tool.joints]
        ratios = np.eye(len(joints), len(tool.actuators))
        if len(joints) > len(tool.actuators):  # some joints follow a servo's
            ratios[-len(gripper.ratios) :, -gripper.ratios.shape[1] :] = gripper.ratios
        spec.attach(tool, prefix=TOOL, frame=spec.worldbody.add_frame(pos=base[:3, 3], quat=quaternion(base)))
    furnish(spec)
    about, prefix, model, data = compiled_object(spec, loaded)
    places = np.array([int(model.joint(TOOL + name).qposadr[0]) for name in joints], dtype=int)
    return CompiledScene(about, prefix, model, data, base.copy(), places, ratios, gripper)


def quaternion(pose: Array) -> Array:
    """(4,) wxyz quaternion of a (4, 4) pose."""
    found = np.zeros(4)
    mujoco.mju_mat2Quat(found, pose[:3, :3].ravel())
    return found


def base_at(azimuth: float, distance_m: float, about: Description | None = None) -> Array:
    """(4, 4) pose of a base that faces the origin, at this azimuth (rad) and distance, on the floor, or as high over it
    as this object: what is fixed clears it."""
    pose, facing = np.eye(4), azimuth + math.pi
    pose[:2, 3] = distance_m * math.cos(azimuth), distance_m * math.sin(azimuth)
    pose[2, 3] = GAP_M if about is not None and about.support == "fixed" else 0.0
    pose[:2, :2] = [[math.cos(facing), -math.sin(facing)], [math.sin(facing), math.cos(facing)]]
    return pose


def place_joints(stage: CompiledScene, positions: Mapping[str, float], tool: Array | None = None) -> None:
    """Set joints of the object (rad or m) and the tool's by commands, if given, and what follows: poses, contacts."""
    for name, value in positions.items():
        stage.data.qpos[stage.place(name)] = value
    if tool is not None:
        stage.data.qpos[stage.tool_places] = stage.ratios @ tool
    mujoco.mj_kinematics(stage.model, stage.data)
    mujoco.mj_comPos(stage.model, stage.data)
    mujoco.mj_collision(stage.model, stage.data)
