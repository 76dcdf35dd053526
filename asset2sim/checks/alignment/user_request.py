"""The size and the joint states by which an asset is scored, from the record of what its user's sentence asks and its
features, not from any answer. The record is the same that the rules have. Which of its words of size and stated lengths
count is decided here, by rules that are not those of the offline prior, which is scored by them."""

from dataclasses import dataclass

from asset2sim.guidance import tables
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.guidance.parts import parts_of
from asset2sim.guidance.placing import asked_position, useful_travel
from asset2sim.guidance.sizing import EDGES, dimension, edge_m, extreme_word
from asset2sim.models.object_facts import object_info
from schemas.features import Features
from schemas.guidance import AskedSize, Guidance, State

ABOUT_MOTION = frozenset(("damping", "damped", "friction", "spring", "stops", "turns"))
"""Kinds of phrases by which a word of size is about how a part moves ("a little friction") ..."""
ABOUT_PARTS = frozenset(("part", "parts", "open", "closed"))
"""... and by which it is about a part, unless it stands in the first statement."""
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
    have, ``opening`` the joints of all parts that open and close. ``free`` says that something is to move freely, so
    that gravity may take it from the state that is asked for."""

    size: SizeCriterion
    states: tuple[StateCriterion, ...] = ()
    lacking: tuple[str, ...] = ()
    opening: tuple[str, ...] = ()
    free: bool = False


def read_request(features: Features, guidance: Guidance, scale: float) -> Request:
    """The request of the guidance for this object; ``scale`` is the final one, by which metres become authored ones."""
    info = object_info(features)
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
    )
    return Request(
        size=_size(info, guidance),
        states=states,
        lacking=tuple(wish.describe() for wish in guidance.lacking),
        opening=tuple(part.joint.name for part in parts if part.mechanism.role in OPENING),
        free=guidance.free,
    )


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
        if (length.following in EDGES or length.beside) and edge > 0.0:
            return length.metres / edge
    return None
