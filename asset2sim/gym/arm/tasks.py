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
LARGE_SHARE = 0.1
"""Share of the largest part's inertia at the hand from which a part counts: a knob is not what a door's task is."""
LEAST_RAD, LEAST_M, LEAST_PRESS_M = 0.05, 5e-3, 1.5e-3
"""Travel from which something is to be done with a hinge, with a slider, and with one that a spring brings back."""
OPENED_M = 0.03
"""How far a slider is opened at least, m, if it goes so far."""
LIFTED_KG = 3.0
"""Heaviest object that is lifted: the arm's payload."""
ROLLING, HANGING = ("wheel", "caster"), ("handle", "bail", "strap")
"""Words of parts on which an object rolls, and of those by which it is carried, which nothing holds up."""


class Verb(StrEnum):
    """Action of a task: push a part shut, press it down and let go, push it open, turn it, lay it over to the end
    further from where it starts, or lift the object into a bowl."""

    CLOSE = "close"
    PRESS = "press"
    OPEN = "open"
    TURN = "turn"
    LAY = "lay"
    GRASP = "grasp"


@dataclass(frozen=True)
class Task:
    """One thing to do with an object. ``part`` is the label of the link to move, as the dataset has it; empty for one
    of the large parts: the one that is furthest open (``close``), the sprung one (``press``), the closed one that no
    spring brings back (``open``), or the one without ends (``turn``); of several the one with most inertia at the hand,
    of equals the first in the file."""

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
    """The paper's tasks of one of its nine; of another object what its large parts ask for: close what stands open,
    else open what is closed, else turn what has no ends, else press what a spring brings back; lift what has nothing of
    these but its handle, if an arm can. None of what is fixed or heavy and has no part to move."""
    if overlay.asset_id in PAPER:
        return PAPER[overlay.asset_id]
    large = large_parts(overlay)
    ajar = [joint for joint in large if kind_of(joint) is not Verb.TURN and is_ajar(joint)]
    if ajar:
        kinds = {Verb.PRESS if kind_of(joint) is Verb.PRESS else Verb.CLOSE for joint in ajar}
    else:
        kinds = {kind_of(joint) for joint in large}
    for verb in (Verb.CLOSE, Verb.OPEN, Verb.TURN, Verb.PRESS):
        if verb in kinds:
            return (Task(verb.value, verb),)
    mass_kg = sum(link.mass_kg for link in overlay.links)
    return () if overlay.support.fixed or mass_kg > LIFTED_KG else (Task("grasp", Verb.GRASP),)


def joint_of(task: Task, overlay: PhysicsOverlay) -> JointPhysics | None:
    """The joint that a task moves; None where the task moves none or the object has none such."""
    if task.verb is Verb.GRASP:
        return None
    if task.part:
        found = [joint for joint in overlay.joints if range_of(joint) > 0.0 and joint.label == task.part]
    else:
        found = large_parts(overlay) or [joint for joint in overlay.joints if travel_of(joint) > 0.0]
    if task.verb is not Verb.CLOSE:
        found = [joint for joint in found if kind_of(joint) is task.verb] or found
    if task.verb is not Verb.TURN:
        found = [joint for joint in found if range_of(joint) > 0.0]
    way = -1.0 if task.verb is Verb.OPEN else 1.0
    return max(found, key=lambda joint: (way * round(openness(joint), 2), inertia_at_hand(joint)), default=None)


def large_parts(overlay: PhysicsOverlay) -> list[JointPhysics]:
    """Joints of what a hand may be asked to move: not what the object rolls on or is carried by, nor what hardly moves,
    nor what is small beside the largest."""
    found = [joint for joint in overlay.joints if joint.mimic is None and travel_of(joint) >= least_travel(joint)]
    found = [joint for joint in found if overlay.support.fixed or not is_called(joint, ROLLING)]
    found = [joint for joint in found if joint.holds or not is_called(joint, HANGING) or kind_of(joint) is Verb.PRESS]
    least = LARGE_SHARE * max(map(inertia_at_hand, found), default=0.0)
    return [joint for joint in found if inertia_at_hand(joint) >= least]


