"""Dynamics of each joint: the defaults of its mechanism, changed by the words of the guidance."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from asset2sim.guidance import tables
from asset2sim.guidance.parts import MovablePart
from asset2sim.guidance.placing import rest_of
from asset2sim.guidance.tables import MotionWord
from schemas.guidance import Guidance
from schemas.mechanism import CAUGHT, STAYS, MechanismName
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
    effort_n: float | None = None
    effort_nm: float | None = None
    stiff: bool = False
    """The effort that moves the part, as the user says: N at its edge, N·m about its hinge, or in words."""
    mechanism: MechanismName | None = None


def with_changes(
    feel: QualitativeDynamics, changes: Mapping[str, str], part: MovablePart, asked_open: bool
) -> QualitativeDynamics:
    """The dynamics after one statement's changes to the part, kind → level or number. ``asked_open`` is whether the
    guidance asks the part to stand open, which it could not if it fell shut."""
    for kind, said in changes.items():
        if kind in MOTIONS or kind == "friction":
            feel = with_damping(feel, kind, said, part)
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
        elif kind == "force":
            feel = replace(feel, effort_n=float(said))
        elif kind == "torque":
            feel = replace(feel, effort_nm=float(said))
        elif kind in CAUGHT and part.mechanism.role == "main":
            feel = replace(feel, mechanism="seal" if kind == "seal" else "latch")
        feel = with_motion_word(feel, kind, said, part, asked_open)
    return feel


def coast_times(part: MovablePart) -> dict[str, float]:
    """A level of damping → the time in which the part loses 63 % of its speed, s; the low ones longer for a part that
    usually coasts, which less damping lets coast further."""
    times = tables.coast_times()
    longer = max(1.0, part.mechanism.coast_s / times["medium"])
    return {level: seconds * (longer if seconds > times["medium"] else 1.0) for level, seconds in times.items()}


def with_damping(feel: QualitativeDynamics, kind: str, level: str, part: MovablePart) -> QualitativeDynamics:
    """The dynamics with another level of damping or friction; a stated level wins over words like "slowly"."""
    times = coast_times(part)
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
    return replace(feel, coast_s=coast_times(part)[feel.level or word], word=word, stiff=stiff)


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


def propose_joints(
    parts: Sequence[MovablePart], guidance: Guidance, positions: Mapping[str, float]
) -> tuple[tuple[JointProposal, ...], tuple[str, ...]]:
    """A proposal per movable joint, and notes on what the guidance changed. ``positions`` are the asked states: a joint
    that is asked to stand somewhere holds there, unless it moves freely, and a spring that is asked for rests where the
    joint is asked to be."""
    by_joint = {part.joint.name: part for part in parts}
    feels = {
        name: QualitativeDynamics(
            part.mechanism.coast_s,
            part.mechanism.spring_hz,
            part.mechanism.kind in STAYS,
            press_n=part.mechanism.press_n,
        )
        for name, part in by_joint.items()
    }
    for name, part in by_joint.items():
        if name in positions and part.mechanism.spring_hz is None and part.mechanism.role in ("main", "cap"):
            feels[name] = replace(feels[name], holds=True)
    for wish in guidance.motions:
        for name in wish.joints:
            joint = by_joint[name].joint
            asked_open = abs(positions.get(name, joint.closed) - joint.closed) > _OPEN * joint.range
            feels[name] = with_changes(feels[name], wish.changes, by_joint[name], asked_open)
    notes = tuple(f"feel: {_levels(wish.changes)} → {_listed(wish.named)}" for wish in guidance.motions)
    return tuple(_proposal(part, feels[name], positions) for name, part in by_joint.items()), notes


def spring_rest(part: MovablePart, positions: Mapping[str, float]) -> float:
    """Where the part's spring returns it to: rad, or m at the authored scale."""
    if part.mechanism.spring_rest in ("up", "zero"):
        return rest_of(part)
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
        effort_n=feel.effort_n,
        effort_nm=feel.effort_nm,
        stiff=feel.stiff,
        mechanism=feel.mechanism,
    )


def _levels(changes: Mapping[str, str]) -> str:
    return ", ".join(f"{level} {kind}".strip() for kind, level in changes.items())


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names) if len(names) <= 4 else f"{names[0]} to {names[-1]} ({len(names)} joints)"
