"""Rows of the comparison's tables, from one row per object: pure functions."""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict

import numpy as np
import pandas as pd

from asset2sim.physics.arrays import Array
from lab.comparisons.figure_specs import STABILITY, SUCCESS, FigureSpec, stated
from lab.comparisons.method_runs import NO_MODEL, level_of
from lab.comparisons.statistics import Estimate, estimate, paired_difference
from schemas.table import Row
from schemas.vocabulary import PAPER_FAILURE_MODES, Method

OURS = Method.ASSET2SIM
OK = "ok"
NO_PAPER_MODE = "none of the paper's"
"""Word of a chart for a failure mode that the paper has no name for."""
OUTCOMES = (OK, *dict.fromkeys(PAPER_FAILURE_MODES.values()), NO_PAPER_MODE)
"""Outcomes of an asset: ok, one of the paper's failure modes, or one that it has no name for."""
RTOL = 1e-9
"""Relative difference below which two figures are the same one."""
NO_ESTIMATE = Estimate(None, None, None, 0)


def figure_rows(objects: pd.DataFrame, figures: Sequence[FigureSpec], subset: str | None) -> list[Row]:
    """A row for every figure of every method and model, with its difference to ours with the same model. A method that
    asks no model is compared with ours of the first model."""
    rows: list[Row] = []
    for method, model in methods_and_models(objects):
        for figure in figures:
            own = values_of(objects, method, model, figure)
            found = estimate(array_of(own), figure.statistic) if method not in figure.given else NO_ESTIMATE
            compared = model if model != NO_MODEL else next(iter(models_of(objects)), NO_MODEL)
            ours = values_of(objects, OURS, compared, figure)
            apart = NO_ESTIMATE if method in (OURS, *figure.given) else _difference(own, ours, figure)
            said = stated(subset, method, figure.key)
            row = {"method": method.value, "model": model, "figure": figure.key, "unit": figure.unit, **asdict(found)}
            row |= {"difference": apart.value, "difference_low": apart.low, "difference_high": apart.high}
            row |= {"n_paired": None if method is OURS else apart.n, "first": False}
            row |= {"paper": said.value if said else None, "paper_spread": said.spread if said else None}
            rows.append(row)
    return [row | {"first": _is_first(row, rows, figures)} for row in rows]


def methods_and_models(objects: pd.DataFrame) -> list[tuple[Method, str]]:
    """Method and model of every run, in the objects' order."""
    return [(Method(m), str(model)) for m, model in objects[["method", "model"]].drop_duplicates().to_numpy()]


def models_of(objects: pd.DataFrame) -> list[str]:
    """The models that were asked, in the objects' order."""
    return [str(model) for model in objects["model"].unique() if model != NO_MODEL]


def values_of(objects: pd.DataFrame, method: Method, model: str, figure: FigureSpec) -> "pd.Series[float]":
    """A figure's values by asset."""
    rows = objects[(objects["method"] == method.value) & (objects["model"] == model)]
    return pd.Series(figure.values(rows), index=rows["asset_id"].to_numpy(), dtype="float64")


def array_of(values: "pd.Series[float]") -> Array:
    """(n,) the values of a series."""
    return np.asarray(values, dtype=np.float64)


def _difference(own: "pd.Series[float]", ours: "pd.Series[float]", figure: FigureSpec) -> Estimate:
    both = own.index.intersection(ours.index)
    return paired_difference(array_of(own.loc[both]), array_of(ours.loc[both]), figure.statistic)


def _is_first(row: Row, rows: Sequence[Row], figures: Sequence[FigureSpec]) -> bool:
    """Whether no method with the same model, or none, has a better value; False if unranked or without a value."""
    figure = next(item for item in figures if item.key == row["figure"])
    own = row["value"]
    if not isinstance(own, float) or not figure.ranked:
        return False
    models = {row["model"], NO_MODEL} if row["model"] != NO_MODEL else {str(other["model"]) for other in rows}
    sign = 1.0 if figure.higher_is_better else -1.0
    others = [other["value"] for other in rows if other["figure"] == figure.key and other["model"] in models]
    return all(sign * (other - own) <= RTOL * max(1.0, abs(own)) for other in others if isinstance(other, float))


def failure_rows(objects: pd.DataFrame) -> list[Row]:
    """A row for every outcome of every method and model, in the order of ``OUTCOMES``."""
    rows: list[Row] = []
    for method, model in methods_and_models(objects):
        own = objects[(objects["method"] == method.value) & (objects["model"] == model)]
        ended = np.where(own["ok"], OK, own["paper_failure_mode"].fillna(NO_PAPER_MODE))
        for outcome in OUTCOMES:
            modes = Counter(str(mode) for mode in own.loc[ended == outcome, "failure_mode"])
            count = int((ended == outcome).sum())
            row: Row = {"method": method.value, "model": model, "outcome": outcome, "assets": count}
            row["share_percent"] = 100.0 * count / len(own)
            row["failure_modes"] = json.dumps(dict(modes.most_common()) if outcome != OK else {})
            rows.append(row)
    return rows


def growth_rows(objects: pd.DataFrame) -> list[Row]:
    """Success and scale error by error level, for every method; those that ask no model have the same at all levels.
    Empty where fewer than two levels were run."""
    levels: dict[float, list[str]] = {}
    for model in models_of(objects):
        if (level := level_of(model)) is not None:
            levels.setdefault(level, []).append(model)
    if len(levels) < 2:
        return []
    figures = [figure for figure in (*SUCCESS, *STABILITY) if figure.key in ("success", "scale")]
    rows: list[Row] = []
    for method in dict.fromkeys(method for method, _ in methods_and_models(objects)):
        for level, models in sorted(levels.items()):
            # Draws of the same level count as more objects.
            asked = [NO_MODEL] if (method, NO_MODEL) in methods_and_models(objects) else models
            for figure in figures:
                if method in figure.given:
                    continue
                draws = [array_of(values_of(objects, method, model, figure)) for model in asked]
                found = estimate(np.concatenate(draws), figure.statistic)
                row = {"method": method.value, "level": level, "figure": figure.key, "unit": figure.unit}
                rows.append({**row, **asdict(found)})
    return rows
