"""The states that the guidance asks for: joint → position. Closed to open is 0 to 1, whatever the sign of the range."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from asset2sim.guidance.clauses import NO_MENTION, Mention, mention, split, whole
from asset2sim.guidance.lexicon import Item, Segment
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.guidance.parts import MovablePart, outermost

_UNSURE = 0.05
"""Confidence below which the two ends of a turning cap look alike: closed is then the authored zero."""
_WHOLE = ("everything", "object")
"""Words for all parts that open."""
_NEUTRAL = 0.2
"""The same of a part that turns as far either way from its authored zero: a tap's lever, a knob, a crank."""
_SYMMETRIC = 0.02
"""Difference of the two ways, as a share of the range, up to which they count as the same."""
LIMIT_ROUNDING = 5e-5
"""Half a unit of the fifth digit, relative."""
_SLIGHTLY = 0.2
"""Share of its useful travel that a part is open which is slightly open: visibly, and the upper end of the 10 to 20 %
that the paper's prompt states, at which parts that overlap near their closed end (a stapler's magazine) are clear."""
_POSES = ("rest", "pressed", "sideways", "normal", "up", "down", "off")
_PLACES = ("up", "down", "off")
"""Poses whose words are so common that they count only right after their part: "its lever up"."""
_DIMENSIONS = ("wide", "tall", "long", "high", "deep", "thick", "across", "diameter", "width", "height", "length")


@dataclass(frozen=True)
class State:
    """The state in a clause: ``kind`` open, rest, pressed, up, down, sideways; opened by ``share`` or ``measure``."""

    kind: str
    share: float | None = None
    slightly: bool = False
    closing: bool = False
    measure: Item | None = None

    def describe(self) -> str:
        """A word or two for the notes."""
        if self.measure is not None:
            return f"open by {self.measure.number:.3g} {'rad' if self.measure.kind == 'angle' else 'm'}"
        if self.slightly:
            return "slightly closed" if self.closing else "slightly open"
        if self.kind != "open":
            return self.kind
        return {0.0: "closed", 1.0: "fully open"}.get(self.share or 0.0, f"{100 * (self.share or 0.0):.0f} % open")


@dataclass(frozen=True)
class Asked:
    """Joint → asked position (rad, or m at the authored scale), why, and joint → the state as it was said."""

    positions: dict[str, float]
    notes: tuple[str, ...]
    states: dict[str, State] = field(default_factory=dict)


def asked_states(info: ObjectInfo, parts: Sequence[MovablePart], statements: Sequence[Segment], scale: float) -> Asked:
    """Every state that the guidance asks for; ``scale`` turns metres in the guidance into authored ones."""
    positions: dict[str, float] = {}
    states: dict[str, State] = {}
    notes: list[str] = []
    deferred: list[tuple[Mention, State]] = []
    last = pending = NO_MENTION
    sentence = -1
    for segment in (piece for statement in statements for piece in split(statement)):
        if segment.sentence != sentence:
            sentence, pending = segment.sentence, NO_MENTION
        here = mention(info, parts, segment, last)
        state = state_of(segment, here.found or pending.found)
        if here.found or here.carried:
            last = here
        if state is None:
            pending = _joined(pending, here) if here.found else pending
            continue
        subject = _joined(pending, here) if here.found or pending.found else Mention(whole(info, parts), ("object",))
        pending = NO_MENTION
        if here.others:
            deferred.append((here, state))
            continue
        if not subject.parts:
            missing = "part that opens" if subject.words[-1] in _WHOLE else " or ".join(subject.words)
            notes.append(f"state: {state.describe()} is asked, and this object has no {missing}")
        states |= dict.fromkeys(_place(info, subject, state, scale, positions, notes), state)
    for subject, state in deferred:
        left = tuple(part for part in subject.parts if part.joint.name not in positions)
        others = Mention(left, ("other " + subject.words[-1],))
        states |= dict.fromkeys(_place(info, others, state, scale, positions, notes), state)
    return Asked(positions, tuple(notes), states)


def state_of(segment: Segment, about_parts: bool) -> State | None:
    """The state that a clause speaks of, or None. Degrees alone ("halfway") are states only where a part is named."""
    verbs = segment.of("open", "closed", "ajar")
    degree = _degree(segment)
    measure = _measure(segment, verbs)
    negated = any(item.value == "state" for item in segment.of("not"))
    poses = [item for item in segment.of(*_POSES) if item.kind not in _PLACES or _follows_part(item, segment)]
    if not verbs:
        if measure is not None and about_parts:
            return _measured(measure, False)
        opening = bool(segment.of("opening"))
        if degree is not None and (opening or (about_parts and degree not in (1.0, "slightly"))):
            return State("open", 1.0 if degree == "slightly" and negated else _share(degree), degree == "slightly")
        return State(poses[0].kind) if poses and (about_parts or poses[0].kind == "rest") else None
    closing = verbs[-1].kind == "closed" and not any(verb.kind == "open" for verb in verbs)
    if measure is not None:
        return _measured(measure, closing)
    if verbs[0].kind == "ajar":
        degree = "slightly"
    return _negated(degree, closing) if negated else _stated(degree, closing)


