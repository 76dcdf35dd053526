"""Dynamics of each joint: the defaults of its mechanism, changed by the words of the guidance."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from asset2sim.guidance import tables
from asset2sim.guidance.clauses import NO_MENTION, mention
from asset2sim.guidance.lexicon import Item, Segment
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.guidance.parts import MovablePart, main_parts
from asset2sim.guidance.states import high_end
from asset2sim.guidance.tables import MotionWord
from schemas.overlay import JointProposal, Level

SPRING_HZ = {"hinge": 3.0, "slider": 6.0, "spin": 3.0}
"""Frequency of a spring that the mechanism table does not expect, Hz: a stapler's or a clip's."""

STIFF, SOFT = 1.5, 0.7
"""What "stiff" and "light" do to a spring's frequency: about twice and half the force."""
STIFF_PRESS, SOFT_PRESS = 1.5, 0.7
"""What they do to the forces that a finger feels: a key of 0.65 N becomes one of 1.0 or 0.45 N, within the 0.25 to
1.5 N that keyboard standards allow."""
HOLD_COAST_S = 0.2
"""Longest coast of a joint that must stay where it is placed, unless its damping is stated (paper: more damping)."""
UPRIGHT = 0.9
"""Vertical component of a hinge's unit axis from which gravity hardly turns its part ..."""
LEVEL = 0.3
"""... and of a slider's below which gravity hardly moves it."""
MOTIONS: dict[str, Level] = {
    "damping": "medium", "free": "super low", "no hold": "super low", "slow": "super high", "smooth": "low",
    "soft close": "super high", "no slam": "super high", "slam": "super low", "glide": "low",
}  # fmt: skip
"""Words about motion, and the level of damping that they stand for."""
SELF_CLOSING_WORDS = ("soft close", "no slam", "slam")
"""Words that say how a part shuts by itself: it does not stay where it is placed, unless a state is asked for."""
LEVELS: dict[str, Level] = {level: level for level in ("super low", "low", "medium", "high", "super high")}


@dataclass(frozen=True)
class QualitativeDynamics:
    """Qualitative dynamics of one joint. ``level`` is the stated damping, None for the mechanism's; ``word`` is the
    level that a word about motion implies. Times and distances are as in the overlay, metres at the final scale."""

    coast_s: float
    spring_hz: float | None
    holds: bool
    level: Level | None = None
    word: Level | None = None
    closes_s: float | None = None
    stops_within: float | None = None
    returns_s: float | None = None
    press_n: tuple[float, float] | None = None
    """With what its spring resists at the start and at the end, N."""


def with_segment_changes(
    feel: QualitativeDynamics, changes: Mapping[str, str], part: MovablePart, asked_open: bool
) -> QualitativeDynamics:
    """The dynamics after one segment's changes to the part, kind → level or number. ``asked_open`` is whether the
    guidance asks the part to stand open, which it could not if it fell shut."""
    for kind, said in changes.items():
        if kind in MOTIONS or kind == "friction":
            feel = with_damping(feel, kind, said)
        elif kind == "hold":
            coast = feel.coast_s if feel.level else min(feel.coast_s, HOLD_COAST_S)
            feel = replace(feel, coast_s=coast, holds=True, closes_s=None)
            feel = replace(feel, spring_hz=None, press_n=None, returns_s=None)
        elif kind in ("spring", "snap", "slow return", "returns"):
            feel = replace(feel, spring_hz=feel.spring_hz or SPRING_HZ[part.joint.motion])
        elif kind == "no spring":
            feel = replace(feel, spring_hz=None, press_n=None, returns_s=None)
        elif kind in ("stiff", "soft", "light"):
            feel = firmness(feel, kind == "stiff", part)
        feel = with_motion_word(feel, kind, said, part, asked_open)
    return feel


