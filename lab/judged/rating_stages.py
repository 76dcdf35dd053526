"""The three stages in which a person rates a variant, as the paper has them, and how long each takes."""

from dataclasses import dataclass


@dataclass(frozen=True)
class RatingStage:
    """One stage: the column of its score, what the page calls it, and what it asks the rater to look for."""

    column: str
    title: str
    does: str
    looks: tuple[str, ...]


BEFORE = RatingStage(
    "score_before",
    "Stage 1 of 3: before touching",
    "Nothing is simulated. Look around: drag the ground with the left button to turn, the right one to move, and zoom "
    "with the wheel.",
    (
        "Is it as large as it should be, beside the drink can (12 cm) and the person (1.75 m)? Squares are 10 cm.",
        "Does it rest naturally, or does it tilt, or sink into the ground?",
        "Do its parts start where such parts start?",
        "Does anything hang in the air, or pass through something?",
    ),
)
UNTOUCHED = RatingStage(
    "score_untouched",
    "Stage 2 of 3: left alone",
    "Press Start, and watch it without touching it.",
    ("Does it move by itself?", "Do parts creep or wiggle?", "Does it slide, shake or turn?"),
)
TOUCHED = RatingStage(
    "score_touched",
    "Stage 3 of 3: push it",
    "Press Start, and drag parts with the left button: a spring between the part and the pointer pulls. Tap it, push "
    "it lightly from the side, move each part that moves, again and again.",
    (
        "Does it react as the real thing would?",
        "Is it too stiff, too loose, unstable?",
        "Does it glitch, pass through itself, fly apart?",
        "Does it still work after many times?",
    ),
)
STAGES = (BEFORE, UNTOUCHED, TOUCHED)
SCORES = tuple(range(11))
"""What may be given: 0 is broken, 10 is like the real thing."""


@dataclass(frozen=True)
class Durations:
    """Simulated time of stage 2, and the least and the most of stage 3, s: about 5 s, and one to two minutes."""

    untouched_s: float = 5.0
    least_touched_s: float = 60.0
    most_touched_s: float = 120.0


def lasting(least_touched_s: float) -> Durations:
    """The paper's durations with another least time of stage 3, s; its most is twice that."""
    return Durations(least_touched_s=least_touched_s, most_touched_s=2.0 * least_touched_s)
