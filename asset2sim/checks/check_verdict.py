"""A joint's unit, and its records, for the verdicts of checks."""

from collections.abc import Iterable
from typing import TypeVar

from schemas.interaction import Effort, Hold
from schemas.overlay import JointPhysics


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
