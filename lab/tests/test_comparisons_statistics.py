"""Estimates against hand-computed cases: values, intervals, pairs, and agreement."""

import numpy as np
import pytest
from numpy.typing import NDArray

from lab.comparisons.statistics import agreement, estimate, mean_not_zero, paired_difference, share

Array = NDArray[np.float64]


def of(*values: float) -> Array:
    return np.array(values, dtype=np.float64)


def test_an_estimate_is_the_mean_of_what_is_there() -> None:
    found = estimate(of(1.0, 2.0, np.nan, 6.0))
    assert found.value == pytest.approx(3.0) and found.n == 3
    assert found.low is not None and found.high is not None and 1.0 <= found.low < 3.0 < found.high <= 6.0


def test_the_interval_of_two_values_is_known() -> None:
    """Of two values a resample is one, the other, or both with ¼, ¼ and ½: the 2.5 % points are the values."""
    found = estimate(of(0.0, 10.0))
    assert (found.low, found.high) == (0.0, 10.0)


def test_the_interval_of_a_share_is_the_binomial_s() -> None:
    """80 of 100: the 2.5 % points of a binomial of 100 at 0.8 are 72 and 87 (tables), up to one for the draw."""
    found = estimate(of(*([100.0] * 80 + [0.0] * 20)))
    assert found.low == pytest.approx(72.0, abs=1.01) and found.high == pytest.approx(87.0, abs=1.01)


def test_the_interval_of_four_successes_is_not_a_point() -> None:
    """Wilson's, by hand: n / (n + z²) with z = 1.96 is 4 / 7.84."""
    four = estimate(of(100.0, 100.0, 100.0, 100.0), share)
    assert four.value == 100.0 and four.high == pytest.approx(100.0) and four.low == pytest.approx(51.0, abs=0.1)
    none = estimate(of(0.0, 0.0, 0.0, 0.0), share)
    assert none.value == 0.0 and none.low == pytest.approx(0.0) and none.high == pytest.approx(49.0, abs=0.1)
    most = estimate(of(*([100.0] * 80 + [0.0] * 20)), share)
    assert most.low == pytest.approx(71.1, abs=0.1) and most.high == pytest.approx(86.7, abs=0.1), "as tables have it"


def test_nothing_one_and_equal_values() -> None:
    assert estimate(of(np.nan)).value is None and estimate(of()).n == 0
    one = estimate(of(4.0))
    assert (one.value, one.low, one.high, one.n) == (4.0, None, None, 1)
    same = estimate(of(4.0, 4.0, 4.0))
    assert (same.value, same.low, same.high) == (4.0, 4.0, 4.0)


def test_the_same_values_give_the_same_interval() -> None:
    values = np.random.default_rng(3).random(40)
    assert estimate(values) == estimate(values.copy())


def test_the_mean_of_what_is_not_zero() -> None:
    assert float(mean_not_zero(of(0.0, 2.0, 4.0, 0.0))) == pytest.approx(3.0)
    assert float(mean_not_zero(of(0.0, 0.0))) == 0.0
    assert mean_not_zero(np.array([[0.0, 2.0], [0.0, 0.0]])).tolist() == [2.0, 0.0]
    found = estimate(of(0.0, 2.0, 4.0, 0.0), mean_not_zero)
    assert found.value == pytest.approx(3.0) and found.n == 4


def test_a_paired_difference_takes_what_both_have_and_what_they_share_falls_out() -> None:
    ours = of(1.0, 50.0, 900.0, np.nan)
    theirs = of(2.0, 51.0, 901.0, 7.0)
    found = paired_difference(theirs, ours)
    assert found.value == pytest.approx(1.0) and found.n == 3
    assert found.low == pytest.approx(1.0) and found.high == pytest.approx(1.0)


def test_a_paired_difference_of_another_statistic() -> None:
    found = paired_difference(of(0.0, 4.0, 2.0), of(0.0, 0.0, 1.0), mean_not_zero)
    assert found.value == pytest.approx(3.0 - 1.0)
    assert paired_difference(of(np.nan), of(1.0)).value is None


def test_a_difference_that_is_not_there_has_zero_in_its_interval() -> None:
    rng = np.random.default_rng(0)
    found = paired_difference(rng.normal(size=60), rng.normal(size=60))
    assert found.low is not None and found.high is not None and found.low < 0.0 < found.high


def test_agreement_by_hand() -> None:
    """Differences 0, 0.5, 0.5 and 0. Pearson 0.4375 / 0.6875. Of six pairs three agree and one does not, and each rater
    ties one: τ = 2 / √(5 · 5)."""
    found = agreement(of(0.0, 0.5, 1.0, 1.0, np.nan), of(0.0, 1.0, 0.5, 1.0, 1.0))
    assert found is not None and found.n == 4
    assert found.mean_absolute_difference == pytest.approx(0.25)
    assert found.pearson == pytest.approx(0.4375 / 0.6875)
    assert found.kendall == pytest.approx(0.4)


def test_agreement_of_too_few_or_constant_ratings_has_no_correlation() -> None:
    two = agreement(of(0.0, 1.0), of(0.0, 1.0))
    assert two is not None and two.pearson is None and two.kendall is None and two.mean_absolute_difference == 0.0
    flat = agreement(of(1.0, 1.0, 1.0), of(0.0, 0.5, 1.0))
    assert flat is not None and flat.pearson is None and flat.mean_absolute_difference == pytest.approx(0.5)
    assert agreement(of(np.nan), of(1.0)) is None
