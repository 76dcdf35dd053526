"""A verdict on one check of one subject in one engine."""

from dataclasses import dataclass

from schemas.overlay import JointPhysics
from schemas.vocabulary import FailureMode


@dataclass(frozen=True)
class CheckVerdict:
    """One check of one subject (a joint, a drop or a start) in one engine: ``value`` against ``limit``, and why."""

    test: FailureMode
    subject: str
    passed: bool
    value: float | None
    limit: float | None
    reason: str


def unit_of(joint: JointPhysics) -> str:
    """The unit of the joint's positions."""
    return "m" if joint.type == "prismatic" else "rad"
