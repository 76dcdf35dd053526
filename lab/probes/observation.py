"""Observation and answer of a policy, as the DROID set-up has them: three cameras, seven joints, a gripper."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

JOINTS = 7
"""Joints of the arm, a Franka Panda's."""
ACTION_WIDTH = JOINTS + 1
"""Columns of an action: one a joint, and the gripper."""
CONTROL_HZ = 15.0
"""Actions a second, as DROID's data and policies have them."""
OPEN_LOOP = 8
"""Actions of a chunk that are carried out before the policy is asked again, as openpi's DROID example does."""

Picture = NDArray[np.uint8]
ActionKind = Literal["joint_velocity", "joint_position"]


@dataclass(frozen=True)
class Observation:
    """A policy's observation at one moment. Pictures are (height, width, 3), RGB, of any size."""

    exterior_left: Picture
    exterior_right: Picture
    wrist: Picture
    joints: NDArray[np.float64]
    """Positions of the arm's seven joints, rad."""
    gripper: float
    """0 open … 1 closed."""
    prompt: str
    """The instruction, in words."""


@dataclass(frozen=True)
class Chunk:
    """Actions for the next steps of 1/15 s: (n, 8), one column a joint, the last the gripper (0 open … 1 closed)."""

    actions: NDArray[np.float64]
    kind: ActionKind
    """joint_velocity: the first seven columns in rad/s; joint_position: in rad."""


Policy = Callable[[Observation], Chunk]
"""Answers what to do next, or raises PolicyError."""
