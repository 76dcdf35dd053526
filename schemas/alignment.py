"""Scores of how well a refined asset matches its prompt, an expert's reference, and written expectations."""

from dataclasses import dataclass

from schemas.base import Finite, Fraction, Frozen, NonNegative


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


UNSTATED_SCALE = 1.0
"""The scale that the reference's loader assumes where the expert states none."""


@dataclass(frozen=True)
class Reference:
    """Choices of an expert for one object: scale, and the position of the joint of interest (rad or m at scale 1)."""

    scale: float
    joint: str
    position: float

    @property
    def states_scale(self) -> bool:
        """Whether the scale is an expert's, not a loader's default."""
        return self.scale != UNSTATED_SCALE


SIZE, NOTHING = "size", "none"
"""What an expectation may be about that is no joint: the object's size, and no state that could be told."""


class Expectation(Frozen):
    """Expectation of a careful reader of an object's prompt and pictures accepts of one thing, written before any
    result.

    ``what`` is ``size`` (longest edge with all closed, cm), a joint (position at scale 1, rad or m), or ``none`` (the
    prompt asks no state that could be told). Any of the ``ranges`` will do. ``swings``: it may end anywhere.
    """

    what: str
    ranges: tuple[tuple[Finite, Finite], ...] = ()
    unit: str = ""
    swings: bool = False
    why: str = ""
    lines: tuple[int, ...] = ()


class Expected(Frozen):
    """How an asset meets one expectation. ``at_start`` and ``at_rest`` are None where nothing is asked or measured.

    ``start`` is where it starts, or its size; ``rest`` where it settled in ``rest_engine``, of all engines the one that
    left it furthest from what is expected. Units are the expectation's.
    """

    expectation: Expectation
    at_start: bool | None = None
    start: Finite | None = None
    at_rest: bool | None = None
    rest: Finite | None = None
    rest_engine: str | None = None
    reason: str = ""

    @property
    def met(self) -> bool | None:
        """Whether it is met in the end: a joint at rest, a size or what swings at the start; None if not known."""
        stated = self.expectation
        return self.at_start if stated.swings or stated.what == SIZE else self.at_rest
