"""Scores of how well a refined asset matches its prompt and an expert's reference."""

from schemas.base import Fraction, Frozen, NonNegative


class Score(Frozen):
    """A score from 0 to 1 with its reason in a sentence."""

    value: Fraction
    reason: str


class Alignment(Frozen):
    """Semantic accuracy of one asset (paper, evaluation, section 2).

    ``scale`` and ``state`` are the halves of the prompt alignment, by rubric; ``judged`` is a vision model's score of
    the whole, None where no model is set or it failed. Deviations are None without a reference: ``scale_deviation`` is
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
