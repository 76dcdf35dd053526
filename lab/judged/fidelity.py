"""Behavioural fidelity: success rates of policies by method, how they go with reality's, and with each other's."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pandas as pd
from scipy.stats import PermutationMethod, pearsonr, spearmanr, t

from asset2sim.physics.arrays import Array
from lab.comparisons.statistics import CONFIDENCE, RESAMPLES, SEED
from lab.judged.figures import PERMUTATIONS, interval
from lab.trials.figures import ORDER, variant_names

REAL = "real"
"""The published method that is reality."""
NO_VARIANCE = "no variance"


@dataclass(frozen=True)
class Correlation:
    """Pearson's r over n tasks, its 95 % percentile bootstrap interval over tasks, and the two-sided p of permutations
    of the tasks (twice the smaller tail). All NaN where ``undefined`` says why; ``lost`` is the share of resamples in
    which r is undefined, which the interval leaves out."""

    r: float
    low: float
    high: float
    p: float
    n: int
    lost: float = 0.0
    undefined: str = ""


@dataclass(frozen=True)
class FidelityFigure:
    """One policy's success with one method: the mean over tasks of the rates, 0 to 1, its 95 % bootstrap interval over
    tasks, how many tasks and trials, and its correlation with reality; None where the policy never acted there."""

    policy: str
    method: str
    model: str
    mean: float
    low: float
    high: float
    tasks: int
    trials: int
    srcc: Correlation | None


@dataclass(frozen=True)
class RateAgreement:
    """How one policy's success rates with two methods go together over n tasks: Pearson's r and Spearman's ρ; NaN where
    either has no variance."""

    policy: str
    first: str
    second: str
    r: float
    rho: float
    n: int


def rates_of(trials: pd.DataFrame) -> pd.DataFrame:
    """Success rates by policy, method, model and task, of the latest rows of a table ``probe_trials``. Trials that a
    policy's end or a broken scene left without a final state do not count."""
    known = trials.dropna(subset=["success"])
    found = known.groupby(["policy", "method", "model", "task"])["success"].agg(["mean", "size"]).reset_index()
    return found.rename(columns={"mean": "rate", "size": "trials"}).astype({"rate": float, "trials": int})


def fidelity_figures(rates: pd.DataFrame, real: pd.DataFrame) -> list[FidelityFigure]:
    """A figure for each policy, method and model of ``rates_of``; ``real`` are rates of policies in reality, which are
    compared with those of the same name alone. Tasks without a counterpart in reality are left out of a correlation."""
    there = {str(policy): _by_task(some) for policy, some in real.groupby("policy")}
    found = []
    for (policy, method, model), some in rates.groupby(["policy", "method", "model"]):
        values = some["rate"].to_numpy(float)
        low, high = interval(values)
        srcc = None
        if policy in there and method != REAL:
            srcc = correlation(*_pairs(_by_task(some), there[str(policy)]))
        found.append(
            FidelityFigure(
                str(policy), str(method), str(model), float(values.mean()), low, high, len(values),
                int(some["trials"].sum()), srcc,
            )
        )  # fmt: skip
    return sorted(found, key=lambda item: (item.policy, ORDER.get(item.method, len(ORDER)), item.method, item.model))


def correlation(first: Array, second: Array) -> Correlation:
    """Pearson's r of two (n,) rates of the same tasks."""
    n = len(first)
    if n < 2 or np.ptp(first) == 0.0 or np.ptp(second) == 0.0:
        return Correlation(math.nan, math.nan, math.nan, math.nan, n, 1.0, NO_VARIANCE)
    tested = pearsonr(
        first, second, method=PermutationMethod(n_resamples=PERMUTATIONS, rng=np.random.default_rng(SEED))
    )
    drawn = np.random.default_rng(SEED).integers(0, n, (RESAMPLES, n))
    some = [part - part.mean(axis=1, keepdims=True) for part in (first[drawn], second[drawn])]
    spread = np.sqrt((some[0] ** 2).sum(axis=1) * (some[1] ** 2).sum(axis=1))
    kept = spread > 1e-12
    resampled = (some[0] * some[1]).sum(axis=1)[kept] / spread[kept]
    tail = 50.0 * (1.0 - CONFIDENCE)
    low, high = np.percentile(resampled, [tail, 100.0 - tail])
    return Correlation(
        float(tested.statistic), float(low), float(high), float(tested.pvalue), n, float(1.0 - kept.mean())
    )


def smallest_r(n: int) -> float:
    """The |r| of n tasks below which a correlation is not told from none at 5 %, two-sided; NaN for fewer than 3."""
    if n < 3:
        return math.nan
    quantile = float(t.ppf(0.5 + CONFIDENCE / 2.0, n - 2))
    return quantile / math.sqrt(n - 2 + quantile**2)


def agreements(rates: pd.DataFrame) -> list[RateAgreement]:
    """How each policy's rates go together between every two of its methods: what may be said of a probe that never
    acted in reality."""
    found = []
    for policy, some in rates.groupby("policy"):
        parts = {
            (str(method), str(model)): _by_task(part) for (method, model), part in some.groupby(["method", "model"])
        }
        variants = {name: parts[pair] for pair, name in variant_names(parts).items()}
        for first, second in combinations(variants, 2):
            pairs = _pairs(variants[first], variants[second])
            r = rho = math.nan
            if len(pairs[0]) > 1 and all(np.ptp(part) > 0.0 for part in pairs):
                r, rho = float(pearsonr(*pairs).statistic), float(spearmanr(*pairs).statistic)
            found.append(RateAgreement(str(policy), first, second, r, rho, len(pairs[0])))
    return found


def _by_task(rates: pd.DataFrame) -> dict[str, float]:
    return dict(zip(rates["task"].astype(str), rates["rate"].astype(float), strict=True))


def _pairs(first: Mapping[str, float], second: Mapping[str, float]) -> tuple[Array, Array]:
    tasks = [task for task in first if task in second]
    return np.array([first[task] for task in tasks]), np.array([second[task] for task in tasks])
