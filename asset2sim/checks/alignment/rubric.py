"""Every threshold of the alignment rubric, in one place, each with its unit and its reason."""

from schemas.base import Fraction, Frozen, Positive


class Rubric(Frozen):
    """What counts as met, and what as near. Sizes are compared by their ratio, states by the share of a joint's range.

    Chosen before any methods were compared, by what a person tells apart by eye; ``slightly_share`` was widened once,
    after seeing what experts call slightly open.
    """

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
    slightly_share: tuple[Fraction, Fraction] = (0.03, 0.55)
    """Share of the range in use that a part is open which must be slightly open: visibly, and about half at most
    (experts open a laptop that is to be slightly open by 36° to 80°, of the 110° in use)."""
    open_share: Fraction = 0.85
    """Share of its range from which a part counts as open, or fully open; up to ``near_share`` beyond its open end."""
    near_share: Fraction = 0.10
    """How far a part may be from a stated share, angle or pose, as a share of its range."""
    none_share: Fraction = 0.35
    """How far beyond what is met, as a share of its range, nothing is left of the credit for a part's state, which
    falls linearly until there. Where a part must be open at all, nothing is left at its closed end."""
    resting_share: Fraction = 0.05
    """How far from its closed end or its authored zero, as a share of its range, a lid, door, drawer or cap may be of
    which nobody asks anything."""
