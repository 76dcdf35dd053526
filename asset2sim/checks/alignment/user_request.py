"""The size and the joint states that the guidance asks for, read from guidance and features, not from any answer. Words
of size and stated lengths are read by rules of its own, not by those of the offline prior, which it scores."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from asset2sim.guidance import tables
from asset2sim.guidance.amounts import plain
from asset2sim.guidance.lexicon import Segment, longest_spans, segments
from asset2sim.guidance.object_facts import object_info
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.guidance.parts import parts_of
from asset2sim.guidance.sizing import dimension, identify
from asset2sim.guidance.states import State, asked_states, useful_travel
from asset2sim.guidance.tables import Size
from schemas.base import Vector3
from schemas.features import Features

ABOUT_PARTS = frozenset(("part", "parts", "open", "closed"))
"""Kinds of phrases by which a length or a word of size is about a part, not about the object."""
ABOUT_MOTION = frozenset(("damping", "damped", "friction", "spring", "stops", "turns"))
"""Kinds of phrases by which a word of size is about how a part moves ("a little friction")."""
REAL = re.compile(r"\b(?:real|actual|true|life|original|full)[ -]siz\w*")
SCALE = re.compile(r"\bscale[ds]?\s*(?:(?:factor|of|to|by|is|it|[:=])\s*)*(\d+(?:\.\d+)?)(?![\d.]*\s*(?:cm|mm|m|%)\b)")
EDGES = {"tall": "z", "high": "z", "height": "z", "wide": "side", "width": "side", "deep": "depth", "depth": "depth"}
"""Word after a stated length → the edge that it is about; any other word means the longest."""
LONGEST = frozenset(
    ("long", "length", "across", "diameter", "size", "sized", "measures", "measuring", "scale", "scaled")
)

OPENING = ("main", "cap")
"""Roles of the parts that open and close; wheels, buttons and knobs have no open or closed state."""


@dataclass(frozen=True)
class AskedSize:
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
class AskedState:
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

    size: AskedSize
    states: tuple[AskedState, ...] = ()
    lacking: tuple[str, ...] = ()
    opening: tuple[str, ...] = ()
    free: bool = False


def read_request(features: Features, guidance: str, scale: float) -> Request:
    """What the guidance asks of this object; ``scale`` is the final one, by which metres become authored ones."""
    info = object_info(features)
    size, _ = identify(info, guidance)
    statements = segments(guidance, size.category)
    parts = parts_of(info, size.category)
    asked = asked_states(info, parts, statements, scale)
    by_joint = {part.joint.name: part for part in parts}
    states = tuple(
        AskedState(name, by_joint[name].name or "part", asked.states[name], position, useful_travel(by_joint[name]))
        for name, position in asked.positions.items()
    )
    return Request(
        size=_size(info, size, guidance, statements),
        states=states,
        lacking=tuple(note for note in asked.notes if "has no" in note),
        opening=tuple(part.joint.name for part in parts if part.mechanism.role in OPENING),
        free=any(statement.of("free") for statement in statements),
    )


def _size(info: ObjectInfo, size: Size, guidance: str, statements: Sequence[Segment]) -> AskedSize:
    word, factor = _word(statements)
    real = bool(REAL.search(guidance.lower())) or (bool(word) and factor >= 1.0)
    return AskedSize(
        category=size.category,
        scale=_stated(info.size_closed_m, guidance, statements),
        word=word,
        factor=factor,
        household=(size.min_m * factor, size.max_m * factor),
        dimension=dimension(info, size),
        tabletop=not real,
    )


def _word(statements: Sequence[Segment]) -> tuple[str, float]:
    """The word of size that is furthest from the usual, of those about the object; ("", 1) without any."""
    names = {phrase: " ".join(phrase) for phrase in tables.size_words()}
    found: list[str] = []
    for segment in statements:
        kinds = {item.kind for item in segment.items}
        if kinds & (ABOUT_MOTION if segment.start == 0 else ABOUT_MOTION | ABOUT_PARTS):
            continue
        found += [name for _, _, name in longest_spans(segment.tokens, names)]
    factors = {name: tables.size_words()[tuple(name.split())] for name in found}
    if not factors:
        return "", 1.0
    extreme = min if min(factors.values()) < 1.0 else max
    word = extreme(factors, key=lambda name: factors[name])
    return word, factors[word]


def _stated(size_m: Vector3, guidance: str, statements: Sequence[Segment]) -> float | None:
    """The scale that the user states, or that a stated length of the object gives."""
    stated = SCALE.search(plain(guidance))
    if stated and float(stated.group(1)) > 0.0:
        return float(stated.group(1))
    x, y, z = size_m
    edges = {"z": z, "side": max(x, y), "depth": min(x, y)}
    for segment in statements:
        if {item.kind for item in segment.items} & ABOUT_PARTS:
            continue
        for length in segment.of("length"):
            after = segment.tokens[length.end - segment.start :][:1]
            word = after[0] if after else ""
            named = word in EDGES or bool(LONGEST & {word, *segment.tokens})
            edge = edges[EDGES[word]] if word in EDGES else max(size_m)
            if named and length.number > 0.0 and edge > 0.0:
                return length.number / edge
    return None
