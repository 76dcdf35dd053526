"""Efforts of mechanisms on joints besides springs: gaskets, rockers, clicks, struts; and where such joints start."""

import math
from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from asset2sim.physics.mass_matrix import Pull
from asset2sim.validation.handling import SAFE_SHARE, Handling
from asset2sim.validation.holding import on_stop
from asset2sim.validation.limits import Range
from asset2sim.validation.positions import Start
from schemas.mechanism import Bias
from schemas.settings import PhysicsSettings
from schemas.vocabulary import DynamicsRule, Source

SNAP_FRICTION = 0.1
"""Dry friction of a part that snaps, as a share of its kind's least effort: between its ends it must not stay."""
OVER_CENTRE = 0.1
"""Most of a door's load once it is open with which gravity may keep it shut for it to fall open: a touch does that."""
GROOVE = 0.25
"""Share of the way from one detent to the next over which it comes to draw with all its force."""
LEAST_CLICK = 1.5
"""Least force of a detent, over the friction beside it: with less, the part stays between two."""
LEAST_CATCH = 0.25
"""Least share of its force that a catch has beside springs that pull its door shut."""
AJAR = 0.02
"""Share of its way from shut from which a lid is held ajar by its spring, to be pressed shut."""
CAUGHT_SHARE, PRESSED_RUB = 0.4, 0.2
"""Force with which a lid that its spring holds ajar is caught there against being opened, and its dry friction, over
what presses back as it is pressed shut: else an arm that is let go of flies open, and swings to and fro."""
FELT_N = 0.5
"""Least weight at the edge of a flap that a hand feels, N (``efforts.csv``): less needs no strut."""
WAY_SAMPLES = 17
"""Positions of its range at which the load of a flap is taken."""


def at_their_ends(
    starts: Mapping[str, Start], handled: Mapping[str, Handling], kept: Collection[str]
) -> dict[str, Start]:
    """Joint → its start, those of bistable mechanisms at the end that is nearer, in doubt the closed one: none of them
    stays between. Those that the user states as a number, or that a search has placed (``kept``), stay."""
    moved = {name for name, start in starts.items() if name not in kept and is_bistable(start.range, handled[name])}
    return {n: at_end(start) if n in moved else start for n, start in starts.items()}


def at_end(start: Start) -> Start:
    """The start moved to its nearer end, by rule where its file has it elsewhere."""
    end = nearer_end(start)
    own = start.source is Source.AUTHORED and end != start.position
    return replace(start, position=end, source=Source.RULE if own else start.source)


def is_bistable(span: Range, kind: Handling) -> bool:
    """Whether a part snaps between the ends of its range."""
    return kind.mechanism == "bistable" and span.lower is not None and span.upper is not None


def nearer_end(start: Start) -> float:
    """The end of its range that is nearer to where a joint with limits starts, rad or m, in doubt the one away from
    open: what is closed may be its middle, as of a lever that is drawn upright."""
    span = start.range
    if span.lower is None or span.upper is None:
        return start.position
    shut, opened = (span.lower, span.upper) if span.open >= span.closed else (span.upper, span.lower)
    return opened if abs(start.position - shut) > 0.501 * span.span else shut


def caught_where_it_drops(kind: Handling, span: Range, pull: Pull, settings: PhysicsSettings) -> Handling:
    """The handling of a door or lid that falls open from where it is shut, and which neither springs nor a mechanism of
    its own keep there, with the catch without which it would not be shut: a glove compartment. As it is where its shut
    end is a guess, and of a carton's flap, which turns further than a leaf opens."""
    way, load = span.open - span.closed, pull.at(np.array([span.closed, span.open]))
    plain = kind.leaf and not kind.counterbalanced and kind.mechanism in ("free", "friction")
    guessed = span.joint.openness_confidence < settings.sure_of_closed
    if span.joint.prismatic or not plain or guessed or abs(way) > math.pi:
        return kind
    falls = load[1] * way > 0.0 and load[0] * way >= -OVER_CENTRE * abs(load[1] * way)
    return replace(kind, mechanism="latch", lets_go_n=0.5 * kind.range.most_n) if falls else kind


