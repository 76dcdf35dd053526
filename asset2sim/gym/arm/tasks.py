"""Tasks of the arm with an object: the paper's eleven tasks, and one for any other object."""

import math
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType

from schemas.overlay import JointPhysics, PhysicsOverlay

NEAR_RAD, NEAR_SHARE = 0.1, 0.05
"""How near a hinge (rad) and a slider (share of its range) must end to where it should be. The paper has an ε for each
task and publishes none; this is what looks closed in a picture of 512 pixels."""


LEVER_M = 0.25
"""Lever on which hinges are compared with sliders, m: half a cupboard door."""


class Verb(StrEnum):
    """Action of a task: push a part shut, press it down and let go, push it open, or lift the object into a bowl."""

    CLOSE = "close"
    PRESS = "press"
    OPEN = "open"
    GRASP = "grasp"


@dataclass(frozen=True)
class Task:
    """One thing to do with an object. ``part`` is the label of the link to move, as the dataset has it; empty for the
    one that is furthest open (``close``), the sprung one (``press``) or the closed one that no spring brings back
    (``open``); of several the one with most inertia."""

    name: str
    verb: Verb
    part: str = ""


PAPER = MappingProxyType(
    {
        "103275": (Task("stapler press", Verb.PRESS, "lid"), Task("stapler grasp", Verb.GRASP)),
        "100221": (Task("box close", Verb.CLOSE, "rotation_lid"), Task("box grasp", Verb.GRASP)),
        "7236": (Task("microwave close", Verb.CLOSE, "door"),),
        "102703": (Task("toilet close", Verb.CLOSE, "lid"),),
        "9912": (Task("laptop fold", Verb.CLOSE, "screen"),),
        "101673": (Task("bag grasp", Verb.GRASP),),
        "19179": (Task("cabinet close", Verb.CLOSE, "drawer"),),
        "103755": (Task("suitcase close", Verb.CLOSE, "lid"),),
        "102181": (Task("trashcan close", Verb.CLOSE, "lid"),),
    }
)
"""The paper's nine objects and their eleven tasks, by asset id; names as its tables have them."""


def tasks_of(overlay: PhysicsOverlay) -> tuple[Task, ...]:
    """The paper's tasks of one of its nine; of another object: close what stands open, or press what a spring brings
    back; else open what is closed, else lift it. None of a fixed object without a part to move."""
    if overlay.asset_id in PAPER:
        return PAPER[overlay.asset_id]
    joints = [joint for joint in overlay.joints if range_of(joint) > 0.0]
    ajar = [joint for joint in joints if openness(joint) > 0.0]
    if any(not is_near(joint, joint.initial_position, joint.closed) for joint in ajar):
        opened = joint_of(Task("close", Verb.CLOSE), overlay)
        sprung = opened is not None and opened.stiffness > 0.0
        return (Task("press", Verb.PRESS) if sprung else Task("close", Verb.CLOSE),)
    if not joints:
        return () if overlay.support.fixed else (Task("grasp", Verb.GRASP),)
    return (Task("press", Verb.PRESS) if all(joint.stiffness > 0.0 for joint in joints) else Task("open", Verb.OPEN),)


def joint_of(task: Task, overlay: PhysicsOverlay) -> JointPhysics | None:
    """The joint that a task moves; None where the task moves none or the object has none such."""
    found = [joint for joint in overlay.joints if range_of(joint) > 0.0 and task.part in ("", joint.label)]
    if task.verb is Verb.GRASP or not found:
        return None
    if task.verb is not Verb.CLOSE:
        pressed = task.verb is Verb.PRESS
        found = [joint for joint in found if (joint.stiffness > 0.0) is pressed] or found
    way = -1.0 if task.verb is Verb.OPEN else 1.0
    return max(found, key=lambda joint: (way * round(openness(joint), 2), inertia_at_hand(joint)))


def target_of(task: Task, joint: JointPhysics) -> float:
    """Where a task's joint should end, rad or m: shut, or, where it is pressed and is shut already, open; for
    ``open`` a third of the range (at most half a right angle) further open than it starts."""
    if task.verb is Verb.PRESS and is_near(joint, joint.initial_position, joint.closed):
        return joint.open
    if task.verb is not Verb.OPEN:
        return joint.closed
    way = min(range_of(joint) / 3.0, math.inf if joint.type == "prismatic" else math.pi / 4.0)
    return joint.initial_position + math.copysign(way, joint.open - joint.closed)


def inertia_at_hand(joint: JointPhysics) -> float:
    """Inertia that a hand moves, kg: a slider's, and a hinge's on a lever of ``LEVER_M``."""
    return joint.effective_inertia / (1.0 if joint.type == "prismatic" else LEVER_M**2)


def openness(joint: JointPhysics) -> float:
    """Share of its range by which a joint starts open."""
    return (joint.initial_position - joint.closed) / (joint.open - joint.closed)


def range_of(joint: JointPhysics) -> float:
    """A joint's range, rad or m; zero where it has none."""
    bounded = joint.lower is not None and joint.upper is not None and joint.open != joint.closed
    return (joint.upper or 0.0) - (joint.lower or 0.0) if bounded else 0.0


def is_near(joint: JointPhysics, position: float, target: float) -> bool:
    """Whether a position counts as the target."""
    return abs(position - target) <= (NEAR_SHARE * range_of(joint) if joint.type == "prismatic" else NEAR_RAD)
