"""How far raters agree, and whether the order in which they were shown things moved their scores."""

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from asset2sim.physics.arrays import Array
from lab.comparisons.statistics import SEED

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
