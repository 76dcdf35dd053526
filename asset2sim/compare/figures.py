"""The figures of the tables: what each is called, how it is taken from the objects, and which way is better."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from asset2sim.compare.paper import SKIPPED
from asset2sim.compare.statistics import Statistic, mean, mean_not_zero
from asset2sim.physics.arrays import Array
from schemas.vocabulary import Method

ZERO_MM = 1e-6
"""Penetration up to which Φ counts as zero, mm: rounding in an engine that counts in single precision."""


@dataclass(frozen=True)
class Figure:
    """One figure. ``values`` gives (n,) numbers, one per row of the objects, NaN where it says nothing of a row.

    ``given`` names methods for which it is given rather than found: the experts are not off themselves. ``ranked`` says
    whether it is worth being first in.
    """

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
    return np.where(rows["category"].isin(SKIPPED).to_numpy(), np.nan, _penetration(rows))


def _alignment(rows: pd.DataFrame) -> Array:
    """What never came to an overlay is aligned with nothing."""
    return 100.0 * rows["alignment"].fillna(0.0).to_numpy(dtype=float)


STABILITY: tuple[Figure, ...] = (
    Figure("penetration", "Φ mm", "mm", False, 2, _penetration),
    Figure("penetration_nonzero", "Φ mm, not zero", "mm", False, 2, _penetration, mean_not_zero),
    Figure("penetration_others", "Φ mm, no stapler or toilet", "mm", False, 2, _penetration_of_others),
    Figure("drift", "drift passes %", "%", True, 1, _share("drift_passes")),
    Figure("oscillation", "oscillation passes %", "%", True, 1, _share("oscillation_passes")),
    Figure("scale", "scale off %", "%", False, 1, _column("scale_deviation", 100.0), given=(Method.REFERENCE,)),
    Figure("joint", "joint off rad", "rad", False, 2, _column("joint_deviation_rad"), given=(Method.REFERENCE,)),
    Figure("alignment", "alignment %", "%", True, 1, _alignment),
)
"""Table 1: stability and semantics."""

SUCCESS: tuple[Figure, ...] = (
    Figure("success", "success %", "%", True, 1, _share("ok")),
    Figure("paper_success", "the paper's three tests %", "%", True, 1, _share("paper_tests_pass")),
)
"""Table 6: success by every test that was run, and by the paper's three alone."""

COST: tuple[Figure, ...] = (
    Figure("calls", "calls", "1", False, 2, _column("calls"), ranked=False),
    Figure("tokens", "tokens", "1", False, 0, _column("tokens"), ranked=False),
    Figure("cost", "USD", "USD", False, 4, _column("cost_usd"), ranked=False),
    Figure("seconds", "seconds", "s", False, 1, _column("seconds"), ranked=False),
)
"""Table 7: what an asset costs."""
