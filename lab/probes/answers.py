"""Faults of a policy's answer, and the answer that may be acted upon."""

from enum import StrEnum

import numpy as np

from lab.probes.observation import ACTION_WIDTH, ActionKind, Chunk
from schemas.errors import Asset2SimError, shortened

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
