"""The world of a trial in MuJoCo: an object on a floor, an arm or a bare pusher, and a bowl where a task needs it."""

import math
from dataclasses import dataclass, fields
from pathlib import Path

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from asset2sim.gym.arm.franka import servo
from asset2sim.gym.arm.gripper import PANDA, Gripper
from asset2sim.gym.arm.paths import vertices
from asset2sim.gym.arm.scene import CompiledScene, build_stage
from asset2sim.gym.world import CONTACT_TIME_S
from asset2sim.physics.arrays import Array

PUSHER_M, PUSHER_KG, PUSHER_N = 0.011, 0.3, 40.0
"""Radius and mass of the spherical pusher, and the force of each of its servos."""
PUSHER = ("x", "y", "z")
BOWL_SIDES, BOWL_WALL_M = 16, 0.006
BOWL_RADIUS_M, BOWL_HIGH_M = 0.12, 0.05
"""Inner radius at the bottom, and height, of a bowl: a salad bowl's, whatever is to be put into it."""
SLANT_RAD = math.radians(20.0)
"""How far a bowl's side leans outwards."""


@dataclass(frozen=True)
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
class TrialScene(CompiledScene):
    """A refined object, a tool, and the bowl where there is one."""

    bowl: Bowl | None = None

    @property
    def moving_kg(self) -> float:
        """Mass of the object, kg, but for what is fixed to the world."""
        return float(self.model.body_mass[[body for body in self.bodies if self.model.body_weldid[body] != 0]].sum())

    def positions(self) -> dict[str, float]:
        """Joint → position, rad or m."""
        return {joint.name: self.position(joint.name) for joint in self.about.joints}


def build_trial(
    folder: Path, tool: mujoco.MjSpec | None, base: Array, bowl: Bowl | None = None, gripper: Gripper = PANDA
) -> TrialScene:
    """The world as ``build_stage`` makes it, and the bowl."""
    furnish = (lambda spec: add_bowl(spec, bowl)) if bowl is not None else lambda spec: None
    stage = build_stage(folder, tool, base, gripper, furnish)
    return TrialScene(**{field.name: getattr(stage, field.name) for field in fields(stage)}, bowl=bowl)


def pushed_stage(folder: Path) -> TrialScene:
    """The world with the pusher as the tool, all of which is meant to touch."""
    stage = build_trial(folder, pusher_spec(), np.eye(4))
    stage.tip_geoms = stage.tool_geoms
    return stage


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
            pos=(out * math.cos(turn), out * math.sin(turn), half),
            quat=Rotation.from_euler("ZY", (turn, SLANT_RAD)).as_quat(scalar_first=True),
        )  # fmt: skip


def bowl_for(stage: CompiledScene) -> Bowl:
    """The bowl, of the same size for every object, beside it."""
    points = vertices(stage, frozenset(range(1, stage.model.nbody)))
    low, high = points.min(axis=0), points.max(axis=0)
    reach = max(BOWL_RADIUS_M, 0.5 * float(np.linalg.norm((high - low)[:2])))
    middle = (low + high) / 2.0
    return Bowl((float(middle[0]), float(high[1]) + reach + 0.1), BOWL_RADIUS_M, BOWL_HIGH_M)
