"""The world of a trial in MuJoCo: an object on a floor, the arm beside it, and a bowl where the task needs one."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import mujoco
import numpy as np

from asset2sim.gym.arm.franka import servo
from asset2sim.gym.arm.gripper import GRIPPERS, PANDA, Gripper
from asset2sim.gym.world import CONTACT_TIME_S, TOOL, ObjectWorld, compiled_object, object_spec
from asset2sim.load import GAP_M, Description
from asset2sim.physics.arrays import Array

TIMESTEP_S = 1e-3
"""Time step of a trial, s: a quarter of the checks', so that what is seen is not the integrator's."""
PUSHER_M, PUSHER_KG, PUSHER_N = 0.011, 0.3, 40.0
"""Radius and mass of the spherical pusher, and the force of each of its servos."""
PUSHER = ("x", "y", "z")
BOWL_SIDES, BOWL_WALL_M = 16, 0.006
BOWL_RADIUS_M, BOWL_HIGH_M = 0.12, 0.05
"""Inner radius at the bottom, and height, of a bowl: a salad bowl's, whatever is to be put into it."""
SLANT_RAD = math.radians(20.0)
"""How far a bowl's side leans outwards."""


@dataclass(frozen=True, eq=False)
class Bowl:
    """A bowl on the floor: its middle (x, y), m, its inner radius, and its height, m."""

    at: tuple[float, float]
    radius_m: float
    height_m: float

    @property
    def rim_m(self) -> float:
        """Its radius at the top, m."""
        return self.radius_m + self.height_m * math.tan(SLANT_RAD)


@dataclass(eq=False)
class CompiledScene(ObjectWorld):
    """A refined object and a tool. ``base`` is the (4, 4) pose of the arm's base; ``tool_places`` are the places of the
    tool's joints among positions, (joints, k) ``ratios`` times its servos' commands is where these lead them."""

    base: Array
    tool_places: Array
    ratios: Array
    gripper: Gripper
    bowl: Bowl | None

    @cached_property
    def tip_geoms(self) -> Array:
        """(n,) mask of geoms: those of the tool that are meant to touch."""
        tips = [f"{TOOL}{tip}" for tip in ("pusher", *(tip for known in GRIPPERS.values() for tip in known.tips))]
        return np.array([self.model.body(int(body)).name in tips for body in self.model.geom_bodyid])

    @property
    def about_positions(self) -> dict[str, float]:
        """Joint → position in which the object was written, rad or m."""
        return {joint.name: joint.initial_position for joint in self.about.joints}

    @property
    def moving_kg(self) -> float:
        """Mass of the object, kg, but for what is fixed to the world."""
        return float(self.model.body_mass[[body for body in self.bodies if self.model.body_weldid[body] != 0]].sum())

    def positions(self) -> dict[str, float]:
        """Joint → position, rad or m."""
        return {joint.name: self.position(joint.name) for joint in self.about.joints}


def build_stage(
    folder: Path, tool: mujoco.MjSpec | None, base: Array, bowl: Bowl | None = None, gripper: Gripper = PANDA
) -> CompiledScene:
    """The world with a refined object at the origin in its initial state, and a tool, the arm with this gripper or the
    pusher, with its base at this (4, 4) pose. Raises LoadError as ``load`` does, ValueError where MuJoCo refuses the
    model."""
    spec, loaded = object_spec(folder, TIMESTEP_S)
    joints: list[str] = []
    ratios = np.zeros((0, 0))
    if tool is not None:
        joints = [joint.name for joint in tool.joints]
        ratios = np.eye(len(joints), len(tool.actuators))
        if len(joints) > len(tool.actuators):  # some joints follow a servo's
            ratios[-len(gripper.ratios) :, -gripper.ratios.shape[1] :] = gripper.ratios
        spec.attach(tool, prefix=TOOL, frame=spec.worldbody.add_frame(pos=base[:3, 3], quat=quaternion(base)))
    if bowl is not None:
        add_bowl(spec, bowl)
    about, prefix, model, data = compiled_object(spec, loaded)
    places = np.array([int(model.joint(TOOL + name).qposadr[0]) for name in joints], dtype=int)
    return CompiledScene(about, prefix, model, data, base.copy(), places, ratios, gripper, bowl)


def pusher_spec() -> mujoco.MjSpec:
    """A sphere that three servos move along x, y and z, whose weight nothing bears."""
    spec = mujoco.MjSpec()
    body = spec.worldbody.add_body(name="pusher", gravcomp=1.0)
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(PUSHER_M, 0.0, 0.0), mass=PUSHER_KG, contype=2, conaffinity=1, condim=4
    )
    for name, axis in zip(PUSHER, np.eye(3), strict=True):
        body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
        servo(spec, name, 2000.0, 2.0 * math.sqrt(2000.0 * PUSHER_KG), PUSHER_N)
    return spec


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


def add_bowl(spec: mujoco.MjSpec, bowl: Bowl) -> None:
    """A round bowl of flat pieces, which slants outwards, fixed to the floor."""
    body = spec.worldbody.add_body(name="bowl", pos=(*bowl.at, 0.0))
    body.add_geom(
        name="bowl_bottom", type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=(bowl.radius_m, BOWL_WALL_M / 2.0, 0.0),
        pos=(0.0, 0.0, BOWL_WALL_M / 2.0), solref=(CONTACT_TIME_S, 1.0),
    )  # fmt: skip
    half = bowl.height_m / 2.0
    for side in range(BOWL_SIDES):
        turn = 2.0 * math.pi * side / BOWL_SIDES
        out = (bowl.radius_m + bowl.rim_m) / 2.0
        body.add_geom(
            name=f"bowl_{side}", type=mujoco.mjtGeom.mjGEOM_BOX, solref=(CONTACT_TIME_S, 1.0),
            size=(BOWL_WALL_M / 2.0, 1.1 * math.pi * bowl.rim_m / BOWL_SIDES, half),
            pos=(out * math.cos(turn), out * math.sin(turn), half), quat=yaw_tilt(turn, SLANT_RAD),
        )  # fmt: skip


def yaw_tilt(yaw: float, tilt: float) -> Array:
    """(4,) wxyz quaternion of a tilt about y, then a turn about z, rad."""
    turned, first, second = np.zeros(4), np.zeros(4), np.zeros(4)
    mujoco.mju_axisAngle2Quat(first, np.array([0.0, 0.0, 1.0]), yaw)
    mujoco.mju_axisAngle2Quat(second, np.array([0.0, 1.0, 0.0]), tilt)
    mujoco.mju_mulQuat(turned, first, second)
    return turned


def place_joints(stage: CompiledScene, positions: Mapping[str, float], tool: Array | None = None) -> None:
    """Set joints of the object (rad or m) and, if given, the tool's to where these commands lead them, and what follows
    from that: poses and contacts."""
    for name, value in positions.items():
        stage.data.qpos[stage.place(name)] = value
    if tool is not None:
        stage.data.qpos[stage.tool_places] = stage.ratios @ tool
    mujoco.mj_kinematics(stage.model, stage.data)
    mujoco.mj_comPos(stage.model, stage.data)
    mujoco.mj_collision(stage.model, stage.data)
