"""A scripted controller: the trial's planned motion as the actions of an environment."""

from typing import Any

import numpy as np

from asset2sim.gym.arm.planning import ToolPlan
from asset2sim.gym.arm.record import command
from asset2sim.gym.environment import Action, ObjectEnv
from schemas.errors import UsageError


def planned_action(env: ObjectEnv, plan: ToolPlan) -> Action:
    """The action after which the servos are told what the plan tells them then; in an environment of joint actions."""
    then = command(plan, (env.step_number + 1) * env.dt_s)
    turn = (then[:7] - env.command[:7]) / env.settings.turn_step_rad
    gripper = env.stage.gripper
    opening = 2.0 * gripper.opening_of(then[7:]) / gripper.opening_m - 1.0
    found: Action = np.clip(np.array([*turn, opening]), -1.0, 1.0).astype(np.float32)
    return found


def replay(env: ObjectEnv, start: int = 0) -> dict[str, Any]:
    """Do the planned push from a start; the last step's info. Raises UsageError where the environment's actions are not
    joints', or the planner found no way."""
    if not env.by_joints or env.subject.plan is None:
        raise UsageError("a plan is replayed with action='joints' and a base that was planned")
    env.reset(options={"start": start})
    while True:
        _, _, lost, ended, info = env.step(planned_action(env, env.subject.plan))
        if lost or ended:
            return info