def mechanism_bias(
    start: Start, kind: Handling, friction: float, settings: PhysicsSettings, spring: float = 0.0
) -> Bias | None:
    """Effort of a part's mechanism on its joint, beside its dry ``friction`` and that of its ``spring`` where it is
    shut (N·m or N), struts apart; None for most."""
    span = start.range
    if settings.dynamics is DynamicsRule.PAPER:
        return None
    if kind.mechanism == "detent" and kind.click_rad > 0.0 and not span.joint.prismatic:
        return detents(start, kind, friction, settings)
    if is_bistable(span, kind):
        return snap(span, kind)
    return catch(span, kind, friction, settings, spring) if kind.mechanism in ("seal", "latch") else None


LONG_THROW = 0.4
"""Travel, rad, that a step onto a stop is measured against at most: the lever of a wall switch has twice that, and
would go through its stop by more, in one step, than a held joint may move."""


def detents(start: Start, kind: Handling, friction: float, settings: PhysicsSettings) -> Bias | None:
    """Detents of a part that turns, evenly over its range, one of them where it starts: each draws the part from
    halfway to the next, with so much more than its ``friction`` (N·m) that it does not stay between; None where a hand,
    or the object's stand, does not allow so much."""
    bearable = min(kind.most_upward, kind.most_downward) - friction
    force = min(settings.detent_over_friction * friction, bearable)
    if force < LEAST_CLICK * friction or friction == 0.0:
        return None
    turn = 2.0 * math.pi if start.range.lower is None or start.range.upper is None else start.range.span
    period = turn / max(round(turn / kind.click_rad), 1)
    slope = -force / (GROOVE * period)
    return Bias(kind="detent", slope=slope, none_at=start.position, least=-force, most=force, period=period)


def bias_armature(bias: Bias | None, least_inertia: float, travel: float, settings: PhysicsSettings) -> float:
    """The armature (kg·m² or kg) with which a stop holds what a mechanism presses on it, as it does for springs, and
    with which detents, and what is pressed shut, do not shake at the coarse step."""
    if bias is None:
        return 0.0
    if bias.period > 0.0 or bias.kind == "spring return":
        return max(-bias.slope * settings.coarse_timestep_s**2 / settings.max_stiffness_step - least_inertia, 0.0)
    most = max(bias.most, -bias.least)
    way = settings.max_press_step * min(travel, LONG_THROW)
    return max(most * settings.coarse_timestep_s**2 / way - least_inertia, 0.0)


def snap(span: Range, kind: Handling) -> Bias:
    """Effort that presses a rocker to the nearer end: none in the middle, the least effort of its kind at the ends."""
    low, high = span.clamp(-np.inf), span.clamp(np.inf)
    force = min(kind.least_effort, kind.most_upward, kind.most_downward)
    return Bias(kind="bistable", slope=2.0 * force / (high - low), none_at=(low + high) / 2.0, least=-force, most=force)


def catch(span: Range, kind: Handling, friction: float, settings: PhysicsSettings, spring: float = 0.0) -> Bias | None:
    """Effort of a magnetic gasket, or of a latch, on a shut door, over the last millimetres; less on what it would tip
    over, and where the door's ``spring`` pulls it shut there (N·m): they let go together, by as much. None where no
    stop meets the closed part, which it would press on beyond."""
    way = np.sign(span.open - span.closed)
    stop = span.lower if way > 0.0 else span.upper
    if way == 0.0 or stop is None:
        return None
    tips = kind.tips_upward if way > 0.0 else kind.tips_downward
    seal = kind.mechanism == "seal"
    holds_n, travel_m = (
        (settings.seal_n, settings.seal_travel_m) if seal else (settings.latch_n, settings.latch_travel_m)
    )
    force = kind.lever * min(holds_n, kind.lets_go_n or holds_n, settings.press_margin * tips)
    if kind.asked_n is not None and kind.lets_go_n is not None:
        force = max(kind.lever * kind.lets_go_n - friction, LEAST_CATCH * force)
    force = max(force - max(-way * spring, 0.0), LEAST_CATCH * force)
    width = min(travel_m / kind.lever, 0.5 * span.span)
    if abs(span.closed - stop) > width:
        return None
    least, most = (-force, 0.0) if way > 0.0 else (0.0, force)
    return Bias(kind=kind.mechanism, slope=force / width, none_at=span.closed + way * width, least=least, most=most)


