"""Means of ratings and of video scores with the paper's ± and a bootstrap interval: pure, seeded, over data frames."""

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from asset2sim.physics.arrays import Array
from lab.comparisons.statistics import SEED, estimate
from schemas.errors import UsageError

TASK = ["task", "asset_id"]
VARIANT = ["method", "model"]
RATED = ["rater", "asset_id", "label"]


@dataclass(frozen=True)
class VideoFigure:
    """One judge's scores (0 to 5) of one method: the mean over tasks of the task means, the paper's ± of it,
    √(Σ sd_t²) / n_tasks with the sample deviation over trials (NaN where a task has one trial), and the 95 % bootstrap
    interval over tasks."""

    judge: str
    method: str
    model: str
    mean: float
    plus_minus: float
    low: float
    high: float
    tasks: int
    trials: int


@dataclass(frozen=True)
class RatingFigure:
    """Ratings (0 to 10) of one method: the mean, its 95 % bootstrap interval over objects, the sample deviations over
    raters of each one's mean over objects and over objects of each one's mean over raters, and the mean of each stage
    (NaN where none was scored)."""

    method: str
    model: str
    mean: float
    low: float
    high: float
    over_raters: float
    over_objects: float
    stages: tuple[float, float, float]
    raters: int
    objects: int


def video_figures(scores: pd.DataFrame) -> list[VideoFigure]:
    """A figure for each judge and method of a table ``video_scores``, the best first within a judge. Trials without a
    score do not count; a task is one with its asset."""
    found = []
    for (judge, method, model), some in scores.dropna(subset=["score"]).groupby(["judge", *VARIANT]):
        tasks = [task_score(part) for _, part in some.groupby(TASK)]
        means, deviations = (np.array(values) for values in zip(*tasks, strict=True))
        low, high = interval(means)
        spread = float(np.sqrt(np.sum(deviations**2)) / len(tasks))
        count = int(some["trials"].sum())
        found.append(
            VideoFigure(str(judge), str(method), str(model), float(means.mean()), spread, low, high, len(tasks), count)
        )
    return sorted(found, key=lambda item: (item.judge, -item.mean))


def latest_scores(scores: pd.DataFrame) -> pd.DataFrame:
    """The rows of each judge's latest look at each task and asset: candidates are scored beside each other, so that the
    trials of two looks are not mixed."""
    latest = scores.groupby(["judge", "task", "asset_id"])["judged_at"].transform("max")
    return scores[(scores["judged_at"] == latest) | latest.isna()]


def task_score(rows: pd.DataFrame) -> tuple[float, float]:
    """Mean and sample deviation of a task's trials, of which a row may stand for several; NaN for one trial."""
    counts, means = (rows[name].to_numpy(float) for name in ("trials", "score"))
    within = rows["score_deviation"].fillna(0.0).to_numpy(float)
    total = counts.sum()
    mean = float(counts @ means / total)
    squares = (counts - 1.0) @ within**2 + counts @ (means - mean) ** 2
    return mean, math.sqrt(squares / (total - 1.0)) if total > 1.0 else math.nan


def joined(ratings: pd.DataFrame, keys: pd.DataFrame) -> pd.DataFrame:
    """The latest rating of each variant by each rater, with its method. Raises UsageError where a rating's key is
    missing."""
    latest = ratings.sort_values("rated_at", kind="stable").drop_duplicates(RATED, keep="last")
    found = latest.merge(keys.drop_duplicates(RATED, keep="last"), on=RATED, how="left", validate="one_to_one")
    lost = found[found["method"].isna()]
    if len(lost):
        rater, asset_id, label = lost.iloc[0][RATED]
        raise UsageError(
            f"{len(lost)} ratings have no key, as that of asset {asset_id}, variant {label}, by {rater}: bring back "
            "the file of rating_keys that was written with it"
        )
    return found


def rating_figures(rated: pd.DataFrame) -> list[RatingFigure]:
    """A figure for each method of ``joined`` ratings, the best first."""
    found = []
    for (method, model), some in rated.groupby(VARIANT):
        of_raters, of_objects = (some.groupby(by)["score"].mean().to_numpy() for by in ("rater", "asset_id"))
        low, high = interval(of_objects)
        before, untouched, touched = (
            float(some[name].mean()) for name in ("score_before", "score_untouched", "score_touched")
        )
        found.append(
            RatingFigure(
                method=str(method),
                model=str(model),
                mean=float(some["score"].mean()),
                low=low,
                high=high,
                over_raters=deviation(of_raters),
                over_objects=deviation(of_objects),
                stages=(before, untouched, touched),
                raters=len(of_raters),
                objects=len(of_objects),
            )
        )
    return sorted(found, key=lambda item: -item.mean)


