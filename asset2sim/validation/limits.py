"""Joint limits at the final scale: mended where they are inverted, moved by whole turns where zero lies outside."""

import math
from dataclasses import dataclass

from schemas.features import JointFeatures
from schemas.finding import Notes
from schemas.vocabulary import Source

TURN_SLACK = 0.01
"""Rounding slack, rad, by which limits moved by whole turns may miss zero: -6.28 is short of a turn by 0.003."""
LOCKED = 1e-9
"""Range below which a joint cannot move, rad or m: MuJoCo would read equal limits as no limits at all."""


@dataclass(frozen=True)
class Range:
    """One movable joint's range and ends at the final scale, rad or m; a continuous one has no lower and upper."""

    joint: JointFeatures
    lower: float | None
    upper: float | None
    closed: float
    open: float
    source: Source

    def clamp(self, position: float) -> float:
        """The nearest position within the limits."""
        if self.lower is None or self.upper is None:
            return position
        return min(max(position, self.lower), self.upper)

    @property
    def span(self) -> float:
        """The length of the range; a full turn for continuous joints."""
        return 2.0 * math.pi if self.lower is None or self.upper is None else self.upper - self.lower


def joint_range(joint: JointFeatures, scale: float, notes: Notes) -> Range | None:
    """The range of one joint, or None for joints that cannot move."""
    if not joint.movable:
        return None
    where, factor = f"joint '{joint.name}'", scale if joint.prismatic else 1.0
    closed, opened = (joint.closed or 0.0) * factor, (joint.open or 0.0) * factor
    if joint.lower is None or joint.upper is None:
        return Range(joint, None, None, closed, opened, Source.AUTHORED)
    lower, upper, source = joint.lower * factor, joint.upper * factor, Source.AUTHORED
    if lower > upper:
        message = f"{where}: lower limit {lower:.4g} exceeds upper {upper:.4g}; swapped: mend the URDF if that is wrong"
        notes.warn("limits_inverted", message, joint=joint.name, value=lower, limit=upper)
        lower, upper, source = upper, lower, Source.RULE
    if upper - lower < LOCKED:
        message = f"{where}: its limits leave no range, so it is written as fixed"
        notes.warn("joint_locked", message, joint=joint.name, value=upper - lower)
        return None
    turn = 2.0 * math.pi
    shift = 0.0 if joint.prismatic else -turn * round((lower + upper) / 2.0 / turn)
    if not lower <= 0.0 <= upper and shift != 0.0 and lower + shift <= TURN_SLACK and upper + shift >= -TURN_SLACK:
        message = (
            f"{where}: limits {lower:.4g} to {upper:.4g} rad moved by whole turns so that an engine's zero is inside"
        )
        notes.info("limits_turned", message, joint=joint.name, value=shift)
        lower, upper, source = min(lower + shift, 0.0), max(upper + shift, 0.0), Source.RULE
        closed, opened = closed + shift, opened + shift
    elif not lower <= 0.0 <= upper:
        message = (
            f"{where}: zero lies outside its limits {lower:.4g} to {upper:.4g}; engines that start there must be "
            "given the initial position"
        )
        notes.warn("zero_outside_limits", message, joint=joint.name, value=0.0, limit=lower if lower > 0.0 else upper)
    return Range(joint, lower, upper, closed, opened, source)
