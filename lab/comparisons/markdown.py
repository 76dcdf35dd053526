"""The comparison's tables as Markdown, for the report and the documentation."""

from collections.abc import Mapping, Sequence

import pandas as pd

from asset2sim.baselines.declared_method import known_methods
from asset2sim.catalog.text import NOTHING, markdown_table
from lab.comparisons.comparison_rows import OK, OURS, OUTCOMES, array_of
from lab.comparisons.figure_specs import NINE_SUBSET, STABILITY, SUCCESS, FigureSpec
from lab.comparisons.meaning import HEADINGS, met_cells
from lab.comparisons.method_runs import METHODS, NO_MODEL
from lab.comparisons.statistics import agreement
from schemas.model_names import described, is_prior
from schemas.table import Row
from schemas.vocabulary import Method

MINUS = "−"
MIN_SIGNIFICANT_OBJECTS = 5
"""Least objects for marking a difference as significant: a bootstrap over fewer is unreliable."""
NAMES = {method: item.name for method, item in known_methods().items()}
"""What the tables and charts call each method."""
SCRIPTED = "scripted agent"
"""What they call the agent whose policy is a program of ours, since no model was asked."""


def name_of(method: Method, model: str) -> str:
    """Name of a method in the tables and charts of a model."""
    return SCRIPTED if method is Method.AGENT and is_prior(model) else NAMES[method]


def stability_tables(rows: Sequence[Row], model: str) -> str:
    """Table 1 of one model, the paper's figures beside ours, and the paired differences to ours."""
    title = "Paired differences to ours, over the same objects (95 %):"
    return f"{figure_table(rows, STABILITY, model)}\n\n{title}\n\n{difference_table(rows, STABILITY, model)}"


def figure_table(rows: Sequence[Row], figures: Sequence[FigureSpec], model: str) -> str:
    """A row per method: value, 95 % interval, and the paper's figure in small; ours in bold where it is first."""
    lines = [
        [_name(method, model), *(_cell(_find(rows, method, model, figure), figure, method) for figure in figures)]
        for method in _methods(rows, model)
    ]
    return _table([figure.heading for figure in figures], lines)


def difference_table(rows: Sequence[Row], figures: Sequence[FigureSpec], model: str) -> str:
    """A row per other method: its figure less ours, with the interval; bold where significant, over enough objects."""
    lines = [
        [
            name_of(method, model),
            *(_difference(_find(rows, method, model, figure), figure.digits) for figure in figures),
        ]
        for method in _methods(rows, model)
        if method is not OURS
    ]
    return _table([figure.heading for figure in figures], lines)


def meaning_table(objects: pd.DataFrame, model: str) -> str:
    """How many sizes and asked joints each method has as readers expect; "" without written expectations."""
    own = objects[objects["model"].isin([model, NO_MODEL]) & objects["joints_asked"].notna()]
    if own.empty:
        return ""
    there = set(own["method"])
    lines = [[_name(m, model), *met_cells(own[own["method"] == m.value])] for m in METHODS if m.value in there]
    return markdown_table(HEADINGS, lines, right=range(1, len(HEADINGS)))


def failure_table(rows: Sequence[Row], success: Sequence[Row], model: str) -> str:
    """Table 6 of one model: share of assets that passed, and the share with each of the paper's failure modes, %."""
    bad = [outcome for outcome in OUTCOMES if outcome != OK]
    lines = []
    for method in _methods(success, model):
        cells = [_cell(_find(success, method, model, figure), figure, method) for figure in SUCCESS]
        own = {row["outcome"]: row for row in rows if row["method"] == method.value and _asked(row, model)}
        shares = [_number(own[outcome]["share_percent"], 1) if outcome in own else NOTHING for outcome in bad]
        lines.append([_name(method, model), *cells, *(share if share != "0.0" else "0" for share in shares)])
    return _table([*(figure.heading for figure in SUCCESS), *(f"{outcome} %" for outcome in bad)], lines)


