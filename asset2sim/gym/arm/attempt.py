"""An attempt at a task: who does it, the arm or a bare pusher, in which world, and by which motion."""

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from asset2sim.gym.arm.franka import Arm, franka_spec, waiting
from asset2sim.gym.arm.grasps import bowl_for, grasp_paths
from asset2sim.gym.arm.gripper import PANDA, Gripper
from asset2sim.gym.arm.paths import push_paths
from asset2sim.gym.arm.planning import ToolPlan, plan_arm, plan_pusher
from asset2sim.gym.arm.pulls import pull_paths
from asset2sim.gym.arm.scene import Bowl, CompiledScene, base_at, build_stage, place, pusher_spec
from asset2sim.gym.arm.tasks import Task, Verb, target_of
from schemas.overlay import JointPhysics


@dataclass(frozen=True, eq=False)
class PlannedTrial:
    """A planned trial: the tool's name and motion, in a world of its own."""

    tool: str
    stage: CompiledScene
    plan: ToolPlan


def planned(
    folder: Path, task: Task, joint: JointPhysics | None, gripper: Gripper = PANDA
) -> tuple[PlannedTrial | None, Bowl | None]:
    """A trial's tool and motion, and the bowl where it needs one; the pusher pushes where the arm finds no way."""
    arm = Arm(gripper)
    bowl = bowl_for(build_stage(folder, None, np.eye(4))) if joint is None else None
    stage = build_stage(folder, franka_spec(gripper), base_at(0.0, 1.0), bowl, gripper)
    place(stage, stage.about_positions, waiting(gripper))
    mujoco.mj_forward(stage.model, stage.data)
    if joint is None:
        assert bowl is not None
        plan = plan_arm(stage, arm, None, grasp_paths(stage, bowl))
    else:
        target, plan = target_of(task, joint), None
        if task.verb is Verb.OPEN:
            plan = plan_arm(stage, arm, joint.name, pull_paths(stage, joint, target))
        plan = plan or plan_arm(stage, arm, joint.name, push_paths(stage, joint, target, task.verb))
    if plan is not None:
        return PlannedTrial("arm", build_stage(folder, franka_spec(gripper), plan.base, bowl, gripper), plan), bowl
    if joint is None:
        return None, bowl
    stage = build_stage(folder, pusher_spec(), np.eye(4))
    place(stage, stage.about_positions, np.array([0.0, 0.0, 10.0]))
    mujoco.mj_forward(stage.model, stage.data)
    plan = plan_pusher(stage, joint.name, push_paths(stage, joint, target_of(task, joint), task.verb))
    return (None if plan is None else PlannedTrial("pusher", stage, plan)), None
