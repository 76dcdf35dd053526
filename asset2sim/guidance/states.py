"""The states that a sentence asks for, clause by clause, and the joints of the parts that it means."""

import math
from collections.abc import Sequence
from typing import Any

from asset2sim.guidance.clauses import GENERIC, NO_MENTION, Mention, mentioned_parts, parts_of_whole, split_states
from asset2sim.guidance.lexicon import Item, Segment, place_of
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.guidance.parts import MovablePart, is_switch, ordinal_candidates, outermost_parts
from schemas.guidance import WHOLE_OBJECT, AskedOpening, AskedState, State

_POSES = ("rest", "pressed", "sideways", "normal", "up", "down", "off", "on", "out")
_PLACES = ("up", "down", "off")
"""Poses whose words are so common that they count only right after their part: "its lever up"."""
_PARTICLES = {"on": 0.0, "out": None}
"""Poses that only the last words of a statement are, with what is open by then: "its cap on", not "on the lid"."""
UPRIGHT = 0.9
"""|axis · z| from which a part turns about the vertical."""
_DIMENSIONS = ("wide", "tall", "long", "high", "deep", "thick", "across", "diameter", "width", "height", "length")


def asked_states(
    info: ObjectInfo, parts: Sequence[MovablePart], statements: Sequence[Segment]
) -> tuple[AskedState, ...]:
    """Every state that is asked for, of joints and of parts that are not there, as read; "the others" last."""
    found: list[AskedState] = []
    deferred: list[tuple[Mention, State, Segment]] = []
    last = pending = NO_MENTION
    sentence = -1
    for segment in (piece for statement in statements for piece in split_states(statement)):
        if segment.sentence != sentence:
            sentence, pending = segment.sentence, NO_MENTION
        here = mentioned_parts(info, parts, segment, last)
        if pending.found and here.words == ("everything",) and not here.others and _refers(segment):
            here = NO_MENTION
        state = state_of(segment, here.found or pending.found)
        if here.found or here.carried:
            last = here
        if state is None:
            pending = _joined(pending, here) if here.found else pending
            continue
        subject = (
            _joined(pending, here)
            if here.found or pending.found
            else Mention(_of_whole(info, _measured_by(parts, state), segment, here.carried), (WHOLE_OBJECT,))
        )
        pending = NO_MENTION
        if here.others:
            deferred.append((here, state, segment))
            continue
        if not subject.parts and (subject.words != (WHOLE_OBJECT,) or not segment.of("switched")):
            found.append(AskedState(state=state, subject=subject.words, **place_of(segment)))
        found += _of_each(info, subject, state, segment)
    for subject, state, segment in deferred:
        named = {wish.joint for wish in found}
        unnamed = tuple(part for part in subject.parts if part.joint.name not in named)
        found += _of_each(info, Mention(unnamed, ("other " + subject.words[-1],)), state, segment)
    return tuple(found)


def state_of(segment: Segment, about_parts: bool) -> State | None:
    """The state that a clause speaks of, or None. Degrees alone ("halfway") are states only where a part is named."""
    verbs = segment.of("open", "closed", "ajar")
    degree = _degree(segment)
    measure = _measure(segment, verbs)
    negated = any(item.value == "state" for item in segment.of("not"))
    poses = [item for item in segment.of(*_POSES) if _is_pose(item, segment)]
    if not verbs:
        opening, switched = bool(segment.of("opening")), segment.of("switched")
        if measure is not None and (about_parts or opening or measure.value == "travel"):
            return _measured(measure, False)
        if degree is not None and (opening or (about_parts and degree not in (1.0, "slightly"))):
            return _open(1.0 if degree == "slightly" and negated else _share(degree), slightly=degree == "slightly")
        if switched and _ends(switched[-1], segment):
            return _open(None if switched[-1].value == "on" else 0.0)
        if not poses or not (about_parts or poses[0].kind == "rest"):
            return None
        return _open(_PARTICLES[poses[0].kind]) if poses[0].kind in _PARTICLES else State(kind=poses[0].kind)
    closing = verbs[-1].kind == "closed" and not any(verb.kind == "open" for verb in verbs)
    if measure is not None:
        return _measured(measure, closing)
    if verbs[0].kind == "ajar":
        degree = "slightly"
    return _negated(degree, closing) if negated else _stated(degree, closing)


def _is_pose(item: Item, segment: Segment) -> bool:
    """Whether a word is about how a part stands, by where it is."""
    if item.kind in _PARTICLES:
        before = segment.tokens[: item.start - segment.start]
        closing, named = _ends(item, segment), segment.of("part", "parts", "ordinal")
        at = item.start - (before[-1:] == ("one",))
        return closing and any(other.end == at and other.value not in GENERIC for other in named)
    return item.kind not in _PLACES or _follows_part(item, segment)


def _ends(item: Item, segment: Segment) -> bool:
    """Whether a phrase ends its statement: "a lamp that is on", not "is on a table"."""
    return item.end - segment.start == len(segment.tokens)