def deviation(values: Array) -> float:
    """Sample deviation of (n,) values; NaN for one."""
    return float(np.std(values, ddof=1)) if len(values) > 1 else math.nan


def interval(values: Array) -> tuple[float, float]:
    """95 % percentile bootstrap interval of the mean of (n,) values; NaN for one."""
    found = estimate(values)
    return (math.nan, math.nan) if found.low is None or found.high is None else (found.low, found.high)


PERMUTATIONS = 4999
"""Permutations of the order: a p-value is then steady to half a hundredth."""


@dataclass(frozen=True)
class OrderEffect:
    """By how much a score rises from one place of the order to the next, over n scores, and the share of shuffles
    within each trial, or rater and object, with a slope at least as steep."""

    slope: float
    p: float
    n: int


def krippendorff_alpha(scores: Array) -> float:
    """Krippendorff's alpha at interval level of (raters, units) scores, NaN where a rater gave none: 1 − observed over
    expected disagreement, both mean squared differences. Units with fewer than two scores are left out. NaN where
    nothing is left, or all scores are the same."""
    counts = np.isfinite(scores).sum(axis=0)
    kept, counts = scores[:, counts > 1], counts[counts > 1]
    total = int(counts.sum())
    if not total:
        return math.nan
    # The mean squared difference of all pairs of n values is 2 n / (n − 1) times their variance.
    within = np.nanvar(kept, axis=0)
    observed = float((2.0 * counts**2 / (counts - 1.0) * within).sum()) / total
    expected = 2.0 * total / (total - 1.0) * float(np.nanvar(kept))
    return 1.0 - observed / expected if expected > 0.0 else math.nan


def rater_matrix(rated: pd.DataFrame, column: str = "score") -> Array:
    """(raters, variants) scores of ``joined`` ratings, NaN where a rater gave none."""
    table = rated.pivot_table(column, index="rater", columns=["asset_id", "method", "model"], dropna=False)
    return table.to_numpy(float)


def order_effect(rows: pd.DataFrame, block: list[str], item: list[str]) -> OrderEffect | None:
    """The effect of the column ``position`` on ``score``, beside those of each ``block`` (within which the order was
    shuffled) and each ``item`` (what was scored), by least squares with a permutation test; None where the order is not
    known, or every item always had the same place."""
    known = rows.dropna(subset=["position", "score"])
    if known.empty:
        return None
    score, place = known["score"].to_numpy(float), known["position"].to_numpy(float)
    blocks, items = (np.asarray(known.groupby(by).ngroup(), dtype=float) for by in (block, item))
    others = np.concatenate([_members(blocks), _members(items)], axis=1)
    basis, sizes, _ = np.linalg.svd(others, full_matrices=False)
    basis = basis[:, sizes > 1e-9 * sizes[0]]

    def slopes(places: Array) -> Array:
        """Slopes for (k, n) orders; NaN where blocks and items explain the order."""
        left = places - (places @ basis) @ basis.T
        square = (left**2).sum(axis=1)
        return np.where(square > 1e-9, left @ score / np.maximum(square, 1e-9), np.nan)

    slope = float(slopes(place[None])[0])
    if math.isnan(slope):
        return None
    shuffled = np.tile(place, (PERMUTATIONS, 1))
    rng = np.random.default_rng(SEED)
    for number in np.unique(blocks):
        inside = np.flatnonzero(blocks == number)
        shuffled[:, inside] = rng.permuted(shuffled[:, inside], axis=1)
    steep = np.abs(slopes(shuffled)) >= abs(slope) * (1.0 - 1e-9)
    return OrderEffect(slope, (1.0 + float(steep.sum())) / (1.0 + PERMUTATIONS), len(known))


def mean_by_place(rows: pd.DataFrame) -> list[float]:
    """The mean ``score`` at each ``position``, the first place first; NaN at one that has none."""
    means = rows.dropna(subset=["position", "score"]).groupby("position")["score"].mean()
    return [float(means.get(place, math.nan)) for place in range(int(means.index.max()) + 1)] if len(means) else []


def _members(numbers: Array) -> Array:
    """(n, groups) 1 where a row is in a group."""
    return np.asarray(numbers[:, None] == np.unique(numbers), dtype=float)
