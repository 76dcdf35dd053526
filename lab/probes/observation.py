"""Observation and answer of a policy, as the DROID set-up has them: three cameras, seven joints, a gripper."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from schemas.errors import Asset2SimError, shortened

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


LONGEST = 300
"""Characters of a policy's own words that a reason may have."""


class TrialEnding(StrEnum):
    """How a trial ends that its policy has not finished; such a trial is done again by the next run."""

    DIED = "policy died"
    TIMED_OUT = "policy timed out"
    REFUSED = "answer refused"
    UNREACHABLE = "policy unreachable"


class PolicyError(Asset2SimError):
    """A policy did not answer, or not with actions; ``ending`` is what the trial's row says."""

    def __init__(self, ending: TrialEnding, message: str) -> None:
        super().__init__(shortened(message, LONGEST))
        self.ending = ending

    def __reduce__(self) -> tuple[object, ...]:
        return PolicyError, (self.ending, str(self))


def refused(message: str) -> PolicyError:
    """The error of an answer that cannot be acted upon."""
    return PolicyError(TrialEnding.REFUSED, message)


def checked_chunk(actions: object, kind: ActionKind, most: int) -> Chunk:
    """The chunk of (n, 8) actions, the gripper clipped to 0 … 1. Raises PolicyError for anything else, for more than
    ``most`` actions, and for numbers that are not finite."""
    if not isinstance(actions, np.ndarray) or actions.dtype.kind not in "fiu":
        raise refused(f"the actions are no array of numbers but {_named(actions)}")
    if actions.ndim != 2 or actions.shape[1] != ACTION_WIDTH or not 1 <= len(actions) <= most:
        raise refused(f"the actions have shape {actions.shape}; (n, {ACTION_WIDTH}) with 1 to {most} of them is valid")
    found = actions.astype(np.float64)
    if not np.isfinite(found).all():
        raise refused(f"{int((~np.isfinite(found)).sum())} of the {found.size} numbers of the actions are not finite")
    found[:, -1] = np.clip(found[:, -1], 0.0, 1.0)
    return Chunk(found, kind)


def _named(value: object) -> str:
    return f"{value.dtype} values" if isinstance(value, np.ndarray) else type(value).__name__