def agreement_sentences(objects: pd.DataFrame) -> list[str]:
    """Mean difference and correlations of rubric's and judge's scores over all runs; empty without a judge."""
    found = agreement(array_of(objects["alignment"]), array_of(objects["judged"]))
    if found is None:
        return []
    text = f"Rubric and judge differ by {found.mean_absolute_difference:.2f} on average over {found.n} assets"
    if found.pearson is not None and found.kendall is not None:
        text += f" (Pearson {found.pearson:.2f}, Kendall's τ {found.kendall:.2f})"
    return [f"{text}."]


def notes(model: str, subset: str | None, objects: int, engines: str) -> str:
    """Caption of one model's tables: model, objects, engines, and how to read the numbers."""
    paper = "the paper's nine objects (its Table 1)" if subset == NINE_SUBSET else "the paper's large set (its Table 6)"
    return (
        f"Model: {described(model)}. {objects} objects, verified in {engines}. In brackets 95 % bootstrap intervals "
        f"over objects; small print is the paper's figure, over {paper}. Ours is bold where no method is better."
    )


def fewer_objects(objects: pd.DataFrame) -> str:
    """A sentence on methods that have fewer objects than were compared; "" where none has."""
    count = objects["asset_id"].nunique()
    own = objects.groupby("method")["asset_id"].nunique()
    parts = [f"{NAMES[Method(str(method))]} {size}" for method, size in own.items() if size < count]
    return f" Objects for which no expert chose anything are left out: {', '.join(parts)} of {count}." if parts else ""


def by_model(rows: Sequence[Row]) -> Mapping[str, list[Row]]:
    """Model → its rows and those of methods without a model."""
    models = dict.fromkeys(str(row["model"]) for row in rows if row["model"] != NO_MODEL)
    return {model: [row for row in rows if _asked(row, model)] for model in models or (NO_MODEL,)}


def _asked(row: Row, model: str) -> bool:
    return row["model"] in (model, NO_MODEL)


def _methods(rows: Sequence[Row], model: str) -> list[Method]:
    there = {row["method"] for row in rows if _asked(row, model)}
    return [method for method in METHODS if method.value in there]


def _find(rows: Sequence[Row], method: Method, model: str, figure: FigureSpec) -> Row:
    for row in rows:
        if row["method"] == method.value and row["figure"] == figure.key and _asked(row, model):
            return row
    return {}


def _cell(row: Row, figure: FigureSpec, method: Method) -> str:
    value = _number(row.get("value"), figure.digits)
    shown = f"**{value}**" if method is OURS and row.get("first") else value
    cell = shown + (_interval(row.get("low"), row.get("high"), figure.digits) if value != NOTHING else "")
    if row.get("paper") is None:
        return cell
    spread = f" ± {row['paper_spread']:g}" if row.get("paper_spread") is not None else ""
    return f"{cell}<br><sub>paper {row['paper']:g}{spread}</sub>"


def _difference(row: Row, digits: int) -> str:
    value, low, high = (row.get(name) for name in ("difference", "difference_low", "difference_high"))
    enough = isinstance(row.get("n_paired"), int) and int(str(row["n_paired"])) >= MIN_SIGNIFICANT_OBJECTS
    sure = enough and isinstance(low, float) and isinstance(high, float) and (low > 0.0 or high < 0.0)
    plus = "+" if isinstance(value, float) and round(value, digits) > 0.0 else ""
    shown = plus + _number(value, digits)
    return (f"**{shown}**" if sure else shown) + _interval(low, high, digits)


def _interval(low: object, high: object, digits: int) -> str:
    if low is None or high is None:
        return ""
    return f"<br><sub>[{_number(low, digits)}, {_number(high, digits)}]</sub>"


def _number(value: object, digits: int) -> str:
    """A number with fixed decimals, so that a column can be compared; an exponent where it would be too wide."""
    if not isinstance(value, int | float):
        return NOTHING
    if value != 0.0 and abs(value) >= 1e6:
        return f"{value:.1e}"
    rounded = round(float(value), digits)
    return f"{rounded if rounded else 0.0:,.{digits}f}".replace(",", "\u202f").replace("-", MINUS)


def _name(method: Method, model: str) -> str:
    return f"**{NAMES[method]}**" if method is OURS else name_of(method, model)


def _table(headings: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    return markdown_table(["method", *headings], lines, right=range(1, len(headings) + 1))
