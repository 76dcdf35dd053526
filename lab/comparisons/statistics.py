"""Estimates with intervals: bootstrap over objects, paired differences, agreement of two raters. Pure and seeded."""

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.stats import binomtest, bootstrap, kendalltau, pearsonr

from asset2sim.physics.arrays import Array

CONFIDENCE = 0.95
"""Share of the bootstrap's distribution that an interval holds."""
RESAMPLES = 4999
"""Resamples of a bootstrap: the 2.5 % points are then steady to two hundredths of the interval's width."""
PERCENTILE_BOOTSTRAP = partial(
    bootstrap, batch=1000, vectorized=True, axis=-1, confidence_level=CONFIDENCE, method="percentile"
)
SEED = 0
"""Seed of every bootstrap and permutation: the same values give the same interval."""
MIN_CORRELATION_PAIRS = 3
"""Least pairs for a correlation: two always lie on a line."""

Statistic = Callable[..., Array]
"""A function of values along ``axis``, as scipy's bootstrap calls it."""


@dataclass(frozen=True)
class Estimate:
    """A figure over ``n`` objects with its confidence interval: None for one object; without any, the value too."""

    value: float | None
    low: float | None
    high: float | None
    n: int


@dataclass(frozen=True)
class Agreement:
    """How far two raters of the same n objects are apart, and how alike they rank them (None where undefined)."""

    n: int
    mean_absolute_difference: float
    pearson: float | None
    kendall: float | None


def mean(values: Array, axis: int = -1) -> Array:
    """The mean along an axis."""
    return np.asarray(np.mean(values, axis=axis))


def share(values: Array, axis: int = -1) -> Array:
    """The share of what is 100 of values that are 0 or 100 along an axis, %."""
    return mean(values, axis)


def mean_not_zero(values: Array, axis: int = -1) -> Array:
    """The mean of what is above zero along an axis, 0 where nothing is: as the paper averages penetration."""
    counts = np.count_nonzero(values > 0.0, axis=axis)
    return np.asarray(np.where(values > 0.0, values, 0.0).sum(axis=axis) / np.maximum(counts, 1))


def estimate(values: Array, statistic: Statistic = mean) -> Estimate:
    """A statistic of (n,) values, one per object, with its percentile bootstrap interval, of a share
    with Wilson's: all resamples of four successes are four successes. NaN are left out."""
    kept = values[np.isfinite(values)]
    if not len(kept):
        return Estimate(None, None, None, 0)
    if statistic is share and len(kept) > 1:
        found = binomtest(round(kept.sum() / 100.0), len(kept)).proportion_ci(CONFIDENCE, method="wilson")
        return Estimate(float(kept.mean()), 100.0 * float(found.low), 100.0 * float(found.high), len(kept))
    low, high = _interval((kept,), statistic, paired=False)
    return Estimate(float(statistic(kept)), low, high, len(kept))


def paired_difference(theirs: Array, ours: Array, statistic: Statistic = mean) -> Estimate:
    """statistic(theirs) − statistic(ours) over the objects in which both (n,) have a value; pairs are resampled whole,
    so that an object's difficulty for all methods cancels."""
    both = np.isfinite(theirs) & np.isfinite(ours)
    if not both.any():
        return Estimate(None, None, None, 0)

    def difference(first: Array, second: Array, axis: int = -1) -> Array:
        return np.asarray(statistic(first, axis=axis) - statistic(second, axis=axis))

    sample = (theirs[both], ours[both])
    low, high = _interval(sample, difference, paired=True)
    return Estimate(float(difference(*sample)), low, high, int(both.sum()))


def agreement(first: Array, second: Array) -> Agreement | None:
    """How far two (n,) ratings of the same objects agree; NaN in either leaves the object out, None if none is left."""
    both = np.isfinite(first) & np.isfinite(second)
    a, b = first[both], second[both]
    if not len(a):
        return None
    enough = len(a) >= MIN_CORRELATION_PAIRS and np.ptp(a) > 0.0 and np.ptp(b) > 0.0
    return Agreement(
        n=len(a),
        mean_absolute_difference=float(np.mean(np.abs(a - b))),
        pearson=float(pearsonr(a, b).statistic) if enough else None,
        kendall=float(kendalltau(a, b).statistic) if enough else None,
    )


def _interval(sample: tuple[Array, ...], statistic: Statistic, *, paired: bool) -> tuple[float | None, float | None]:
    if len(sample[0]) < 2:
        return None, None
    if all(np.ptp(values) == 0.0 for values in sample):
        # All resamples are equal: the interval is a point.
        point = float(statistic(*sample))
        return point, point
    with warnings.catch_warnings():
        # Where all differences are alike, the interval is a point; scipy warns that it is degenerate.
        warnings.simplefilter("ignore")
        found = PERCENTILE_BOOTSTRAP(
            sample, statistic, n_resamples=RESAMPLES, paired=paired, rng=np.random.default_rng(SEED)
        )
    low, high = float(found.confidence_interval.low), float(found.confidence_interval.high)
    return (low, high) if math.isfinite(low) and math.isfinite(high) else (None, None)
