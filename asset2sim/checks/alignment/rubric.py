"""Scores of an asset's scale and joint state, each one half of the alignment, and every threshold of the rubric."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from asset2sim.checks.alignment.user_request import Request, SizeCriterion, StateCriterion
from schemas.alignment import Reference, Score
from schemas.base import Fraction, Frozen, Positive, Vector3
from schemas.features import Features, JointFeatures


class Rubric(Frozen):
    """Bounds of what is met, and of what is near. Sizes are compared by their ratio, states by the share of a joint's
    range. Chosen before any methods were compared, by what a person tells apart by eye; ``slightly_share`` was widened
    once, after seeing what experts call slightly open, and narrowed again to what the words say."""

    stated_ratio: Positive = 1.1
    """Ratio of sizes up to which a size that the user states in numbers is met: a tenth more or less."""
    expert_ratio: Positive = 1.5
    """Ratio up to which an expert's scale is met: the paper's own method is off it by 33 % on average and aligned."""
    none_ratio: Positive = 3.0
    """Ratio at which nothing is left of the credit for size: three times too large is another object. Between what
    is met and this the credit falls with the logarithm of the ratio."""
    section_m: tuple[Positive, Positive] = (0.03, 0.075)
    """Second longest edge of an object for the tabletop, m: the paper's cross-sections from 0.03, and two dimensions
    up to 0.075. The shortest edge has no lower bound: a laptop is flat."""
    length_m: tuple[Positive, Positive] = (0.10, 0.20)
    """Its longest edge, m (paper, section on synthesis)."""
    closed_share: Fraction = 0.05
    """Share of its range that a part which must be closed may be open."""
    slightly_share: tuple[Fraction, Fraction] = (0.03, 0.30)
    """Share of the range in use that a part is open which must be slightly open: visibly, and about a quarter at most,
    as readers of such words expect."""
    open_share: Fraction = 0.85
    """Shares of its range from which a part is fully open, and open in use; up to ``near_share`` past its open end."""
    near_share: Fraction = 0.10
    """How far a part may be from a stated share, angle or pose, as a share of its range."""
    none_share: Fraction = 0.35
    """How far beyond what is met, as a share of its range, nothing is left of the credit for a part's state, which
    falls linearly until there. Where a part must be open at all, nothing is left at its closed end."""
    resting_share: Fraction = 0.05
    """How far from closed or its authored zero a part without a requested position may be, as a share of its range."""


RUBRIC = Rubric()


@dataclass(frozen=True)
class ShareBand:
    """The shares of a joint's range, closed 0 to open 1, that meet a request; ``ajar`` if it may not be closed."""

    low: float
    high: float
    ajar: bool


def score_state(positions: Mapping[str, float], scale: float, features: Features, request: Request) -> Score:
    """The credit for joint positions (rad or m at the final scale, from the authored zero): the mean over the joints of
    which a state is asked, and the parts that it does not have, which earn nothing. Where none is asked, the mean over
    the joints of all parts that open and close: each may be at its closed end or its authored zero."""
    joints = {joint.name: joint for joint in features.movable_joints}
    asked = [item for item in request.states if item.joint in joints and _range(joints[item.joint]) > 0.0]
    if not asked and not request.lacking:
        return _resting(positions, scale, joints, request)
    earned = [(0.0, wish) for wish in request.lacking]
    for item in asked:
        joint = joints[item.joint]
        wish = f"{item.part} {item.state.describe()}"
        if item.joint not in positions:
            earned.append((0.0, f"{wish}: joint '{item.joint}' has no position"))
            continue
        share = _share(joint, positions[item.joint], scale)
        credit = _credit(share, accepted_shares(item, joint), RUBRIC.none_share)
        earned.append((credit, f"{wish}: joint '{item.joint}' is {100.0 * share:.0f} % open"))
    worst = min(earned, key=lambda pair: pair[0])[1]
    value = math.fsum(credit for credit, _ in earned) / len(earned)
    met = sum(credit == 1.0 for credit, _ in earned)
    counted = f"{met} of {len(earned)} asked states met; " if len(earned) > 1 else ""
    return Score(value=min(1.0, value), reason=f"{counted}{'worst: ' if met < len(earned) else ''}{worst}")


def accepted_shares(asked: StateCriterion, joint: JointFeatures) -> ShareBand:
    """The shares of a joint's range that meet an asked state."""
    state = asked.state
    if state.kind == "open" and state.measure is None:
        if state.slightly:
            used = asked.usual_range / _range(joint)
            low, high = (used * share for share in RUBRIC.slightly_share)
            return ShareBand(1.0 - high, 1.0 - low, True) if state.closing else ShareBand(low, high, True)
        if state.share == 0.0:
            # Which end of a turning cap is closed may be unknown: the asked position is then its authored zero.
            closed = max(0.0, _share(joint, asked.position, 1.0))
            return ShareBand(min(0.0, closed - RUBRIC.closed_share), closed + RUBRIC.closed_share, False)
        if state.share == 1.0:
            return ShareBand(RUBRIC.open_share, 1.0 + RUBRIC.near_share, True)
        if state.in_use:
            in_use = asked.usual_range / _range(joint)
            return ShareBand(RUBRIC.open_share * in_use, 1.0 + RUBRIC.near_share, True)
    share = _share(joint, asked.position, 1.0)
    return ShareBand(share - RUBRIC.near_share, share + RUBRIC.near_share, share > RUBRIC.near_share)


