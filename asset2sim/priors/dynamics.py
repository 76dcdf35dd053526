"""How each joint feels: the mechanism's habits, changed by what the guidance says of them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from asset2sim.priors.feel import Feel, felt
from asset2sim.priors.information import ObjectInfo
from asset2sim.priors.lexicon import Item, Segment
from asset2sim.priors.parts import Part, main_parts
from asset2sim.priors.states import high_end
from asset2sim.priors.thoughts import NOBODY, mention
from schemas.overlay import JointProposal

_OPEN = 0.05
"""Share of its travel from which a part that is asked to stand there stands open."""
_NEAR, _FAR = 3, 6
"""Words between a level and its noun: "low hinge damping", "the damping of the hinge is low"."""
_KINDS = (
    "damping",
    "damped",
    "friction",
    "free",
    "slow",
    "smooth",
    "hold",
    "spring",
    "stiff",
    "soft",
    "light",
    "soft close",
    "slam",
    "glide",
    "snap",
    "slow return",
    "closing",
    "returning",
    "stops",
    "turns",
)
_SHUTTING = ("closing", "soft close", "slam")
_RETURNING = ("returning", "spring", "snap", "slow return")
"""Kinds of words beside which a time says how long the part takes to shut, or to come back."""


def propose_joints(
    info: ObjectInfo,
    parts: Sequence[Part],
    thoughts: Sequence[Segment],
    positions: Mapping[str, float],
) -> tuple[tuple[JointProposal, ...], tuple[str, ...]]:
    """A proposal per movable joint, and notes on what the guidance changed.

    ``positions`` are the asked states: a joint that is asked to stand somewhere holds there, unless it moves freely,
    and a spring that is asked for rests where the joint is asked to be.
    """
    feels = {
        part.joint.name: Feel(part.mechanism.coast_s, part.mechanism.spring_hz, part.mechanism.holds) for part in parts
    }
    notes: list[str] = []
    for part in parts:
        name = part.joint.name
        if name in positions and part.mechanism.spring_hz is None and part.mechanism.role in ("main", "cap"):
            feels[name] = replace(feels[name], holds=True)
    for subject, segment in _clauses(info, parts, thoughts):
        changes = _changes(segment)
        for part in _able(subject, changes):
            position = positions.get(part.joint.name, part.joint.closed)
            asked_open = abs(position - part.joint.closed) > _OPEN * part.joint.range
            feels[part.joint.name] = felt(feels[part.joint.name], changes, part, asked_open)
        if subject and changes:
            notes.append(f"feel: {_said(changes)} → {_listed(subject)}")
    return (
        tuple(_proposal(part, feels[part.joint.name], positions) for part in parts),
        tuple(notes),
    )


def _clauses(
    info: ObjectInfo, parts: Sequence[Part], thoughts: Sequence[Segment]
) -> Iterator[tuple[tuple[Part, ...], Segment]]:
    """Every segment that speaks of a feel, with its parts: its own, the next noun's, the last named, or the main."""
    last = NOBODY
    for before, segment, after in zip((None, *thoughts), thoughts, (*thoughts[1:], None), strict=False):
        if before is not None and before.sentence != segment.sentence:
            last = NOBODY
        here = mention(info, parts, segment, last)
        last = here if here.found else last
        if not segment.of(*_KINDS):
            continue
        if not here.found and after is not None and after.sentence == segment.sentence and _adjective(segment, after):
            yield mention(info, parts, after, last).parts, segment
        else:
            yield here.parts if here.found else last.parts or main_parts(parts), segment


def spring_rest(part: Part, positions: Mapping[str, float]) -> float:
    """Where the part's spring returns it to: rad, or m at the authored scale."""
    if part.mechanism.spring_rest == "up":
        return high_end(part)
    if part.mechanism.spring_rest == "zero":
        return part.joint.zero
    return positions.get(part.joint.name, part.joint.closed)


def _proposal(part: Part, feel: Feel, positions: Mapping[str, float]) -> JointProposal:
    sprung = feel.spring_hz is not None
    return JointProposal(
        name=part.joint.name,
        coast_s=feel.coast_s,
        spring_hz=feel.spring_hz,
        spring_rest=spring_rest(part, positions) if sprung else None,
        holds=feel.holds and not sprung,
        closes_s=feel.closes_s if not feel.holds and not sprung else None,
        stops_within=None if sprung else feel.stops_within,
        returns_s=feel.returns_s if sprung else None,
        damping_level=feel.level or feel.word,
    )


def _able(subject: Sequence[Part], changes: Mapping[str, str]) -> tuple[Part, ...]:
    """A spring is asked of the parts that are pushed, not of what merely turns on them."""
    pushed = tuple(part for part in subject if part.joint.motion != "spin")
    return pushed if "spring" in changes and pushed else tuple(subject)


def _said(changes: Mapping[str, str]) -> str:
    return ", ".join(f"{level} {kind}".strip() for kind, level in changes.items())


def _listed(subject: Sequence[Part]) -> str:
    names = [part.joint.name for part in subject]
    return ", ".join(names) if len(names) <= 4 else f"{names[0]} to {names[-1]} ({len(names)} joints)"


def _changes(segment: Segment) -> dict[str, str]:
    """What a segment says, as kind → level or ""."""
    changes: dict[str, str] = {}
    negations = segment.of("not")
    for item in segment.of(*_KINDS):
        negated = any(0 <= item.start - other.end < _NEAR for other in negations)
        if item.kind in ("closing", "returning", "stops", "turns"):
            continue
        if item.kind in ("damping", "damped", "friction"):
            level = "super low" if negated else _level(segment, item)
            if level is None and item.kind == "damped":
                level = "high"
            if level is not None:
                changes[item.kind.replace("damped", "damping")] = level
        elif item.kind == "light" and segment.of("damping", "friction"):
            continue
        else:
            changes[f"no {item.kind}" if negated else item.kind] = ""
    return changes | _measured(segment)


def _measured(segment: Segment) -> dict[str, str]:
    """The time that a segment states for shutting or coming back, s, and the way in which a part stops, m or rad."""
    found = {item.kind: f"{item.number:g}" for item in segment.of("stops", "turns")}
    for item in segment.of("time")[:1]:
        if segment.of(*_SHUTTING):
            found["closes"] = f"{item.number:g}"
        elif segment.of(*_RETURNING):
            found["returns"] = f"{item.number:g}"
    return found


def _level(segment: Segment, noun: Item) -> str | None:
    """The level that stands next to "damping" or "friction"; before it, else after it."""
    levels = segment.of("level", "light", "heavy")
    before = [item for item in levels if 0 <= noun.start - item.end < _NEAR]
    after = [item for item in levels if 0 <= item.start - noun.end < _FAR]
    found = before[-1] if before else after[0] if after else None
    return None if found is None else {"light": "low", "heavy": "high"}.get(found.kind, found.value)


def _adjective(segment: Segment, following: Segment) -> bool:
    """Whether a segment only opens a list of adjectives that the next one ends with its noun: "light, springy keys"."""
    own = segment.of(*_KINDS)
    return (
        len(own) == len(segment.items) == 1
        and own[0].kind in ("light", "soft", "stiff", "spring")
        and own[0].end - segment.start == len(segment.tokens)
        and bool(following.of("part", "parts"))
    )
