"""The paper's own rule for joint dynamics: absolute ranges, chosen from by a word (section "Synthesize").

Nothing is bounded by what the joint moves: this is what the default rule is compared with.
"""

import math
from dataclasses import dataclass

from asset2sim.physics.terms import JointTerms, Term
from asset2sim.physics.timing import RETURN_CRITICAL
from schemas.overlay import JointProposal
from schemas.vocabulary import Source


@dataclass(frozen=True)
class Span:
    """A range of the paper, low to high; ``usual`` is its value where no word is given."""

    low: float
    high: float
    usual: float

    def level(self, word: str) -> float:
        """The value for a word: the ends for the super words, the usual one for medium, geometric means between."""
        return {
            "super low": self.low,
            "low": math.sqrt(self.low * self.usual),
            "medium": self.usual,
            "high": math.sqrt(self.usual * self.high),
            "super high": self.high,
        }[word]


def geometric_range(low: float, high: float) -> Span:
    """A range for which the paper names no usual value: its geometric mean stands for it."""
    return Span(low, high, math.sqrt(low * high))


@dataclass(frozen=True)
class Ranges:
    """The ranges of one kind of joint."""

    damping: Span
    friction: Span
    stiffness: Span
    sprung_damping: Span


HINGE = Ranges(
    Span(0.05, 0.5, 0.15), geometric_range(0.005, 0.05), geometric_range(0.05, 2.0), geometric_range(0.01, 0.2)
)
"""N·m·s/rad, N·m, N·m/rad, and N·m·s/rad where there is a spring."""
SLIDER = Ranges(Span(0.5, 5.0, 1.5), geometric_range(0.1, 2.0), geometric_range(50.0, 500.0), geometric_range(0.2, 5.0))
"""N·s/m, N, N/m, and N·s/m where there is a spring."""
SOFT_HZ, STIFF_HZ = 1.0, 5.0
"""Frequencies that the prompt calls a soft and a stiff spring, Hz: the ends of the stiffness range."""
HOLD_LEVEL = "high"
"""Damping of a joint that must hold and has no word of its own: the paper wants more, and a little friction."""


def paper_terms(proposal: JointProposal, *, prismatic: bool, holds: bool, rest: float, source: Source) -> JointTerms:
    """Damping, friction and stiffness of one joint from the paper's ranges; absolute values are taken as stated."""
    ranges = SLIDER if prismatic else HINGE
    stiffness = paper_stiffness(proposal, ranges, source)
    sprung, word = stiffness.value > 0.0, proposal.damping_level
    damping_span = ranges.sprung_damping if sprung else ranges.damping
    if proposal.damping is not None:
        damping = Term(proposal.damping, source)
    elif word is not None:
        damping = Term(damping_span.level(word), source)
    else:
        damping = Term(damping_span.level(HOLD_LEVEL if holds and not sprung else "medium"), Source.RULE)
    if proposal.friction is not None:
        friction = Term(proposal.friction, source)
    elif sprung:
        friction = Term(0.0, Source.RULE)
    else:
        friction = Term(ranges.friction.level("super low" if proposal.holds is False else "medium"), Source.RULE)
    return JointTerms(damping, friction, stiffness, rest)


def paper_stiffness(proposal: JointProposal, ranges: Ranges, source: Source) -> Term:
    """0 for a passive joint; else the place in the range that the spring's frequency has between soft and stiff."""
    if proposal.stiffness is not None:
        return Term(proposal.stiffness, source)
    hertz = proposal.spring_hz
    if hertz is None and proposal.returns_s is not None:
        hertz = RETURN_CRITICAL / proposal.returns_s / (2.0 * math.pi)
    if hertz is None:
        return Term(0.0, Source.RULE)
    share = min(max(math.log(hertz / SOFT_HZ) / math.log(STIFF_HZ / SOFT_HZ), 0.0), 1.0)
    span = ranges.stiffness
    return Term(span.low * (span.high / span.low) ** share, source)