def _credit(share: float, wish: ShareBand, none_share: float) -> float:
    """1 within the band, and linearly less outside it."""
    if share > wish.high:
        return max(0.0, 1.0 - (share - wish.high) / none_share)
    if share < wish.low:
        way = min(none_share, wish.low) if wish.ajar else none_share
        return max(0.0, 1.0 - (wish.low - share) / way)
    return 1.0


def _resting(
    positions: Mapping[str, float], scale: float, joints: Mapping[str, JointFeatures], request: Request
) -> Score:
    free = [joints[name] for name in request.opening if name in joints and name in positions]
    # What a spring of its file moves rests where that leaves it.
    free = [joint for joint in free if _range(joint) > 0.0 and not joint.stiffness]
    earned = {joint.name: _rest_credit(joint, positions[joint.name], scale) for joint in free}
    away = [name for name, credit in earned.items() if credit < 1.0]
    if not away:
        return Score(value=1.0, reason="no state is asked, and all that opens is closed or at its authored zero")
    value = math.fsum(earned.values()) / len(earned)
    worst = min(earned, key=lambda name: earned[name])
    of_all = f"{len(away)} of {len(earned)} parts are neither closed nor at their authored zero, '{worst}' most"
    return Score(value=min(1.0, value), reason=f"no state is asked; {of_all}")


def _rest_credit(joint: JointFeatures, position: float, scale: float) -> float:
    share = _share(joint, position, scale)
    zero = min(max(0.0, joint.lower or 0.0), joint.upper or 0.0) if joint.lower is not None else 0.0
    off = min(abs(share), abs(share - _share(joint, zero, 1.0)))
    return _credit(off, ShareBand(0.0, RUBRIC.resting_share, False), RUBRIC.none_share)


def _range(joint: JointFeatures) -> float:
    """|open − closed|, rad or m at the authored scale; 0 for joints without ends."""
    return abs((joint.open or 0.0) - (joint.closed or 0.0))


def _share(joint: JointFeatures, position: float, scale: float) -> float:
    """How far open a joint is, closed 0 to open 1; whole turns are taken out of a hinge's angle."""
    closed, opened = joint.closed or 0.0, joint.open or 0.0
    authored = position / scale if joint.prismatic else position
    if not joint.prismatic:
        middle = (closed + opened) / 2.0
        authored = middle + math.remainder(authored - middle, 2.0 * math.pi)
    return (authored - closed) / (opened - closed)


def score_scale(scale: float, rest_size: Vector3, asked: SizeCriterion, reference: Reference | None) -> Score:
    """The credit for a uniform scale. ``rest_size`` holds the edges of the object's box at scale 1, m.

    Held against the size that the user states in numbers. Where there is none, the best credit counts of the scale that
    an expert states for the object; the household size of such an object times the word's factor; and, where no real
    size is asked for, the paper's size for handling on a table.
    """
    if asked.scale is not None:
        ratio = max(scale / asked.scale, asked.scale / scale)
        return _ratio_score(ratio, RUBRIC.stated_ratio, f"the size that the user states (scale {asked.scale:.3g})")
    found: list[Score] = []
    if reference is not None and reference.states_scale:
        ratio = max(scale / reference.scale, reference.scale / scale)
        found.append(_ratio_score(ratio, RUBRIC.expert_ratio, f"the expert's scale {reference.scale:.3g}"))
    size = scale * asked.dimension
    low, high = asked.household
    household = max(low / size, size / high) if size > 0.0 else 1.0
    word = f"a {asked.word} {asked.category}" if asked.word else f"a household {asked.category}"
    found.append(_ratio_score(household, 1.0, f"{word} ({low:.3g} to {high:.3g} m), at {size:.3g} m"))
    if asked.tabletop:
        edges = sorted(scale * edge for edge in rest_size)
        tabletop = _tabletop_ratio(edges[1], edges[2])
        at = f"the paper's tabletop size, at {edges[2]:.3g} m by {edges[1]:.3g} m"
        found.append(_ratio_score(tabletop, 1.0, at))
    return max(found, key=lambda item: item.value)


def _tabletop_ratio(section: float, length: float) -> float:
    """Ratio by which an object breaks the paper's tabletop rule, the largest over its bounds; 1 if it breaks none."""
    bounds = ((section, RUBRIC.section_m), (length, RUBRIC.length_m))
    return max(1.0, *(max(low / max(edge, 1e-9), edge / high) for edge, (low, high) in bounds))


def _ratio_score(ratio: float, met: float, what: str) -> Score:
    if ratio <= met:
        return Score(value=1.0, reason=f"the scale meets {what}")
    left = math.log(RUBRIC.none_ratio / ratio) / math.log(RUBRIC.none_ratio / met)
    return Score(value=max(0.0, left), reason=f"the scale is {ratio:.3g} times off {what}")
