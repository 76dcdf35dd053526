"""A Gymnasium environment for any refined object; importing this registers ``Asset2Sim-v0``."""

from pathlib import Path
from typing import Any, Literal

import gymnasium
import numpy as np
from numpy.typing import NDArray

from asset2sim.gym.arm.planning import ToolPlan, command
from asset2sim.gym.arm.tasks import Task
from asset2sim.gym.environment import Action, ObjectEnv
from asset2sim.load.description import State
from asset2sim.physics.arrays import Array
from schemas.errors import UsageError
from schemas.learning_settings import LearningSettings

__all__ = ["ENVIRONMENT", "ObjectEnv", "make_env", "planned_action", "replay"]

ENVIRONMENT = "Asset2Sim-v0"
"""The name under which Gymnasium knows it."""


def make_env(
    folder: str | Path,
    task: Task | str | None = None,
    *,
    action: Literal["tool", "joints"] = "tool",
    settings: LearningSettings | None = None,
    base: Array | None = None,
    state: State = None,
) -> gymnasium.Env[NDArray[np.float32], Action]:
    """An environment of the refined object in ``folder`` (as OUT/assets/ID), what ``ObjectEnv`` says of it. ``task`` is
    one of ``asset2sim.gym.arm.tasks`` or its name, None the object's first that moves a joint; ``action`` is ``tool``
    or ``joints``; ``base`` the (4, 4) pose of the arm's base, None to plan it (seconds, once a process and object);
    ``state`` where its joints start, as in ``asset2sim.load``: None as asked of it, on the starts of the reset check.
    Raises UsageError where there is nothing to learn, LoadError where the object cannot be loaded."""
    return gymnasium.make(
        ENVIRONMENT, folder=str(folder), task=task, action=action, settings=settings, base=base, state=state
    )


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


gymnasium.register(ENVIRONMENT, entry_point="asset2sim.gym.environment:ObjectEnv")
