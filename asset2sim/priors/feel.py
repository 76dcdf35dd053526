"""What is known of one joint's feel, and how the words of the guidance change it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from asset2sim.priors import tables
from asset2sim.priors.parts import Part
from asset2sim.priors.tables import Wish
from schemas.overlay import Level

SPRING_HZ = {"hinge": 3.0, "slider": 6.0, "spin": 3.0}
"""Frequency of a spring that the mechanism table does not expect, Hz: a stapler's or a clip's."""
STIFF, SOFT = 1.5, 0.7
"""What "stiff" and "light" do to a spring's frequency: about twice and half the force."""
HOLD_COAST_S = 0.2
"""Longest coast of a joint that must stay where it is placed, unless its damping is stated (paper: more damping)."""
UPRIGHT = 0.9
"""Height of a hinge's unit axis from which gravity hardly turns what hangs on it ..."""
LEVEL = 0.3
"""... and of a slider's below which gravity hardly moves it."""
MOTIONS: dict[str, Level] = {
    "damping": "medium", "free": "super low", "no hold": "super low", "slow": "super high", "smooth": "low",
    "soft close": "super high", "no slam": "super high", "slam": "super low", "glide": "low",
}  # fmt: skip
"""Words about motion, and the level of damping that they stand for."""
FALLS = ("soft close", "no slam", "slam")
"""Words that say how a part shuts by itself: it does not stay where it is placed, unless a state is asked for."""
LEVELS: dict[str, Level] = {level: level for level in ("super low", "low", "medium", "high", "super high")}


@dataclass(frozen=True)
class Feel:
    """What is known of one joint's feel; ``level`` is the stated damping, None where the mechanism's stands, and
    ``word`` what a word about motion implies. The wishes are the overlay's, metres at the final scale."""

    coast_s: float
    spring_hz: float | None
    holds: bool
    level: Level | None = None
    word: Level | None = None
    closes_s: float | None = None
    stops_within: float | None = None
    returns_s: float | None = None


def felt(feel: Feel, changes: Mapping[str, str], part: Part, asked_open: bool) -> Feel:
    """The feel after what one segment says of the part, as kind → level or number.

    ``asked_open`` is whether the guidance asks the part to stand open, which it could not if it fell shut.
    """
    for kind, said in changes.items():
        if kind in MOTIONS or kind == "friction":
            feel = damped(feel, kind, said)
        elif kind == "hold":
            coast = feel.coast_s if feel.level else min(feel.coast_s, HOLD_COAST_S)
            feel = replace(feel, coast_s=coast, holds=True, spring_hz=None, closes_s=None, returns_s=None)
        elif kind in ("spring", "snap", "slow return", "returns"):
            feel = replace(feel, spring_hz=feel.spring_hz or SPRING_HZ[part.joint.motion])
        elif kind == "no spring":
            feel = replace(feel, spring_hz=None, returns_s=None)
        elif kind in ("stiff", "soft", "light"):
            feel = firmness(feel, kind == "stiff", part)
        feel = wished(feel, kind, said, part, asked_open)
    return feel


def damped(feel: Feel, kind: str, level: str) -> Feel:
    """A stated level counts for what follows; words like "slowly" give way to a level that is stated."""
    times = tables.coast_times()
    if kind in ("damping", "friction"):
        stated = replace(feel, coast_s=times[level], level=LEVELS[level], stops_within=None)
        return stated if kind == "damping" else replace(stated, holds=level in ("medium", "high", "super high"))
    slowed = replace(feel, coast_s=times[feel.level or MOTIONS[kind]], word=MOTIONS[kind])
    return replace(slowed, holds=False) if kind in ("free", "no hold") else slowed


def firmness(feel: Feel, stiff: bool, part: Part) -> Feel:
    """A stiff or soft spring; where there is none, more or less damping."""
    if feel.spring_hz is not None:
        usual = part.mechanism.spring_hz or SPRING_HZ[part.joint.motion]
        return replace(feel, spring_hz=round(usual * (STIFF if stiff else SOFT), 3))
    word: Level = "high" if stiff else "low"
    return replace(feel, coast_s=tables.coast_times()[feel.level or word], word=word)


def wished(feel: Feel, kind: str, said: str, part: Part, asked_open: bool) -> Feel:
    """The feel with the time or distance that a word stands for, or that the guidance states (``said``)."""
    wish = tables.wishes().get("soft close" if kind == "no slam" else kind, NO_WISH)
    if kind in ("closes", *FALLS) or wish.closes_s is not None:
        if not gravity_moves(part):
            return feel
        seconds = float(said) if kind == "closes" else wish.closes_s
        falls = kind in ("closes", *FALLS) and not asked_open
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


NO_WISH = Wish(None, None, None, None)


def gravity_moves(part: Part) -> bool:
    """Whether gravity can move a part: a hinge that is not upright, a slider that is not level."""
    height = abs(part.joint.axis[2])
    return height > LEVEL if part.joint.motion == "slider" else height < UPRIGHT
