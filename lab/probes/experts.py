"""Scripted probes: an expert that knows the state and follows a planned motion, and the same with noise."""

from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np

from asset2sim.gym.arm.franka import DAMPING, STIFFNESS, Arm
from asset2sim.gym.arm.gripper import Gripper
from asset2sim.gym.arm.paths import ToolPath, push_paths
from asset2sim.gym.arm.planning import (
    HELD_RAD,
    TILT_RAD,
    ToolPlan,
    command,
    hand_fits,
    joints_along,
    runs_into,
    timed_motion,
    times_of,
)
from asset2sim.gym.arm.scene import place_joints
from asset2sim.physics.arrays import Array
from lab.probes.controller import STEP_RAD
from lab.probes.episode import NamedTask, probe_task
from lab.probes.observation import CONTROL_HZ, JOINTS, OPEN_LOOP, Chunk, Observation, Policy
from lab.probes.scene import FLANGE, START, DroidScene, build_scene, open_commands
from lab.trials.lifts import grasp_paths
from schemas.errors import Asset2SimError

MOST_WAYS = 150
"""Ways that are tried before a task counts as out of reach."""
BEHIND_RAD = 0.12
"""How far the arm may be behind its plan before the plan waits for it, rad."""
NOISE_RAD_S = 0.3
"""Standard deviation of the noisy expert's velocities about the expert's, rad/s: a tenth of DROID's largest."""


class NoWayError(Asset2SimError):
    """The expert finds no way to do the task with this object from where the arm stands."""


class Expert:
    """Follows a plan: knows the object's state from the start, sees only its own joints, and no picture."""

    def __init__(self, plan: ToolPlan, gripper: Gripper) -> None:
        self.plan, self.gripper = plan, gripper
        self.now_s = float(plan.times_s[1])  # the episode has waited already
        self.speed = np.zeros(JOINTS)

    def __call__(self, seen: Observation) -> Chunk:
        """The next actions along the plan, from where the joints are; it waits where they are far behind."""
        joints, actions = seen.joints + FLANGE, []
        for _ in range(OPEN_LOOP):
            after_s = min(self.now_s + 1.0 / CONTROL_HZ, float(self.plan.times_s[-1]))
            wanted = command(self.plan, after_s)
            if np.abs(wanted[:JOINTS] - joints).max() > BEHIND_RAD:
                wanted = command(self.plan, self.now_s)
            else:
                self.now_s = after_s
            change = (wanted[:JOINTS] - joints - DRIFT * self.speed) / REACHED
            change = change / max(1.0, float(np.abs(change).max()) / STEP_RAD)
            joints = joints + REACHED * change + DRIFT * self.speed
            self.speed = KICK * change + KEPT * self.speed
            gripper = 1.0 - self.gripper.opening_of(wanted[JOINTS:]) / self.gripper.opening_m
            actions.append([*(change * CONTROL_HZ), np.clip(gripper, 0.0, 1.0)])
        return Chunk(np.array(actions), "joint_velocity")


class Noisy:
    """An expert whose hand shakes: normal noise on its velocities."""

    def __init__(self, expert: Policy, seed: int) -> None:
        self.expert, self.random = expert, np.random.default_rng([seed, 1])

    def __call__(self, seen: Observation) -> Chunk:
        """The expert's actions, and noise."""
        chunk = self.expert(seen)
        actions = chunk.actions.copy()
        actions[:, :JOINTS] += self.random.normal(0.0, NOISE_RAD_S, (len(actions), JOINTS))
        return Chunk(actions, chunk.kind)


def servo_terms() -> tuple[Array, Array, Array, Array]:
    """Motion of a servo of critical damping in one step: the share of a commanded change that it reaches, the speed
    that this leaves (1/s), and of the speed at the start the way that it goes (s) and the share that is kept."""
    rate = 2.0 * np.array(STIFFNESS) / np.array(DAMPING)
    took = 1.0 / CONTROL_HZ
    fades = np.exp(-rate * took)
    return 1.0 - (1.0 + rate * took) * fades, rate**2 * took * fades, took * fades, (1.0 - rate * took) * fades


REACHED, KICK, DRIFT, KEPT = servo_terms()


def scripted(folder: Path, task: NamedTask, seed: int) -> Expert:
    """The expert for a trial: it plans from the trial's own start. Raises NoWayError, and as ``build_scene`` does."""
    scene = build_scene(folder, probe_task(task), seed)
    plan = plan_of(scene)
    if plan is None:
        raise NoWayError(f"{task.name} with {folder.name}: the arm finds no way that runs into nothing")
    return Expert(plan, scene.stage.gripper)


def ways_of(scene: DroidScene) -> Iterator[ToolPath]:
    """Ways of the tool to do the task, best first."""
    stage, joint = scene.stage, scene.joint
    if joint is None:
        assert stage.bowl is not None
        return grasp_paths(stage, stage.bowl)
    return push_paths(stage, joint, joint.closed, scene.task.verb)


def plan_of(scene: DroidScene) -> ToolPlan | None:
    """The first way that the arm can follow from where it stands without running into anything; None for none."""
    stage, arm, name = scene.stage, Arm(scene.stage.gripper), scene.joint.name if scene.joint is not None else None
    base = stage.base.copy()
    far = open_commands(stage.gripper)
    far[1] = -1.6  # out of the rays' way
    place_joints(stage, stage.about.positions_at(), far)
    ways = list(islice(ways_of(scene), MOST_WAYS))
    try:
        for way in ways:
            tilt = TILT_RAD if way.across is None else HELD_RAD
            joints = joints_along(arm, base, way, range(len(way.points)), tilt)
            if joints is None or (way.across is not None and not hand_fits(stage, arm, way, base, joints[0], tilt)):
                continue
            plan = from_start(timed_motion(arm, base, way, joints), arm)
            if not runs_into(stage, name, way, plan):
                return plan
        return None
    finally:
        place_joints(stage, stage.about.positions_at(), open_commands(stage.gripper))


def from_start(plan: ToolPlan, arm: Arm) -> ToolPlan:
    """The plan with DROID's start instead of the trials' own."""
    commands = plan.commands.copy()
    commands[[0, 1, -2, -1], :7] = START
    tools = np.array([arm.tool(row[:7])[0] for row in commands])
    return ToolPlan(plan.base, times_of(tools, commands, plan.phases), commands, plan.phases)
