"""The tables to read first: what each model and method makes of the same objects, and that beside the paper's own."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from asset2sim.catalog.text import NOTHING, markdown_table
from lab.comparisons.comparison_rows import OURS
from lab.comparisons.figure_specs import COST, NINE_SUBSET, STABILITY, TABLE_1, TABLE_6, TABLE_7, FigureSpec, Stated
from lab.comparisons.markdown import name_of
from lab.comparisons.meaning import met_cells
from lab.comparisons.method_runs import METHODS, NO_MODEL
from lab.comparisons.statistics import mean_not_zero
from schemas.model_names import described
from schemas.vocabulary import Method

FIRST = "first"
"""Name of the page's block."""
HEADINGS = ("method", "model", "ok", "paper's tests", "sizes as expected", "asked joints at the start", "at rest")
PAPERS_KEYS = ("penetration_nonzero", "drift", "oscillation", "scale", "joint", "alignment", "calls")
PAPERS = tuple(figure for figure in (*STABILITY, *COST) if figure.key in PAPERS_KEYS)
"""Figures that the paper's Tables 1, 6 and 7 have."""
PAPERS_MODEL = "Gemini 2.5 Flash"
"""The model that the paper asked; that of its coding agent it does not name."""


def first_table(objects: pd.DataFrame, subset: str | None, engines: str) -> str:
    """Markdown: a row for each method and model of a comparison's objects, and where these are the nine of the paper's
    Table 1 their figures beside the paper's. ``engines`` names where the objects were verified."""
    runs = [
        (method, model, own)
        for method in METHODS
        for model in map(str, objects["model"].unique())
        if not (own := objects[(objects["method"] == method.value) & (objects["model"] == model)]).empty
    ]
    count = int(objects["asset_id"].nunique())
    said = (
        f"{count} objects, verified in {engines}. *As expected*: by readers of prompt and picture, who wrote it down "
        "before any result (`expectations.csv`); *at rest* counts where joints ended, in every engine."
    )
    lines = [[*_asked(method, model), *_outcomes(own)] for method, model, own in runs]
    table = markdown_table(HEADINGS, lines, right=range(2, len(HEADINGS)))
    return "\n\n".join([said, table, *(_beside_the_papers(runs) if subset == NINE_SUBSET else ())])


def _asked(method: Method, model: str) -> tuple[str, str]:
    return name_of(method, model), NOTHING if model == NO_MODEL else described(model)


def _outcomes(own: pd.DataFrame) -> list[str]:
    cells = met_cells(own) if own["joints_asked"].notna().any() else [NOTHING] * 3
    return [f"{int(own['ok'].sum())} of {len(own)}", str(int(own["paper_tests_pass"].sum())), *cells[:3]]


def _beside_the_papers(runs: list[tuple[Method, str, pd.DataFrame]]) -> tuple[str, str]:
    """A caption and its table: the nine's figures as the paper has them, and the paper's."""
    lines = [[*_asked(method, model), *_figures(method, own)] for method, model, own in runs]
    lines += [_papers(method, TABLE_1, "the paper") for method in METHODS if method in TABLE_1]
    lines += [_papers(method, TABLE_6, "the paper's 80 of 93") for method in METHODS if method in TABLE_6]
    ours = [own for method, _, own in runs if method is OURS]
    worse = [figure.heading for figure in PAPERS if any(_is_worse(figure, own) for own in ours)]
    said = (
        "The same nine beside the paper's Tables 1, 6 (its large set) and 7. Φ is the mean over the objects that "
        "overlap, *of* how many, the paper's over its stapler and toilet; it is taken on hulls that were cut where our "
        "rules complete a method (ours and the constant), else on authored ones. Scale and joint are *of* the objects "
        "for which an expert chose one. Alignment is ours by what readers expect, all or nothing, the paper's with "
        "credit for what is near. **Bold** is what is worse in ours, with any of these models, than in the paper's "
        f"own: {'; '.join(worse) or 'nothing'}."
    )
    headings = ("method", "model", *(figure.heading for figure in PAPERS))
    return said, markdown_table(headings, lines, right=range(2, len(headings)))


def _figures(method: Method, own: pd.DataFrame) -> list[str]:
    cells = []
    for figure in PAPERS:
        value, n = _value(figure, own)
        shown = NOTHING if value is None or method in figure.given else f"{value:.{figure.digits}f}"
        if shown != NOTHING and (n < len(own) or figure.statistic is mean_not_zero):
            shown = f"{shown} of {n}" if n else "0"
        cells.append(f"**{shown}**" if method is OURS and _is_worse(figure, own) else shown)
    return cells


def _value(figure: FigureSpec, own: pd.DataFrame) -> tuple[float | None, int]:
    """A figure of one run, None where nothing was measured, and over how many objects it is."""
    values = figure.values(own)
    kept = values[np.isfinite(values)]
    n = int(np.count_nonzero(kept > 0.0)) if figure.statistic is mean_not_zero else len(kept)
    return (float(figure.statistic(kept)) if len(kept) else None), n


def _is_worse(figure: FigureSpec, own: pd.DataFrame) -> bool:
    """Whether ours is worse than what the paper states of its own method, in the digits that are shown."""
    value, stated = _value(figure, own)[0], _stated(Method.ASSET2SIM, TABLE_1).get(figure.key)
    if value is None or stated is None:
        return False
    sign = 1.0 if figure.higher_is_better else -1.0
    return sign * (round(stated.value, figure.digits) - round(value, figure.digits)) > 0.0


def _stated(method: Method, table: Mapping[Method, Mapping[str, Stated]]) -> dict[str, Stated]:
    """The paper's figures of a method, its calls an asset (Table 7) with those of Table 1."""
    return {**table[method], **(TABLE_7.get(method, {}) if table is TABLE_1 else {})}


def _papers(method: Method, table: Mapping[Method, Mapping[str, Stated]], whose: str) -> list[str]:
    """A row of the paper's own figures, with the model that it names."""
    own = _stated(method, table)
    cells = [f"{own[figure.key].value:.{figure.digits}f}" if figure.key in own else NOTHING for figure in PAPERS]
    asked = NOTHING if method in (Method.REFERENCE, Method.AGENT) else PAPERS_MODEL
    return [f"{name_of(method, PAPERS_MODEL)}, {whose}", asked, *cells]
