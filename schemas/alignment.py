"""How well a refined asset is what its user asked for, and how far it is from an expert's choice."""

from schemas.base import Fraction, Frozen, NonNegative


class Score(Frozen):
    """A share of what was wanted, with the reason in a sentence."""

    value: Fraction
    reason: str


class Alignment(Frozen):
    """Semantic accuracy of one asset (paper, evaluation, section 2).

    ``scale`` and ``state`` are the halves of the prompt alignment, by rubric; ``judged`` is a vision model's word on
    the whole, None where none is set or it failed. Deviations are None without a reference: ``scale_deviation`` is
    |s − s_ref| / s_ref, ``joint_deviation`` |q − q_ref| in rad, or m for sliders.
    """

    scale: Score
    state: Score
    judged: Score | None = None
    scale_deviation: NonNegative | None = None
    reference_states_scale: bool = False
    joint_deviation: NonNegative | None = None
    joint_is_slider: bool = False

    @property
    def value(self) -> float:
        """The prompt alignment a in [0, 1]: half for scale, half for the articulated state."""
        return (self.scale.value + self.state.value) / 2.0