def with_damping(feel: QualitativeDynamics, kind: str, level: str) -> QualitativeDynamics:
    """The dynamics with another level of damping or friction; a stated level wins over words like "slowly"."""
    times = tables.coast_times()
    if kind in ("damping", "friction"):
        stated = replace(feel, coast_s=times[level], level=LEVELS[level], stops_within=None)
        return stated if kind == "damping" else replace(stated, holds=level in ("medium", "high", "super high"))
    slowed = replace(feel, coast_s=times[feel.level or MOTIONS[kind]], word=MOTIONS[kind])
    return replace(slowed, holds=False) if kind in ("free", "no hold") else slowed


def firmness(feel: QualitativeDynamics, stiff: bool, part: MovablePart) -> QualitativeDynamics:
    """A stiff or soft spring; where there is none, more or less damping."""
    if feel.spring_hz is not None:
        usual = part.mechanism.spring_hz or SPRING_HZ[part.joint.motion]
        press, factor = part.mechanism.press_n, STIFF_PRESS if stiff else SOFT_PRESS
        if press is not None:
            press = round(press[0] * factor, 3), round(press[1] * factor, 3)
        return replace(feel, spring_hz=round(usual * (STIFF if stiff else SOFT), 3), press_n=press)
    word: Level = "high" if stiff else "low"
    return replace(feel, coast_s=tables.coast_times()[feel.level or word], word=word)


def with_motion_word(
    feel: QualitativeDynamics, kind: str, said: str, part: MovablePart, asked_open: bool
) -> QualitativeDynamics:
    """The dynamics with the time or distance that a word stands for, or that the guidance states (``said``)."""
    wish = tables.wishes().get("soft close" if kind == "no slam" else kind, NO_MOTION_WORD)
    if kind in ("closes", *SELF_CLOSING_WORDS) or wish.closes_s is not None:
        if not gravity_moves(part):
            return feel
        seconds = float(said) if kind == "closes" else wish.closes_s
        falls = kind in ("closes", *SELF_CLOSING_WORDS) and not asked_open
        return replace(feel, closes_s=seconds, holds=feel.holds and not falls)
    if kind in ("stops", "turns"):
        fits = (kind == "stops") == (part.joint.motion == "slider")
        return replace(feel, stops_within=float(said)) if fits else feel
    if kind == "returns":
        return replace(feel, returns_s=float(said))
    if wish.returns_s is not None:
        return replace(feel, returns_s=wish.returns_s)
    distance = wish.stops_m if part.joint.motion == "slider" else wish.stops_rad
    if distance is not None and feel.level is None and feel.spring_hz is None:
        return replace(feel, stops_within=distance)
    return feel


NO_MOTION_WORD = MotionWord(None, None, None, None)


def gravity_moves(part: MovablePart) -> bool:
    """Whether gravity can move a part: a hinge that is not upright, a slider that is not level."""
    height = abs(part.joint.axis[2])
    return height > LEVEL if part.joint.motion == "slider" else height < UPRIGHT


_OPEN = 0.05
"""Share of a joint's range from which a requested position counts as open."""

_NEAR, _FAR = 3, 6
"""Words between a level and its noun: "low hinge damping", "the damping of the hinge is low"."""
_KINDS = (
    "damping", "damped", "friction", "free", "slow", "smooth", "hold", "spring", "stiff", "soft", "light",
    "soft close", "slam", "glide", "snap", "slow return", "closing", "returning", "stops", "turns",
)  # fmt: skip
_TURNING = frozenset(
    ("turn", "turns", "turning", "spin", "spins", "spinning", "rotate", "rotates", "swivel", "swivels")
)
"""Words after which a statement is about what turns."""
_SHUTTING = ("closing", "soft close", "slam")
_RETURNING = ("returning", "spring", "snap", "slow return")
"""Kinds of words beside which a time says how long the part takes to shut, or to come back."""