def kind_of(joint: JointPhysics) -> Verb:
    """Action that a closed part asks for: ``turn`` where it has no ends, more than a turn between them, or rests in the
    middle of both; ``press`` where a spring brings it back; else ``open``."""
    whole = range_of(joint)
    middle = joint.type != "prismatic" and abs((joint.lower or 0.0) + (joint.upper or 0.0)) <= NEAR_SHARE * whole
    if whole <= 0.0 or whole >= 2.0 * math.pi or (middle and abs(joint.initial_position) <= NEAR_SHARE * whole):
        return Verb.TURN
    return Verb.PRESS if joint.stiffness > 0.0 and not joint.holds else Verb.OPEN


def is_ajar(joint: JointPhysics) -> bool:
    """Whether a part starts open."""
    return openness(joint) > 0.0 and not is_near(joint, joint.initial_position, joint.closed)


def is_called(joint: JointPhysics, words: tuple[str, ...]) -> bool:
    """Whether a part is called by one of these words."""
    return any(word in joint.label.lower() or word in joint.name.lower() for word in words)


def travel_of(joint: JointPhysics) -> float:
    """How far a joint goes, rad or m: its range, a turn where it has no ends."""
    return 2.0 * math.pi if joint.type == "continuous" else range_of(joint)


def least_travel(joint: JointPhysics) -> float:
    """Travel from which something is to be done with a joint, rad or m."""
    slides = LEAST_PRESS_M if joint.stiffness > 0.0 and not joint.holds else LEAST_M
    return slides if joint.type == "prismatic" else LEAST_RAD


def target_of(task: Task, joint: JointPhysics) -> float:
    """Where a task's joint should end, rad or m: shut, or, where it is pressed and is shut already, open; for ``open``
    a third of the range further open than it starts (a hinge at most half a right angle, a slider ``OPENED_M`` at least
    if it goes so far), for ``turn`` the same, and half a right angle where there are no ends; for ``lay`` the end
    further from where it starts, of two as far the open one."""
    if task.verb is Verb.PRESS and is_near(joint, joint.initial_position, joint.closed):
        return joint.open
    if task.verb is Verb.LAY:
        return max(joint.open, joint.closed, key=lambda end: round(abs(end - joint.initial_position), 2))
    if task.verb not in (Verb.OPEN, Verb.TURN):
        return joint.closed
    whole = range_of(joint)
    if joint.type == "prismatic":
        return joint.initial_position + math.copysign(min(whole, max(whole / 3.0, OPENED_M)), joint.open - joint.closed)
    way = min(whole / 3.0 if whole > 0.0 else math.inf, math.pi / 4.0)
    return joint.initial_position + math.copysign(way, joint.open - joint.closed)


def inertia_at_hand(joint: JointPhysics) -> float:
    """Inertia that a hand moves, kg: a slider's, and a hinge's on a lever of ``LEVER_M``."""
    return joint.effective_inertia / (1.0 if joint.type == "prismatic" else LEVER_M**2)


def openness(joint: JointPhysics) -> float:
    """Share of its range by which a joint starts open; 0 where it has no ends."""
    if range_of(joint) <= 0.0:
        return 0.0
    return (joint.initial_position - joint.closed) / (joint.open - joint.closed)


def range_of(joint: JointPhysics) -> float:
    """A joint's range, rad or m; zero where it has none."""
    ends = joint.type != "continuous" and joint.lower is not None and joint.upper is not None
    bounded = ends and joint.open != joint.closed
    return (joint.upper or 0.0) - (joint.lower or 0.0) if bounded else 0.0


def is_near(joint: JointPhysics, position: float, target: float) -> bool:
    """Whether a position counts as the target."""
    return abs(position - target) <= (NEAR_SHARE * range_of(joint) if joint.type == "prismatic" else NEAR_RAD)
