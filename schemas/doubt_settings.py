"""Settings of when a model's answer is doubted, and what is asked then."""

from pydantic import Field

from schemas.base import Fraction, Frozen, NonNegative, Positive


class DoubtSettings(Frozen):
    """When a model is asked about the same object again: once with what its answer comes to, or for several answers."""

    ask_again: bool | None = None
    """Whether a model is asked once more where what its answer comes to is further from what words and kind lead one to
    expect than its own σ, and the second answer is taken; null: by any model but the offline prior, unless ``correct``
    is semantic."""
    samples: int = Field(1, ge=1)
    """Most answers to one question, of which the median is taken; more than one only where σ, or the difference of two
    answers, is above the σ below."""
    sample_temperature: NonNegative = 0.7
    """Temperature at which the others are asked: at zero they would all be the same."""
    scale_sigma: Positive = 0.35
    """Relative σ of a scale for which a model states none: one answer of the paper's models is 35 % off."""
    prior_scale_sigma: Positive = 0.17
    """σ of the expected scale, which is the offline prior's: what that is off itself. Both count for the difference."""
    position_sigma: Fraction = 0.15
    """σ of an asked position for which a model states none, as a share of the part's useful travel: half the way from
    slightly open to half open, beyond which a state reads as another word ..."""
    prior_position_sigma: Fraction = 0.1
    """... and that of the expected one: what the search may move a joint by without leaving the state."""