def propose_joints(
    info: ObjectInfo, parts: Sequence[MovablePart], statements: Sequence[Segment], positions: Mapping[str, float]
) -> tuple[tuple[JointProposal, ...], tuple[str, ...]]:
    """A proposal per movable joint, and notes on what the guidance changed. ``positions`` are the asked states: a joint
    that is asked to stand somewhere holds there, unless it moves freely, and a spring that is asked for rests where the
    joint is asked to be."""
    feels = {
        part.joint.name: QualitativeDynamics(
            part.mechanism.coast_s, part.mechanism.spring_hz, part.mechanism.holds, press_n=part.mechanism.press_n
        )
        for part in parts
    }
    notes: list[str] = []
    for part in parts:
        name = part.joint.name
        if name in positions and part.mechanism.spring_hz is None and part.mechanism.role in ("main", "cap"):
            feels[name] = replace(feels[name], holds=True)
    for subject, segment in _clauses(info, parts, statements):
        changes = _changes(segment)
        for part in _affected_parts(subject, changes, segment):
            position = positions.get(part.joint.name, part.joint.closed)
            asked_open = abs(position - part.joint.closed) > _OPEN * part.joint.range
            feels[part.joint.name] = with_segment_changes(feels[part.joint.name], changes, part, asked_open)
        if subject and changes:
            notes.append(f"feel: {_said(changes)} → {_listed(subject)}")
    return (tuple(_proposal(part, feels[part.joint.name], positions) for part in parts), tuple(notes))


def _clauses(
    info: ObjectInfo, parts: Sequence[MovablePart], statements: Sequence[Segment]
) -> Iterator[tuple[tuple[MovablePart, ...], Segment]]:
    """Segments about dynamics, each with the parts it names, else the next noun's, the last named or the main ones."""
    last = NO_MENTION
    for before, segment, after in zip((None, *statements), statements, (*statements[1:], None), strict=False):
        if before is not None and before.sentence != segment.sentence:
            last = NO_MENTION
        here = mention(info, parts, segment, last)
        last = here if here.found else last
        if not segment.of(*_KINDS):
            continue
        if not here.found and after is not None and after.sentence == segment.sentence and _adjective(segment, after):
            yield mention(info, parts, after, last).parts, segment
        else:
            yield here.parts if here.found else last.parts or main_parts(parts), segment


def spring_rest(part: MovablePart, positions: Mapping[str, float]) -> float:
    """Where the part's spring returns it to: rad, or m at the authored scale."""
    if part.mechanism.spring_rest == "up":
        return high_end(part)
    if part.mechanism.spring_rest == "zero":
        return part.joint.zero
    return positions.get(part.joint.name, part.joint.closed)


def _proposal(part: MovablePart, feel: QualitativeDynamics, positions: Mapping[str, float]) -> JointProposal:
    sprung = feel.spring_hz is not None
    start, end = feel.press_n or (None, None)
    return JointProposal(
        name=part.joint.name,
        coast_s=feel.coast_s,
        spring_hz=feel.spring_hz,
        spring_rest=spring_rest(part, positions) if sprung else None,
        holds=feel.holds and not sprung,
        closes_s=feel.closes_s if not feel.holds and not sprung else None,
        stops_within=None if sprung else feel.stops_within,
        press_start=start,
        press_end=end,
        returns_s=feel.returns_s if sprung else None,
        damping_level=feel.level or feel.word,
    )


def _affected_parts(
    subject: Sequence[MovablePart], changes: Mapping[str, str], segment: Segment
) -> tuple[MovablePart, ...]:
    """The parts that the changes apply to: a spring goes to parts that are pushed, not to those that only spin, and
    words about turning ("the seat turns freely") not to those that slide: a seat's gas spring."""
    turned = tuple(part for part in subject if part.joint.motion != "slider")
    if _TURNING & set(segment.tokens) and turned:
        return turned
    pushed = tuple(part for part in subject if part.joint.motion != "spin")
    return pushed if "spring" in changes and pushed else tuple(subject)


def _said(changes: Mapping[str, str]) -> str:
    return ", ".join(f"{level} {kind}".strip() for kind, level in changes.items())


def _listed(subject: Sequence[MovablePart]) -> str:
    names = [part.joint.name for part in subject]
    return ", ".join(names) if len(names) <= 4 else f"{names[0]} to {names[-1]} ({len(names)} joints)"


def _changes(segment: Segment) -> dict[str, str]:
    """The changes that a segment asks for: kind → level or ""."""
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
    """The time that a segment states for closing or returning, s, and the stopping distance, m or rad, as text."""
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
