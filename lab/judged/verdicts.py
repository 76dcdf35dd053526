"""Ratings beside our own verdicts: how they correlate, and object by object where people and numbers disagree."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import pearsonr

from asset2sim.catalog.read import read_table
from schemas.vocabulary import Status

MIDDLE = 5.0
"""Score from which people are taken to call an object good: the middle of 0 to 10."""
LEAST_PAIRS = 3
"""Least variants for a correlation: two always lie on a line."""
COLUMNS = ["run_id", "asset_id", "method", "model", "status", "failure_mode", "reason"]


@dataclass(frozen=True)
class RatedVariant:
    """A variant with its mean rating (0 to 10), what raters wrote, and our verdict on it: whether it passes, and else
    why not. ``passes`` of an asset that several models refined by the same method is their share where no one of them
    was what was rated."""

    asset_id: str
    method: str
    model: str
    rating: float
    raters: int
    notes: tuple[str, ...]
    passes: float
    reason: str

    @property
    def disagrees(self) -> bool:
        """Whether people call it good and our checks do not, or the reverse."""
        return (self.rating >= MIDDLE) != (self.passes > 0.5)


@dataclass(frozen=True)
class VerdictFigures:
    """Correlation (Pearson's r; NaN where undefined) of mean ratings with passing, and the mean rating of what passes
    and of what fails (NaN where nothing does)."""

    r: float
    n: int
    of_passes: float
    of_failures: float


def verdicts_of(folders: Sequence[Path | str]) -> pd.DataFrame:
    """Our verdicts on every asset of output folders, by run: those of earlier runs from the history. ``latest`` marks
    what is in a folder now. Raises UsageError for a folder without a catalog."""
    found = []
    for folder in folders:
        now = read_table(folder, "assets")[COLUMNS].assign(latest=True)
        before = read_table(folder, "asset_history")[COLUMNS].assign(latest=False)
        found.append(pd.concat([now, before]).drop_duplicates(COLUMNS[:4]))
    return pd.concat(found, ignore_index=True)


def rated_variants(rated: pd.DataFrame, verdicts: pd.DataFrame) -> list[RatedVariant]:
    """Every variant of ``joined`` ratings on which there is a verdict: that of the run that was rated, or, where the
    run is not known, those in the folders now of the same asset and method."""
    found = []
    runs = {tuple(row[:4]): row[4:] for row in verdicts[COLUMNS].itertuples(index=False, name=None)}
    latest = verdicts[verdicts["latest"]]
    for (asset_id, method, model, run_id), some in rated.groupby(
        ["asset_id", "method", "model", "run_id"], dropna=False
    ):
        if isinstance(run_id, str):
            key = (run_id, asset_id, method, model)
            of_it = [runs[key]] if key in runs else []
        else:
            same = latest[(latest["asset_id"] == asset_id) & (latest["method"] == method)]
            of_it = list(same[COLUMNS[4:]].itertuples(index=False, name=None))
        if of_it:
            reasons = dict.fromkeys(f"{mode}: {reason}" for status, mode, reason in of_it if status != Status.OK)
            passes = sum(status == Status.OK for status, *_ in of_it) / len(of_it)
            notes = tuple(note for note in some["note"] if note)
            mean, raters = float(some["score"].mean()), some["rater"].nunique()
            named = str(asset_id), str(method), str(model)
            found.append(RatedVariant(*named, mean, raters, notes, passes, "; ".join(reasons)))
    return found


def verdict_figures(variants: Sequence[RatedVariant]) -> VerdictFigures:
    """How the ratings go with our verdicts."""
    ratings, passes = (np.array([getattr(item, name) for item in variants], float) for name in ("rating", "passes"))
    enough = len(variants) >= LEAST_PAIRS and np.ptp(ratings) > 0.0 and np.ptp(passes) > 0.0
    means = [float(some.mean()) if len(some) else math.nan for some in (ratings[passes > 0.5], ratings[passes <= 0.5])]
    return VerdictFigures(float(pearsonr(ratings, passes).statistic) if enough else math.nan, len(variants), *means)


def disagreements(variants: Sequence[RatedVariant]) -> list[RatedVariant]:
    """Where people and our checks disagree, by asset, the widest apart first."""
    return sorted(
        (item for item in variants if item.disagrees), key=lambda item: (item.asset_id, -abs(item.rating - MIDDLE))
    )