def pressed_shut(start: Start, kind: Handling, rest: float, stiffness: float, settings: PhysicsSettings) -> Bias | None:
    """The effort against a hand that presses a lid shut which its spring holds ajar, at ``rest`` (rad), beside that
    spring (N·m/rad): a stapler's arm, which is caught there against being opened to be filled, more lightly. None where
    it rests at an end, or its spring alone presses so."""
    span = start.range
    way, shut = span.open - span.closed, abs(rest - span.closed)
    between = span.lower is not None and AJAR * abs(way) < shut < 0.5 * abs(way)
    if settings.dynamics is DynamicsRule.PAPER or not (kind.leaf and kind.mechanism == "spring return" and between):
        return None
    bearable = kind.most_downward if way > 0.0 else kind.most_upward
    force = min(kind.lever * settings.press_shut_n, bearable) - stiffness * shut
    if stiffness == 0.0 or force <= 0.0:
        return None
    caught = CAUGHT_SHARE * force
    least, most = (-caught, force) if way > 0.0 else (-force, caught)
    return Bias(kind="spring return", slope=-force / shut, none_at=rest, least=least, most=most)


def steady_force(span: Range, force: float) -> Bias:
    """The bias of a spring that exerts the same force (N) all over a slide's range, as a gas spring nearly does."""
    assert span.lower is not None and span.upper is not None, "only slides with limits have springs"
    slope = abs(force) / (span.upper - span.lower)
    none_at = 2.0 * span.lower - span.upper if force > 0.0 else 2.0 * span.upper - span.lower
    return Bias(kind="strut", slope=slope, none_at=none_at, least=min(force, 0.0), most=max(force, 0.0))


def strut(start: Start, pull: Pull, kind: Handling, stays: bool, settings: PhysicsSettings) -> Bias | None:
    """Strut of a flap or lid that gravity shuts and that is too heavy for a hand, somewhere or, where it ``stays`` as
    it starts, with the friction that would hold it there, and of any of furniture's flaps; the spring of a slide whose
    kind has one (a seat, a screen on its stand); None for the rest. Linear over the range: as near as can be to the
    share of its weight that struts carry, and of a part that may fall shut never more."""
    span = start.range
    if span.lower is None or span.open == span.closed:
        return None
    if span.joint.prismatic:
        carried = -settings.strut_share * pull.force
        return steady_force(span, carried) if kind.mechanism == "strut" and abs(carried) > FELT_N else None
    # What friction keeps anywhere needs none, unless springs are its kind's mechanism: a garage door.
    if kind.anywhere and kind.mechanism != "strut":
        return None
    ways = np.linspace(0.0, 1.0, WAY_SAMPLES)
    lifts = np.sign(span.open - span.closed)
    shuts = -lifts * pull.at(span.closed + ways * (span.open - span.closed))
    held = -lifts * float(pull.at(start.position)) if stays and not on_stop(start, -lifts) else 0.0
    heaviest = max(float(shuts.max()), (1.0 + settings.least_hold_margin) * held)
    # A light flap of furniture has stays all the same, or it would fall shut.
    lifted_n = FELT_N if kind.counterbalanced else SAFE_SHARE * kind.range.most_n
    if heaviest <= lifted_n * kind.lever:
        return None
    under = shuts > 0.0
    if np.count_nonzero(under) < 2:
        return None
    rise, first = np.polyfit(ways[under], settings.strut_share * shuts[under], 1)
    if not stays:
        first -= max(float((first + rise * ways[under] - settings.counterbalance_share * shuts[under]).max()), 0.0)
    if rise == 0.0:
        return None
    most = max(first, first + rise, 0.0)
    least, most = (0.0, most) if lifts > 0.0 else (-most, 0.0)
    slope = float(rise / abs(span.open - span.closed))
    none_at = span.closed - float(first / rise) * (span.open - span.closed)
    return Bias(kind="strut", slope=slope, none_at=none_at, least=least, most=most)