def _of_whole(
    info: ObjectInfo, parts: Sequence[MovablePart], segment: Segment, which: Sequence[str]
) -> tuple[MovablePart, ...]:
    """The parts that a state of the whole object is about; of what is switched on or off, its switches; of "the left
    one open", ``which`` of them."""
    switched = segment.of("switched") and not segment.of("open", "closed", "ajar")
    if switched:
        return tuple(part for part in parts if is_switch(part.name, part.mechanism.kind))
    whole = parts_of_whole(info, parts)
    return (ordinal_candidates(info, whole, which, parts) if {"one", "ones"} & {*segment.tokens} else ()) or whole


def _follows_part(item: Item, segment: Segment) -> bool:
    """Whether a word of a place is about a part right before it: "its lever up"; "it slides up" is what it can do."""
    before = segment.tokens[: item.start - segment.start][-1:]
    return before != ("slides",) and any(0 <= item.start - part.end <= 2 for part in segment.of("part", "parts"))


def _of_each(info: ObjectInfo, subject: Mention, state: State, segment: Segment) -> list[AskedState]:
    """The state as asked of each of the subject's parts; of nested ones, unless to be closed, of the outermost."""
    means = _measured_by(subject.parts, state)
    chosen = means if state.share == 0.0 else outermost_parts(info, means)
    ends = [item for item in segment.of("on", "off") if _ends(item, segment)]
    turned = _open(None if ends[-1].kind == "on" else 0.0) if ends else state
    return [
        AskedState(
            state=turned if is_switch(part.name, part.mechanism.kind) else state,
            subject=subject.words,
            joint=part.joint.name,
            **place_of(segment),
        )
        for part in chosen
        if (part.joint.motion != "spin" or part.mechanism.role != "roll") and not _swivels(part, state)
    ]


def _measured_by(parts: Sequence[MovablePart], state: State) -> tuple[MovablePart, ...]:
    """The parts that turn where a state is an angle, or slide where it is a length; all where none does so."""
    slides = state.measure is not None and state.measure.kind == "length"
    found = [part for part in parts if state.measure is None or slides is (part.joint.motion == "slider")]
    return tuple(found or parts)


def _swivels(part: MovablePart, state: State) -> bool:
    """Whether a screen is to be up or down and turns about the vertical, which raises nothing: on its foot."""
    turns = part.joint.motion != "slider" and abs(part.joint.axis[2]) > UPRIGHT
    return turns and state.kind in ("up", "down") and part.name in ("screen", "")


def _refers(segment: Segment) -> bool:
    """Whether "all" or "both" are those just named: "two doors, both open"."""
    return all(item.value == "all" for item in segment.of("quantifier"))


def _joined(first: Mention, second: Mention) -> Mention:
    """Both mentions as one; of the first, only the parts that open and close. Where the second is some of the first,
    those alone: "with two drawers, the upper one open"."""
    if not second.found:
        return first
    if second.parts and set(second.parts) <= set(first.parts):
        return second
    opening = tuple(part for part in first.parts if part.mechanism.role in ("main", "cap"))
    parts = opening + tuple(part for part in second.parts if part not in opening)
    return Mention(parts, (first.words if opening else ()) + second.words, second.others)


def _degree(segment: Segment) -> float | str | None:
    degrees = segment.of("degree")
    verbs = segment.of("open", "closed", "opening")
    if not degrees:
        return None
    nearest = min(degrees, key=lambda item: min((_gap(item, verb) for verb in verbs), default=0))
    return nearest.value if nearest.value == "slightly" else float(nearest.value)


def _measure(segment: Segment, verbs: Sequence[Item]) -> Item | None:
    for item in segment.of("share", "angle", "length"):
        after = segment.tokens[item.end - segment.start :][:1]
        if item.kind == "length" and ((not verbs and not segment.of("opening")) or (after and after[0] in _DIMENSIONS)):
            continue
        return item
    return None


def _gap(first: Item, second: Item) -> int:
    return second.start - first.end if first.start < second.start else first.start - second.end


def _share(degree: float | str) -> float | None:
    return None if isinstance(degree, str) else degree


def _open(share: float | None = None, **how: Any) -> State:
    return State(kind="open", share=share, **how)


def _measured(measure: Item, closing: bool) -> State:
    if measure.kind == "share":
        share = min(max(measure.number, 0.0), 1.0)
        return _open(1.0 - share if closing else share)
    if closing and measure.number == 0.0:
        return _open(0.0)
    return _open(measure=AskedOpening.model_validate({"kind": measure.kind, "amount": measure.number}))


def _stated(degree: float | str | None, closing: bool) -> State:
    if degree is None:
        return _open(0.0) if closing else _open()
    if isinstance(degree, str):
        return _open(slightly=True, closing=closing)
    return _open(1.0 - degree if closing else degree)


def _negated(degree: float | str | None, closing: bool) -> State:
    if closing:
        return _open(slightly=True)
    whole_way = not isinstance(degree, str) and degree is not None and math.isclose(degree, 1.0)
    return _open(0.75 if whole_way else 0.0)
