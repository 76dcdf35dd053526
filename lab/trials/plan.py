"""A trial's motion: the arm's, or where it finds no way to push, a bare pusher's."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from asset2sim.gym.arm.franka import Arm, franka_spec, waiting
from asset2sim.gym.arm.gripper import PANDA, Gripper
from asset2sim.gym.arm.paths import ToolPath, push_paths, vertices
from asset2sim.gym.arm.planning import ABOVE, ToolPlan, moving_plan, plan_arm, runs_into, times_of
from asset2sim.gym.arm.scene import CompiledScene, base_at, place_joints
from asset2sim.gym.arm.tasks import Task, target_of
from lab.trials.lifts import grasp_paths
from lab.trials.scene import Bowl, TrialScene, bowl_for, build_trial, pushed_stage
from schemas.overlay import JointPhysics


@dataclass(frozen=True, eq=False)
class PlannedTrial:
    """A planned trial: the tool's name and motion, in a world of its own."""

    tool: str
    stage: TrialScene
    plan: ToolPlan


def planned(
    folder: Path, task: Task, joint: JointPhysics | None, gripper: Gripper = PANDA
) -> tuple[PlannedTrial | None, Bowl | None]:
    """A trial's tool and motion, and the bowl where it needs one; the pusher pushes where the arm finds no way."""
    arm = Arm(gripper)
    bowl = bowl_for(build_trial(folder, None, np.eye(4))) if joint is None else None
    stage = build_trial(folder, franka_spec(gripper), base_at(0.0, 1.0), bowl, gripper)
    if bowl is not None:
        place_joints(stage, stage.about.positions_at(), waiting(gripper))
        mujoco.mj_forward(stage.model, stage.data)
        plan = plan_arm(stage, arm, None, grasp_paths(stage, bowl))
    elif joint is not None:
        plan = moving_plan(stage, arm, task, joint)
    if plan is not None:
        return PlannedTrial("arm", build_trial(folder, franka_spec(gripper), plan.base, bowl, gripper), plan), bowl
    if joint is None:
        return None, bowl
    stage = pushed_stage(folder)
    place_joints(stage, stage.about.positions_at(), np.array([0.0, 0.0, 10.0]))
    mujoco.mj_forward(stage.model, stage.data)
    plan = plan_pusher(stage, joint.name, push_paths(stage, joint, target_of(task, joint), task.verb))
    return (None if plan is None else PlannedTrial("pusher", stage, plan)), None


def plan_pusher(stage: CompiledScene, joint: str, paths: Iterable[ToolPath]) -> ToolPlan | None:
    """The first way that the bare pusher can follow without running into anything; None for none."""
    for path in paths:
        top = float(vertices(stage, frozenset(range(1, stage.model.nbody)))[:, 2].max())
        first, last = ([*at[:2], max(top, at[2]) + ABOVE[2]] for at in (path.points[0], path.points[-1]))
        tools = np.array([first, first, path.points[0] + ABOVE, *path.points, path.points[-1] + ABOVE, last, last])
        phases = ("settle", "settle", "approach", *path.phases, "retreat", "retreat", "rest")
        plan = ToolPlan(np.eye(4), times_of(tools, tools, phases), tools, phases)
        if not runs_into(stage, joint, path, plan):
            return plan
    return None
