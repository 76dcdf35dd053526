"""The joint positions that states stand for. Closed to open is 0 to 1, whatever the sign of the range."""

import math
from collections.abc import Sequence

from asset2sim.guidance.parts import MovablePart, drawn_pressed
from schemas.guidance import AskedOpening, AskedState, Guidance, State

_UNSURE = 0.05
"""Confidence below which the two ends of a turning cap look alike: closed is then the authored zero."""
_NEUTRAL = 0.2
"""The same of a part that turns as far either way from its authored zero: a tap's lever, a knob, a crank."""
_SYMMETRIC = 0.02
"""Difference of the two ways, as a share of the range, up to which they count as the same."""
_BAIL_RAD = 1.02 * math.pi
"""Travel, rad, more than half a turn, from which a handle swings from rim to rim and is upright in the middle."""
DRAWN_IN_USE = ("leg", "seat")
"""Parts of folding chairs, which are drawn unfolded: their other end is folded, whichever looks closed."""
AT_AN_END = 0.2
"""Share of its range by which a part is drawn off an end that it is drawn at."""
MIDWAY = 0.1
"""Share of its range by which a part is drawn off its ends that is drawn on its way."""
LIMIT_ROUNDING = 5e-5
"""Half a unit of the fifth digit, relative."""
_SLIGHTLY = 0.2
"""Share of its useful travel that a part is open which is slightly open: visibly, and the upper end of the 10 to 20 %
that the paper's prompt states, at which parts that overlap near their closed end (a stapler's magazine) are clear."""


def asked_positions(parts: Sequence[MovablePart], guidance: Guidance, scale: float) -> dict[str, float]:
    """Joint → the position asked of it: rad, or m at the authored scale; ``scale`` is final, by which metres divide."""
    by_joint = {part.joint.name: part for part in parts}
    return {name: asked_position(by_joint[name], wish, scale) for name, wish in guidance.of_joints.items()}


def asked_position(part: MovablePart, wish: AskedState, scale: float) -> float:
    """The position that is asked of a part's joint, inside its limits: rad, or m at the authored scale."""
    return _inside(part, position_in_state(part, wish.state, scale, wish.of_all))


def position_in_state(part: MovablePart, state: State, scale: float, whole_object: bool = False) -> float:
    """Joint position of a part in a state, its own or that of the ``whole_object``: rad, or m at the authored scale."""
    joint = part.joint
    if state.measure is not None and (joint.motion == "spin" or joint.range > 0.0):
        return opened_by_measure(part, state.measure, scale)
    if joint.motion == "spin" or joint.range == 0.0:
        return joint.zero
    unfolds = part.name in DRAWN_IN_USE and part.mechanism.role == "control"
    if unfolds and (state.in_use or state.share in (0.0, 1.0)):
        drawn, folded = sorted((joint.closed, joint.open), key=lambda end: abs(end - joint.zero))
        if abs(drawn - joint.zero) <= AT_AN_END * joint.range:
            return folded if state.share == 0.0 else joint.zero
    if state.kind == "open":
        used = useful_travel(part)
        if state.slightly:
            return joint.opened_by((1.0 - _SLIGHTLY if state.closing else _SLIGHTLY) * used)
        if state.share == 0.0 and ends_look_alike(part, whole_object):
            return joint.zero
        if state.in_use:
            # Of what no table knows nothing is known of its use either: open is then the end of its travel.
            return joint.opened_by(used if part.name else joint.range)
        return joint.opened_by(joint.range if state.share == 1.0 else (state.share or 0.0) * used)
    return _pose(part, state.kind)


def opened_by_measure(part: MovablePart, measure: AskedOpening, scale: float) -> float:
    """Joint position of a part opened by an angle or a length: from where it is closed. An angle of what is set, of
    what turns without end, and of what nothing names and is drawn on its way counts from there, to its further end."""
    joint = part.joint
    slides, long = joint.motion == "slider", measure.kind == "length"
    if long and not slides:
        return joint.opened_by(0.5 * joint.range)
    amount = measure.amount / (scale if slides else 1.0)
    if joint.motion == "spin":
        return joint.zero + amount
    ways = sorted((end - joint.zero for end in (joint.closed, joint.open)), key=abs)
    is_set = part.mechanism.role == "control" or (not part.name and abs(ways[0]) > MIDWAY * joint.range)
    return joint.opened_by(amount) if slides or not is_set else joint.zero + math.copysign(amount, ways[1])


def useful_travel(part: MovablePart) -> float:
    """How far a part is opened in use, rad or m at the authored scale, by which "half open" counts: a refrigerator's
    door that turns by 180° stands open at what doors are used at, and half open at half of it. Fully open is the end
    of its range."""
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


def rest_of(part: MovablePart) -> float:
    """Where a part's own spring holds it, rad, or m at the authored scale: up where its kind rests so, else as drawn;
    a button that is drawn part of the way in where it stands out."""
    joint = part.joint
    if part.mechanism.spring_rest == "up":
        return high_end(part)
    return joint.closed if drawn_pressed(part.name, joint.motion, joint.lower, joint.upper) else joint.zero


def _pose(part: MovablePart, kind: str) -> float:
    joint, mechanism = part.joint, part.mechanism
    rest = rest_of(part)
    if kind in ("rest", "pressed"):
        far = joint.closed if abs(joint.closed - rest) > abs(joint.open - rest) else joint.open
        return rest if kind == "rest" else far
    if joint.motion == "slider" and kind in ("up", "down"):
        top = high_end(part)
        return top if kind == "up" else joint.closed + joint.open - top
    if mechanism.role == "control":
        return rest
    if kind == "up" and part.name == "handle" and joint.motion == "hinge" and joint.range > _BAIL_RAD:
        return joint.opened_by(0.5 * joint.range)
    return joint.open if kind in ("up", "normal", "off") else joint.closed


def _inside(part: MovablePart, wanted: float) -> float:
    """The position kept inside the true limits, which prompts round to five digits."""
    joint = part.joint
    margin = LIMIT_ROUNDING * abs(wanted)
    if joint.lower is not None and wanted - joint.lower <= margin:
        wanted = joint.lower + LIMIT_ROUNDING * abs(joint.lower)
    if joint.upper is not None and joint.upper - wanted <= margin:
        wanted = joint.upper - LIMIT_ROUNDING * abs(joint.upper)
    return float(f"{wanted:.6g}")
