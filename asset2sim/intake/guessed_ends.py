"""Which end is closed where shape does not tell: both readings, by what each would mean for the part."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from asset2sim.assets.extract import Extraction, drawn_tree
from asset2sim.assets.meshes.openness import DrawnTree, outer_end
from asset2sim.assets.urdf.mimic import with_followed_ends
from asset2sim.guidance.parts import PRESSED, drawn_pressed, is_switch, part_name, swinging
from asset2sim.guidance.tables import mechanism
from asset2sim.intake.blocked_joints import LinkShapes, links_overlap, moving_pair
from asset2sim.physics.arrays import Array
from schemas.features import Features, JointFeatures

STEP_SHARE = 0.01
"""Step from an end, as a share of the range, over which it is seen whether the part sinks."""
SINKS = 0.1
"""Descent of a part's middle over its way, from which gravity moves it: steeper than most hinges and slides rub."""
WHOLE_TURN_RAD = 6.0
"""Range of a hinge from which both its ends are about one place."""
EITHER_SIDE = ("handle",)
"""Parts that lie to either side, so that no end is closed by their shape: they are folded down where they sink to."""
DRAWN_AT = 0.01
"""Share of its range from an end within which a part is drawn at it."""
SLACK = 0.03
"""Share of its range by which a limit may lie beyond where a part is drawn shut: a stop that gives."""
CAUGHT = ("door",)
"""Parts with a catch, which may lead downwards from where they are shut, and which may hang there."""


@dataclass(frozen=True)
class GuessedEnd:
    """A joint of a main part of which only a guess says which end is closed. ``means`` maps each end (rad or m at the
    authored scale), its guessed closed one first, to what would be odd if the part were closed there."""

    joint: JointFeatures
    part: str
    means: Mapping[float, tuple[str, ...]]


@dataclass(frozen=True)
class ToldEnd:
    """A model's answer on a joint: the position at which its part is closed, rad or m at the authored scale, and the
    confidence of that, 0 to 1."""

    closed: float
    sure: float


def guessed_ends(extraction: Extraction, sure: float) -> tuple[GuessedEnd, ...]:
    """The joints whose closed end only a guess tells with less than the confidence ``sure``, with what either means."""
    features = extraction.features
    guessed = [joint for joint in features.movable_joints if is_guessed(joint, features, sure)]
    shapes, drawn = LinkShapes(extraction), drawn_tree(extraction, features.joints)
    found = []
    for joint in guessed:
        part = part_of(joint, features)
        assert joint.closed is not None and joint.open is not None, "what is guessed has ends"
        if part in EITHER_SIDE:
            continue
        ends = (joint.closed, joint.open)
        means = {order[0]: odd_if_closed(joint, order, features, drawn, shapes) for order in (ends, ends[::-1])}
        found.append(GuessedEnd(joint, part, means))
    return tuple(found)


def with_told_ends(extraction: Extraction, told: Mapping[str, ToldEnd]) -> Extraction:
    """The extraction with the closed ends of these joints, and how sure they are, as they were told."""
    joints = []
    for joint in extraction.features.joints:
        if (end := told.get(joint.name)) is not None:
            assert joint.closed is not None and joint.open is not None, "only joints with ends are asked about"
            turned = abs(end.closed - joint.open) < abs(end.closed - joint.closed)
            update = {"openness_confidence": end.sure, **({"other_reading": ""} if turned else {})}
            ends = {"closed": joint.open, "open": joint.closed} if turned else {}
            joint = joint.model_copy(update={**update, **ends})
        joints.append(joint)
    features = extraction.features.model_copy(update={"joints": tuple(with_followed_ends(joints))})
    return replace(extraction, features=features)


def with_likelier_ends(extraction: Extraction, sure: float) -> Extraction:
    """The extraction with the closed end, of each main part whose shape tells it with less than the confidence
    ``sure``, that means less that is odd: overlapping there, falling open, hanging beside the object. What the other
    would mean stands in the joint's ``other_reading``; the confidence stays that of a guess. A button is
    closed where it is drawn, or where that is part of the way in, where it stands out; a tap or a switch that is drawn
    at an end is off. What is closed a little beyond where it is drawn is closed where it is drawn."""
    features = extraction.features
    guessed = [joint for joint in features.movable_joints if is_guessed(joint, features, sure)]
    buttons = [
        joint for joint in features.movable_joints if is_button(joint, features) or is_drawn_off(joint, features, sure)
    ]
    shapes, drawn = LinkShapes(extraction), drawn_tree(extraction, features.joints)
    changed = {joint.name: likelier(joint, features, drawn, shapes) for joint in guessed}
    changed |= {joint.name: standing_out(joint, features, drawn) for joint in buttons}
    joints = with_followed_ends([without_slack(changed.get(joint.name, joint)) for joint in features.joints])
    return replace(extraction, features=features.model_copy(update={"joints": tuple(joints)}))


def part_of(joint: JointFeatures, features: Features) -> str:
    """The part that a joint moves, by its label or else its name."""
    return part_name(features.link(joint.child).label, joint.child, joint.name)


def is_guessed(joint: JointFeatures, features: Features, sure: float) -> bool:
    """Whether a joint opens a main part, and its shape does not tell with that confidence which way."""
    part = part_of(joint, features)
    role = mechanism(part, features.category, "slider" if joint.prismatic else "hinge").role
    tells = joint.type == "continuous" or joint.mimic is not None or joint.openness_confidence >= sure
    # A nameless slider may be a button, which its spring holds up.
    named = (bool(part) and part not in EITHER_SIDE) or not joint.prismatic
    if tells or role != "main" or not named or joint.closed is None or joint.open is None:
        return False
    return 0.0 < abs(joint.open - joint.closed) < (math.inf if joint.prismatic else WHOLE_TURN_RAD)


