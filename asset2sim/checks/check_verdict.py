"""A verdict on one check of one subject in one engine, and one on an object."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeVar

from schemas.interaction import Effort, Hold
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


@dataclass(frozen=True)
class Verdict:
    """What failed, or ``none``; the ``reason`` with its numbers, and the ``value`` and ``limit`` that were compared."""

    mode: FailureMode
    reason: str
    value: float | None = None
    limit: float | None = None

    @property
    def passed(self) -> bool:
        """Whether the asset is interaction-ready by these thresholds."""
        return self.mode is FailureMode.NONE


def unit_of(joint: JointPhysics) -> str:
    """The unit of the joint's positions."""
    return "m" if joint.type == "prismatic" else "rad"


OfJoint = TypeVar("OfJoint", Hold, Effort)


def by_joint(records: Iterable[OfJoint]) -> list[tuple[str, list[OfJoint]]]:
    """Each joint with its records: one is held at several positions, and moved both ways."""
    grouped: dict[str, list[OfJoint]] = {}
    for item in records:
        grouped.setdefault(item.joint, []).append(item)
    return list(grouped.items())
