"""Definitions of the tables' figures: name, computation from the objects, and which direction is better."""

import csv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from asset2sim.physics.arrays import Array
from lab.comparisons.statistics import Statistic, mean, mean_not_zero, share
from schemas.vocabulary import Method


@dataclass(frozen=True)
class Stated:
    """A figure as the paper states it, with its standard deviation where there is one."""

    value: float
    spread: float | None = None


NINE_SUBSET = "paper9"
"""The subset of Table 1's nine objects."""
LARGE_SUBSET = "paper93"
"""The subset of Table 6's 93 objects."""
EXCLUDED_CATEGORIES = ("Stapler", "Toilet")
"""Categories that one of the paper's penetration columns excludes."""


def paper_table(number: int) -> dict[Method, dict[str, Stated]]:
    """Figures of one of the paper's tables, by method and key of figure: mm, %, rad, calls."""
    found: dict[Method, dict[str, Stated]] = {}
    with Path(__file__).with_name("paper_figures.csv").open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            if row["table"] == str(number):
                spread = float(row["spread"]) if row["spread"] else None
                found.setdefault(Method(row["method"]), {})[row["figure"]] = Stated(float(row["value"]), spread)
    return found


TABLE_1 = paper_table(1)
"""Stability and semantics over the nine objects (Table 1, and its ablations)."""
TABLE_6 = paper_table(6)
"""The large set: 80 of 93 assets that all methods finished; ``success`` is over all 93."""
TABLE_7 = paper_table(7)
"""Queries an asset."""


def stated(subset: str | None, method: Method, key: str) -> Stated | None:
    """The paper's figure for a method, or None: of the nine objects where those were run, else of the large set."""
    source = TABLE_1 if subset == NINE_SUBSET and key != "success" else TABLE_6
    return (source.get(method) or {}).get(key) or (TABLE_7.get(method) or {}).get(key)


ZERO_MM = 1e-6
"""Penetration up to which Φ counts as zero, mm: rounding in an engine that counts in single precision."""


@dataclass(frozen=True)
class FigureSpec:
    """One figure. ``values`` gives (n,) numbers, one per row of the objects, NaN where it is undefined for a row.
    ``given`` names methods for which it is zero by definition: the experts' deviation from themselves. ``ranked`` says
    whether the tables mark the best method."""

    key: str
    heading: str
    unit: str
    higher_is_better: bool
    digits: int
    values: Callable[[pd.DataFrame], Array]
    statistic: Statistic = mean
    given: tuple[Method, ...] = ()
    ranked: bool = True


def _column(name: str, factor: float = 1.0) -> Callable[[pd.DataFrame], Array]:
    return lambda rows: factor * rows[name].to_numpy(dtype=float)


def _share(name: str) -> Callable[[pd.DataFrame], Array]:
    return _column(name, 100.0)


def _penetration(rows: pd.DataFrame) -> Array:
    phi = rows["penetration_mm"].to_numpy(dtype=float)
    return np.where(phi <= ZERO_MM, 0.0, phi)


def _penetration_of_others(rows: pd.DataFrame) -> Array:
    return np.where(rows["category"].isin(EXCLUDED_CATEGORIES).to_numpy(), np.nan, _penetration(rows))


def _rubric(rows: pd.DataFrame) -> Array:
    """Prompt alignment by rubric, %, of objects without expectations; 0 for one without an overlay."""
    return 100.0 * rows["alignment"].fillna(0.0).where(rows["meaning"].isna()).to_numpy(dtype=float)


STABILITY: tuple[FigureSpec, ...] = (
    FigureSpec("penetration", "Φ mm", "mm", False, 2, _penetration),
    FigureSpec("penetration_nonzero", "Φ mm, not zero", "mm", False, 2, _penetration, mean_not_zero),
    FigureSpec("penetration_others", "Φ mm, no stapler or toilet", "mm", False, 2, _penetration_of_others),
    FigureSpec("drift", "drift passes %", "%", True, 1, _share("drift_passes"), share),
    FigureSpec("oscillation", "oscillation passes %", "%", True, 1, _share("oscillation_passes"), share),
    FigureSpec("scale", "scale off %", "%", False, 1, _column("scale_deviation", 100.0), given=(Method.REFERENCE,)),
    FigureSpec("joint", "joint off rad", "rad", False, 2, _column("joint_deviation_rad"), given=(Method.REFERENCE,)),
    FigureSpec("alignment", "alignment %, as readers expect", "%", True, 1, _column("meaning", 100.0)),
    FigureSpec("rubric", "by our rubric %, others", "%", True, 1, _rubric),
)
"""Table 1: stability and semantics."""

SUCCESS: tuple[FigureSpec, ...] = (
    FigureSpec("success", "success %", "%", True, 1, _share("ok"), share),
    FigureSpec("paper_success", "the paper's three tests %", "%", True, 1, _share("paper_tests_pass"), share),
)
"""Table 6: success by every check that was run, and by the paper's three alone."""

COST: tuple[FigureSpec, ...] = (
    FigureSpec("calls", "calls", "1", False, 2, _column("calls"), ranked=False),
    FigureSpec("tokens", "tokens", "1", False, 0, _column("tokens"), ranked=False),
    FigureSpec("cost", "USD", "USD", False, 4, _column("cost_usd"), ranked=False),
    FigureSpec("seconds", "seconds", "s", False, 1, _column("seconds"), ranked=False),
)
"""Table 7: cost of an asset."""