def _follows_part(item: Item, segment: Segment) -> bool:
    return any(0 <= item.start - part.end <= 2 for part in segment.of("part", "parts"))


def position(part: MovablePart, state: State, scale: float, whole_object: bool = False) -> float:
    """Joint position of a part in a state, its own or that of the ``whole_object``: rad, or m at the authored scale."""
    joint = part.joint
    if joint.motion == "spin" or joint.range == 0.0:
        return joint.zero
    if state.measure is not None:
        if state.measure.kind == "length" and joint.motion != "slider":
            return joint.opened_by(0.5 * joint.range)
        return joint.opened_by(state.measure.number / (scale if joint.motion == "slider" else 1.0))
    if state.kind == "open":
        used = useful_travel(part)
        if state.slightly:
            return joint.opened_by((1.0 - _SLIGHTLY if state.closing else _SLIGHTLY) * used)
        if state.share == 0.0 and ends_look_alike(part, whole_object):
            return joint.zero
        share = state.share or 0.0
        return joint.opened_by(joint.range if share == 1.0 else share * used)
    return _pose(part, state.kind)


def useful_travel(part: MovablePart) -> float:
    """How far a part is opened in use, rad or m at the authored scale, by which "half open" counts: a refrigerator's
    door that turns by 180° stands half open at half of what doors are used at. Fully open is the end of its range."""
    joint = part.joint
    return joint.range if joint.motion == "slider" else min(joint.range, part.mechanism.usual_rad)


def ends_look_alike(part: MovablePart, whole_object: bool) -> bool:
    """Whether neither end of a part's travel looks closed: of a turning cap, or of what turns as far either way and is
    not named: a handle that is to be folded down lies at an end."""
    joint = part.joint
    if part.mechanism.role == "cap":
        return joint.open_confidence < _UNSURE
    ends = (joint.lower, joint.upper)
    if not whole_object or joint.motion != "hinge" or None in ends:
        return False
    return (
        joint.open_confidence < _NEUTRAL
        and abs(sum(end for end in ends if end is not None)) <= _SYMMETRIC * joint.range
    )


def high_end(part: MovablePart) -> float:
    """The end of a slide at which the part is higher, m at the authored scale."""
    joint = part.joint
    low, high = sorted((joint.closed, joint.open))
    return high if joint.axis[2] > 0.0 else low


def _pose(part: MovablePart, kind: str) -> float:
    joint, mechanism = part.joint, part.mechanism
    rest = high_end(part) if mechanism.spring_rest == "up" else joint.zero
    if kind in ("rest", "pressed"):
        far = joint.closed if abs(joint.closed - rest) > abs(joint.open - rest) else joint.open
        return rest if kind == "rest" else far
    if joint.motion == "slider" and kind in ("up", "down"):
        top = high_end(part)
        return top if kind == "up" else joint.closed + joint.open - top
    if mechanism.role == "control":
        return rest
    return joint.open if kind in ("up", "normal", "off") else joint.closed


def _place(
    info: ObjectInfo, subject: Mention, state: State, scale: float, positions: dict[str, float], notes: list[str]
) -> list[str]:
    """Add the positions asked of the subject's parts; returns the names of their joints."""
    placed: list[str] = []
    chosen = subject.parts if state.share == 0.0 else outermost(info, subject.parts)
    for part in chosen:
        if part.joint.motion == "spin" and part.mechanism.role == "roll":
            continue
        whole_object = subject.words[-1] in _WHOLE
        positions[part.joint.name] = _inside(part, position(part, state, scale, whole_object))
        placed.append(part.joint.name)
        notes.append(f"state: {' and '.join(subject.words)} {state.describe()} → {part.joint.name}")
    return placed


def _inside(part: MovablePart, wanted: float) -> float:
    """The position kept inside the true limits, which prompts round to five digits."""
    joint = part.joint
    margin = LIMIT_ROUNDING * abs(wanted)
    if joint.lower is not None and wanted - joint.lower <= margin:
        wanted = joint.lower + LIMIT_ROUNDING * abs(joint.lower)
    if joint.upper is not None and joint.upper - wanted <= margin:
        wanted = joint.upper - LIMIT_ROUNDING * abs(joint.upper)
    return float(f"{wanted:.6g}")


def _joined(first: Mention, second: Mention) -> Mention:
    """Both mentions as one; of the first, only the parts that open and close."""
    if not second.found:
        return first
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


def _measured(measure: Item, closing: bool) -> State:
    if measure.kind == "share":
        share = min(max(measure.number, 0.0), 1.0)
        return State("open", 1.0 - share if closing else share)
    return State("open", 0.0) if closing and measure.number == 0.0 else State("open", measure=measure)


def _stated(degree: float | str | None, closing: bool) -> State:
    if degree is None:
        return State("open", 0.0 if closing else 1.0)
    if isinstance(degree, str):
        return State("open", slightly=True, closing=closing)
    return State("open", 1.0 - degree if closing else degree)


def _negated(degree: float | str | None, closing: bool) -> State:
    if degree is None or isinstance(degree, str):
        return State("open", slightly=True) if closing else State("open", 0.0)
    return State("open", slightly=True) if closing else State("open", 0.75 if math.isclose(degree, 1.0) else 0.0)
