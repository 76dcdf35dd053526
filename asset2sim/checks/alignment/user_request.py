"""The size and the joint states by which an asset is scored, from the record of what its user's sentence asks, the
user's own numbers, which go before it, and its features, not from any answer. The record is the same that the rules
have. Which of its words of size and stated lengths count is decided here, by rules that are not those of the offline
prior, which is scored by them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from asset2sim.guidance import tables
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.guidance.parts import MovablePart, parts_of
from asset2sim.guidance.placing import asked_position, useful_travel
from asset2sim.guidance.sizing import dimension, edge_m, extreme_word, is_of_object
from asset2sim.models.object_facts import object_info
from schemas.asset import Overrides, StatedPosition
from schemas.features import Features, JointFeatures
from schemas.guidance import AskedScale, AskedSize, Guidance, State

ABOUT_MOTION = frozenset(("damping", "damped", "friction", "spring", "stops", "turns"))
"""Kinds of phrases by which a word of size is about how a part moves ("a little friction") ..."""
ABOUT_PARTS = frozenset(("part", "parts", "open", "closed"))
"""... and by which it is about a part, unless it stands in the first statement."""
CLOSED = State(kind="open", share=0.0)
"""A state that an object without the part is in all the same."""
OPENING = ("main", "cap")
"""Roles of the parts that open and close; wheels, buttons and knobs have no open or closed state."""


@dataclass(frozen=True)
class SizeCriterion:
    """The size that is asked for. ``scale`` is what the user states in numbers, as a uniform scale; None if nothing.

    ``word`` and ``factor`` are the word of size and what it stands for against the usual size ("" and 1 without one);
    ``household`` the usual range of the object's ``dimension`` (its authored length, m), in m; ``tabletop`` whether
    the paper's rule for handling on a table may stand for it, which it may not where a real size is asked for.
    """

    category: str
    scale: float | None
    word: str
    factor: float
    household: tuple[float, float]
    dimension: float
    tabletop: bool


@dataclass(frozen=True)
class StateCriterion:
    """The state that is asked of one joint: ``position`` is where it leads, rad or m at the authored scale."""

    joint: str
    part: str
    state: State
    position: float
    usual_range: float


@dataclass(frozen=True)
class Request:
    """The size and the joint states that are asked of one object. ``lacking`` lists states of parts that it does not
    have and could only be in with them, ``opening`` the joints of all parts that open and close. ``free`` says that
    something is to move freely, so that gravity may take it from the state that is asked for."""

    size: SizeCriterion
    states: tuple[StateCriterion, ...] = ()
    lacking: tuple[str, ...] = ()
    opening: tuple[str, ...] = ()
    free: bool = False


def read_request(features: Features, guidance: Guidance, scale: float, own: Overrides | None = None) -> Request:
    """The request of the guidance, and of the user's ``own`` numbers, for this object; ``scale`` is the final one, by
    which metres become authored ones."""
    info, own = object_info(features), own or Overrides()
    if (stated := own.scale_of(features)) is not None:
        size = guidance.size.model_copy(update={"scale": AskedScale(words="own", value=stated)})
        guidance = guidance.model_copy(update={"size": size})
    parts = parts_of(info, guidance.category)
    by_joint = {part.joint.name: part for part in parts}
    states = tuple(
        StateCriterion(
            name,
            by_joint[name].name or "part",
            wish.state,
            asked_position(by_joint[name], wish, scale),
            useful_travel(by_joint[name]),
        )
        for name, wish in guidance.of_joints.items()
        if name not in own.joints
    )
    joints = {joint.name: joint for joint in features.movable_joints}
    states += tuple(
        _own_state(joints[name], wanted, by_joint, scale) for name, wanted in own.joints.items() if name in joints
    )
    return Request(
        size=_size(info, guidance),
        states=states,
        lacking=tuple(wish.describe() for wish in guidance.lacking if wish.state != CLOSED),
        opening=tuple(part.joint.name for part in parts if part.mechanism.role in OPENING),
        free=guidance.free,
    )


def _own_state(
    joint: JointFeatures, wanted: StatedPosition, parts: Mapping[str, MovablePart], scale: float
) -> StateCriterion:
    """A position of the user's own, which the asset can have (``check_overrides``)."""
    part = parts.get(joint.name)
    name = (part.name if part is not None else "") or "part"
    if wanted.unit == "share":
        closed, opened = joint.closed or 0.0, joint.open or 0.0
        at, state = closed + wanted.value * (opened - closed), State(kind="open", share=wanted.value)
    else:
        at = math.radians(wanted.value) if wanted.unit == "deg" else wanted.value
        at, state = at / scale if joint.prismatic else at, State(kind="at the user's own position")
    return StateCriterion(joint.name, name, state, at, useful_travel(part) if part is not None else 0.0)


def _size(info: ObjectInfo, guidance: Guidance) -> SizeCriterion:
    size, asked = tables.sizes()[guidance.category], guidance.size
    elsewhere = {"first": ABOUT_MOTION}
    counted = [
        word for word in asked.words if not set(word.beside) & elsewhere.get(word.place, ABOUT_MOTION | ABOUT_PARTS)
    ]
    word, factor = extreme_word(counted)
    return SizeCriterion(
        category=size.category,
        scale=_stated(info, asked),
        word=word,
        factor=factor,
        household=(size.min_m * factor, size.max_m * factor),
        dimension=dimension(info, size),
        tabletop=not asked.real and (not word or factor < 1.0),
    )


def _stated(info: ObjectInfo, asked: AskedSize) -> float | None:
    """The scale that the user states, or that a stated length of the object gives."""
    if asked.scale is not None:
        return asked.scale.value
    for length in asked.lengths:
        edge = edge_m(info.size_closed_m, length.following)
        if (length.beside or is_of_object(length)) and edge > 0.0:
            return length.metres / edge
    return None
