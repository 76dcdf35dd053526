"""Which variants there are, and in which order and under which labels a rater is shown them. Seeded and resumable."""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pandas as pd

from asset2sim.viewer.walk import Stop, stops_of
from lab.judged.published import label_of
from schemas.errors import UnknownChoiceError, UsageError
from schemas.table import Row
from schemas.vocabulary import Method


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
"""Scores that a rater may give: 0 is broken, 10 is like the real thing."""


@dataclass(frozen=True)
class Durations:
    """Simulated time of stage 2, and the least and the most of stage 3, s: about 5 s, and one to two minutes."""

    untouched_s: float = 5.0
    least_touched_s: float = 60.0
    most_touched_s: float = 120.0


IDENTITY = ("asset_id", "method", "model", "run_id")
"""Columns of ``rating_keys`` that say which variant a label stands for, wherever its folder may be moved to."""


@dataclass(frozen=True)
class Variant:
    """A refined asset in an output folder."""

    out: Path | str
    stop: Stop

    @property
    def identity(self) -> tuple[str, ...]:
        """Its values of the columns ``IDENTITY``."""
        stop = self.stop
        return stop.asset_id, stop.method, stop.model, stop.run_id


@dataclass(frozen=True)
class Shown:
    """A variant as one rater is shown it: its label, its place among the asset's, and among all."""

    label: str
    position: int
    presented: int
    variant: Variant

    @property
    def asset_id(self) -> str:
        """The asset."""
        return self.variant.stop.asset_id


@dataclass(frozen=True)
class RatingPlan:
    """All that a rater is shown, in order, with the seed of the order."""

    rater: str
    seed: int
    shown: tuple[Shown, ...]

    def key_rows(self) -> list[Row]:
        """The rows of ``rating_keys``."""
        return [
            {"rater": self.rater, "label": item.label, "seed": self.seed, "out": str(item.variant.out)}
            | dict(zip(IDENTITY, item.variant.identity, strict=True))
            for item in self.shown
        ]


def variants_of(
    folders: Sequence[Path | str], methods: Sequence[Method], asset_ids: Sequence[str]
) -> tuple[tuple[Variant, ...], tuple[Variant, ...]]:
    """The variants in output folders, of these methods and assets or of all, and those of them of which no object was
    written, so that there is nothing to rate. Raises UsageError where nothing is left, or an asset is not there."""
    found = [Variant(out, stop) for out in folders for stop in stops_of(out)]
    every = list({item.identity: item for item in found}.values())
    known = {item.stop.asset_id for item in every}
    for name in asset_ids:
        if name not in known:
            raise UnknownChoiceError("asset", name, known)
    chosen = [
        item
        for item in every
        if (not methods or item.stop.method in methods) and (not asset_ids or item.stop.asset_id in asset_ids)
    ]
    there = tuple(item for item in chosen if item.stop.refined is not None)
    if not there:
        raise UsageError("no refined object of these methods and assets is there to be rated; refine some first")
    return there, tuple(item for item in chosen if item.stop.refined is None)


def plan_for(rater: str, sources: Sequence[Variant], keys: pd.DataFrame, seed: int) -> RatingPlan:
    """The plan of a rater: assets in an order of the rater's own, and of each all variants, shuffled. Labels that the
    rater has been shown before (``keys``, the table ``rating_keys``) stay, and so does the seed of that order; variants
    that were added since come after those of their asset."""
    mine = keys[keys["rater"] == rater]
    seed = seed if mine.empty else int(mine.iloc[0]["seed"])
    before = {tuple(row[:-1]): row[-1] for row in mine[[*IDENTITY, "label"]].itertuples(index=False, name=None)}
    assets = sorted({item.stop.asset_id for item in sources})
    places: list[tuple[str, int, Variant]] = []
    for number in _rng(seed, rater).permutation(len(assets)):
        asset_id = assets[number]
        of_it = sorted((item for item in sources if item.stop.asset_id == asset_id), key=lambda item: item.identity)
        order = [of_it[index] for index in _rng(seed, rater, asset_id).permutation(len(of_it))]
        taken = {label for identity, label in before.items() if identity[0] == asset_id}
        free = (place for place in range(len(taken) + len(order)) if label_of(place) not in taken)
        place_of = {label_of(place): place for place in range(len(taken) + len(order))}
        here = [(place_of[before[item.identity]] if item.identity in before else next(free), item) for item in order]
        places += [(label_of(place), place, item) for place, item in sorted(here, key=lambda pair: pair[0])]
    shown = tuple(Shown(label, place, index, item) for index, (label, place, item) in enumerate(places))
    return RatingPlan(rater, seed, shown)


def new_keys(plan: RatingPlan, known: pd.DataFrame) -> list[Row]:
    """The rows of ``rating_keys`` that the table does not have yet."""
    there = set(zip(known["rater"], known["asset_id"], known["label"], strict=True))
    return [row for row in plan.key_rows() if (row["rater"], row["asset_id"], row["label"]) not in there]


def unrated(plan: RatingPlan, ratings: pd.DataFrame) -> list[Shown]:
    """Variants that the rater has not rated yet, in order."""
    mine = ratings[ratings["rater"] == plan.rater]
    done = set(zip(mine["asset_id"], mine["label"], strict=True))
    return [item for item in plan.shown if (item.asset_id, item.label) not in done]


def _rng(seed: int, *names: str) -> np.random.Generator:
    # Python's own hash of a text is another in every process.
    return np.random.default_rng([seed, *(zlib.crc32(name.encode()) for name in names)])


def rating_row(rater: str, shown: Shown, scores: Sequence[float], seconds: tuple[float, float], note: str) -> Row:
    """The row of a rating made now: the scores in all and of each stage; seconds in all, and simulated in stage 3."""
    stages = dict(zip((stage.column for stage in STAGES), scores[1:], strict=True))
    return {
        "rater": rater, "asset_id": shown.asset_id, "label": shown.label, "rated_at": datetime.now(UTC),
        "score": scores[0], "seconds": seconds[0], "seconds_touched": seconds[1],
        "position": shown.position, "presented": shown.presented, "note": note,
    } | stages  # fmt: skip
