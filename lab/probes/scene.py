"""The DROID scene's physics: the arm before a table, the task's object on it, seeded, and a bowl where it needs one."""

import zlib
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

from asset2sim.assets.authored import read_overlay
from asset2sim.gym.arm.franka import franka_spec
from asset2sim.gym.arm.gripper import Gripper, gripper_of
from asset2sim.gym.arm.paths import vertices
from asset2sim.gym.arm.scene import place_joints
from asset2sim.physics.arrays import Array
from lab.probes.tasks import SHIFT_M, TURN_RAD, ProbeTask
from lab.trials.scene import TrialScene, build_trial
from schemas.errors import UsageError
from schemas.overlay import JointPhysics, PhysicsOverlay

START = np.array([0.0, -np.pi / 5, 0.0, -4 * np.pi / 5, 0.0, 3 * np.pi / 5, np.pi / 4])
"""Where the arm starts, rad: DROID's, but for the last joint. DROID's gripper sits on the flange as it is, the Panda's
hand is turned by 45 degrees against it: ``FLANGE`` is between what policies are told and what the joints are."""
FLANGE = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, np.pi / 4])
NEAREST_M = 0.28
"""Least distance ahead of the arm's base at which anything of the object stands, m."""


@dataclass(frozen=True, eq=False)
class DroidScene:
    """A task's world at its start: the object lies at the world's origin, and the arm's base where the trial has it.
    ``joint`` is the one to move, with its start."""

    task: ProbeTask
    stage: TrialScene
    overlay: PhysicsOverlay
    joint: JointPhysics | None


def open_commands(gripper: Gripper) -> Array:
    """(k,) commands to the arm's servos and the gripper's at the start: its fingers are open."""
    return np.concatenate([START, gripper.servos(np.array([gripper.opening_m]))[0]])


def build_scene(folder: Path, task: ProbeTask, seed: int) -> DroidScene:
    """The world of a trial with the refined object in ``folder``. The seed decides where exactly the object stands, the
    same for every method. Raises UsageError for an object without the task's joint, LoadError and ValueError as
    ``build_trial`` does."""
    overlay = read_overlay(folder)
    joint = next((item for item in overlay.joints if item.name == task.joint), None)
    if task.joint and joint is None:
        names = ", ".join(item.name for item in overlay.joints) or "none"
        raise UsageError(f"{folder}: '{task.name}' moves {task.joint}, which is no joint of it (it has {names})")
    if joint is not None:
        joint = joint.model_copy(update={"initial_position": task.start_of(joint)})
    alone = started(build_trial(folder, None, np.eye(4)), joint)
    points = vertices(alone, frozenset(range(1, alone.model.nbody)))
    base = base_of(task, points, seed)
    bowl = None
    if task.bowl is not None:
        x, y = (base @ [*task.bowl.at, 0.0, 1.0])[:2]
        bowl = replace(task.bowl, at=(float(x), float(y)))
    gripper = gripper_of(task.gripper)
    stage = started(build_trial(folder, franka_spec(gripper), base, bowl, gripper), joint)
    place_joints(stage, {}, open_commands(gripper))
    stage.data.ctrl[:] = open_commands(gripper)
    mujoco.mj_forward(stage.model, stage.data)
    return DroidScene(task, stage, overlay, joint)


def base_of(task: ProbeTask, points: Array, seed: int) -> Array:
    """(4, 4) pose of the arm's base in the frame of an object whose shapes have these (n, 3) points."""
    shift = np.random.default_rng([seed, zlib.crc32(task.name.encode())]).uniform(-1.0, 1.0, 3)
    yaw = task.yaw + TURN_RAD * float(shift[2])
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    turned = points[:, :2] @ turn.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    at = np.array(task.at)
    at[0] = max(at[0], NEAREST_M + (high[0] - low[0]) / 2.0)
    origin = at + SHIFT_M * shift[:2] - (low + high) / 2.0
    base = np.eye(4)
    base[:2, :2], base[:2, 3] = turn.T, -turn.T @ origin
    base[2, 3] = points[:, 2].min()  # what is fixed clears the floor: the arm stands as high as the object
    return base


def started(stage: TrialScene, joint: JointPhysics | None) -> TrialScene:
    """The stage with the joint at its start, and the object, if it is free, on the table."""
    if joint is not None:
        position = joint.initial_position
        joints = tuple(
            replace(item, initial_position=position) if item.name == joint.name else item for item in stage.about.joints
        )
        stage = replace(stage, about=replace(stage.about, joints=joints))
    place_joints(stage, stage.about.positions_at())
    if stage.model.body_dofnum[stage.root] == 6:
        lowest = float(vertices(stage, frozenset(stage.bodies))[:, 2].min())
        stage.data.qpos[stage.model.jnt_qposadr[stage.model.body_jntadr[stage.root]] + 2] -= lowest
        place_joints(stage, {})
    return stage
