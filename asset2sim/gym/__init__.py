"""A Gymnasium environment for any refined object: importing this registers ``Asset2Sim-v0``."""

from pathlib import Path
from typing import Literal

import gymnasium
import numpy as np
from numpy.typing import NDArray

from asset2sim.gym.arm.tasks import Task
from asset2sim.gym.environment import Action, ObjectEnv
from asset2sim.gym.scripted import replay
from asset2sim.physics.arrays import Array
from schemas.learning_settings import LearningSettings

__all__ = ["ENVIRONMENT", "ObjectEnv", "make_env", "replay"]

ENVIRONMENT = "Asset2Sim-v0"
"""The name under which Gymnasium knows it."""


def make_env(
    folder: str | Path,
    task: Task | str | None = None,
    *,
    action: Literal["tool", "joints"] = "tool",
    settings: LearningSettings | None = None,
    base: Array | None = None,
) -> gymnasium.Env[NDArray[np.float32], Action]:
    """An environment of the refined object in ``folder`` (as OUT/assets/ID), what ``ObjectEnv`` says of it. ``task`` is
    one of ``asset2sim.gym.arm.tasks`` or its name, None the object's first that moves a joint; ``action`` is ``tool``
    or ``joints``; ``base`` the (4, 4) pose of the arm's base, None to plan it (seconds, once a process and object).
    Raises UsageError where there is nothing to learn, LoadError where the object cannot be loaded."""
    return gymnasium.make(ENVIRONMENT, folder=str(folder), task=task, action=action, settings=settings, base=base)


gymnasium.register(ENVIRONMENT, entry_point="asset2sim.gym.environment:ObjectEnv")