def without_slack(joint: JointFeatures) -> JointFeatures:
    """The joint, closed where its part is drawn where that lies a little within its closed end and the other well on
    this side."""
    if not joint.movable or joint.mimic is not None or joint.closed is None or joint.open is None:
        return joint
    slack = joint.closed * joint.open < 0.0 and abs(joint.closed) <= SLACK * abs(joint.open - joint.closed)
    return joint.model_copy(update={"closed": 0.0}) if slack else joint


def is_button(joint: JointFeatures, features: Features) -> bool:
    """Whether a joint slides a button, with a shape and beside others, between two ends."""
    shown = features.link(joint.child).has_geometry and sum(link.has_geometry for link in features.links) > 1
    ends = joint.lower is not None and joint.upper is not None and joint.lower != joint.upper
    return joint.prismatic and ends and shown and joint.mimic is None and part_of(joint, features) in PRESSED


def is_drawn_off(joint: JointFeatures, features: Features, sure: float) -> bool:
    """Whether a joint turns a tap's handle or a switch of which its shape does not tell with that confidence which end
    is off, and which is drawn at one."""
    if joint.type != "revolute" or joint.lower is None or joint.upper is None or joint.openness_confidence >= sure:
        return False
    part = part_of(joint, features)
    switches = is_switch(part, mechanism(part, features.category, "hinge").kind)
    return switches and min(abs(joint.lower), abs(joint.upper)) <= DRAWN_AT * (joint.upper - joint.lower)


def standing_out(joint: JointFeatures, features: Features, drawn: DrawnTree) -> JointFeatures:
    """A button's joint with the end as closed at which it is drawn, or stands out where it is drawn pressed."""
    assert joint.lower is not None and joint.upper is not None, "only such are buttons"
    ends = (joint.lower, joint.upper)
    closed = min(ends, key=abs)
    if drawn_pressed(part_of(joint, features), "slider", *ends):
        closed = outer_end(drawn, drawn.joint(joint.name), ends)
    return joint.model_copy(update={"closed": closed, "open": ends[0] if closed == ends[1] else ends[1]})


def likelier(joint: JointFeatures, features: Features, drawn: DrawnTree, shapes: LinkShapes) -> JointFeatures:
    """The joint with its likelier closed end: in doubt the one at which it is drawn, or else the one that it has. Of
    parts whose shape tells, those that are drawn at an end are closed there."""
    assert joint.closed is not None and joint.open is not None, "movable joints have ends"
    has, other = joint.closed, joint.open
    if swinging(part_of(joint, features), features.category, joint.type, joint.lower, joint.upper) == "swing lid":
        return joint.model_copy(update={"closed": 0.0, "open": joint.upper})
    if part_of(joint, features) in EITHER_SIDE:
        here, there = (middle_at(joint, at, drawn) for at in (has, other))
        lower = here[2] - there[2] > SINKS * float(np.linalg.norm(there - here))
        return joint.model_copy(update={"closed": other, "open": has}) if lower else joint
    if other == 0.0 != has:
        has, other = other, has
    odd_now = odd_if_closed(joint, (has, other), features, drawn, shapes)
    odd_then = odd_if_closed(joint, (other, has), features, drawn, shapes)
    if len(odd_then) < len(odd_now):
        has, other, odd_then = other, has, odd_now
    means = f"it would {' and '.join(odd_then)}" if odd_then else "it would mean nothing that is odd"
    return joint.model_copy(update={"closed": has, "open": other, "other_reading": f"closed at the other end {means}"})


def odd_if_closed(
    joint: JointFeatures, ends: tuple[float, float], features: Features, drawn: DrawnTree, shapes: LinkShapes
) -> tuple[str, ...]:
    """Oddities of a part that would be closed at the first of these ends and open at the second, as verbs."""
    odd = []
    way = moving_pair(joint.name, features, drawn.tree, shapes)
    if way is not None and links_overlap(way, ends[0], shapes) and not links_overlap(way, ends[1], shapes):
        odd.append(f"overlap '{way.still}' there")
    if part_of(joint, features) in CAUGHT:
        return tuple(odd)
    here, near = (middle_at(joint, at, drawn) for at in (ends[0], ends[0] + STEP_SHARE * (ends[1] - ends[0])))
    if here[2] - near[2] > SINKS * float(np.linalg.norm(near - here)):
        odd.append("fall open")
    frame, _, still = drawn.parted(drawn.joint(joint.name), ends[0])
    if len(still) and not joint.prismatic and here[2] < frame[2, 3]:
        body = still[:, :2]
        if np.any((here[:2] < body.min(axis=0)) | (here[:2] > body.max(axis=0))):
            odd.append("hang beside the object")
    return tuple(odd)


def middle_at(joint: JointFeatures, position: float, drawn: DrawnTree) -> Array:
    """(3,) middle of the box about what a joint moves, at this position of it, in the root's frame, m at the authored
    scale."""
    cloud = drawn.parted(drawn.joint(joint.name), position)[1]
    cloud = cloud if len(cloud) else np.zeros((1, 3))
    found: Array = (cloud.min(axis=0) + cloud.max(axis=0)) / 2.0
    return found
