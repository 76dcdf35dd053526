"""The comparison's tables as Markdown, for the report and the README."""

from collections.abc import Mapping, Sequence

import pandas as pd

from asset2sim.studies.methods.figure_specs import COST, NINE_SUBSET, STABILITY, SUCCESS, Figure
from asset2sim.studies.methods.method_runs import METHODS, NO_MODEL
from asset2sim.studies.methods.statistics import agreement
from asset2sim.studies.methods.comparison_rows import OK, OURS, OUTCOMES, Row, array_of
from schemas.model_names import described
from schemas.vocabulary import Method

DASH = "–"
MINUS = "−"
MIN_SIGNIFICANT_OBJECTS = 5
"""Least objects for marking a difference as significant: a bootstrap over fewer is unreliable."""
NAMES: dict[Method, str] = {
    Method.REFERENCE: "human reference",
    Method.IVW: "VLM-IVW",
    Method.DIRECT: "direct VLM",
    Method.ASSET2SIM: "ours",
    Method.AGENT: "coding agent",
    Method.NO_SEMANTICS: "ours, no semantics",
    Method.RAW: "as it came",
}
"""What the tables and charts call each method."""


def stability_lines(rows: Sequence[Row], model: str) -> list[str]:
    """Table 1 of one model, the paper's figures beside ours, and the paired differences to ours."""
    return [
        *figure_table(rows, STABILITY, model),
        "",
        "Paired differences to ours, over the same objects (95 %):",
        "",
        *difference_table(rows, STABILITY, model),
    ]


def figure_table(rows: Sequence[Row], figures: Sequence[Figure], model: str) -> list[str]:
    """A row per method: value, 95 % interval, and the paper's figure in small; ours in bold where it is first."""
    lines = _heading([figure.heading for figure in figures])
    for method in _methods(rows, model):
        cells = [_cell(_find(rows, method, model, figure), figure, method) for figure in figures]
        lines.append(_line([f"**{NAMES[method]}**" if method is OURS else NAMES[method], *cells]))
    return lines


def difference_table(rows: Sequence[Row], figures: Sequence[Figure], model: str) -> list[str]:
    """A row per other method: its figure less ours, with the interval; bold where that excludes zero and there are at
    least ``MIN_SIGNIFICANT_OBJECTS`` objects."""
    lines = _heading([figure.heading for figure in figures])
    for method in _methods(rows, model):
        if method is OURS:
            continue
        cells = []
        for figure in figures:
            row = _find(rows, method, model, figure)
            value, low, high = (row.get(name) for name in ("difference", "difference_low", "difference_high"))
            enough = isinstance(row.get("n_paired"), int) and int(str(row["n_paired"])) >= MIN_SIGNIFICANT_OBJECTS
            sure = enough and isinstance(low, float) and isinstance(high, float) and (low > 0.0 or high < 0.0)
            shown = _signed(value, figure.digits)
            cells.append((f"**{shown}**" if sure else shown) + _interval(low, high, figure.digits))
        lines.append(_line([NAMES[method], *cells]))
    return lines


def failure_table(rows: Sequence[Row], success: Sequence[Row], model: str) -> list[str]:
    """Table 6 of one model: share of assets that passed, and the share with each of the paper's failure modes, %."""
    bad = [outcome for outcome in OUTCOMES if outcome != OK]
    lines = _heading([*(figure.heading for figure in SUCCESS), *(f"{outcome} %" for outcome in bad)])
    for method in _methods(success, model):
        cells = [_cell(_find(success, method, model, figure), figure, method) for figure in SUCCESS]
        own = {row["outcome"]: row for row in rows if row["method"] == method.value and _asked(row, model)}
        shares = [_number(own[outcome]["share_percent"], 1) if outcome in own else DASH for outcome in bad]
        name = f"**{NAMES[method]}**" if method is OURS else NAMES[method]
        lines.append(_line([name, *cells, *(share if share != "0.0" else "0" for share in shares)]))
    return lines


def cost_table(rows: Sequence[Row], model: str) -> list[str]:
    """Table 7 of one model: what an asset costs on average."""
    return figure_table(rows, COST, model)


def agreement_lines(objects: pd.DataFrame) -> list[str]:
    """Mean difference and correlations of the rubric's and the judge's scores over all methods and models; empty
    without a judge."""
    found = agreement(array_of(objects["alignment"]), array_of(objects["judged"]))
    if found is None:
        return []
    text = f"Rubric and judge differ by {found.mean_absolute_difference:.2f} on average over {found.n} assets"
    if found.pearson is not None and found.kendall is not None:
        text += f" (Pearson {found.pearson:.2f}, Kendall's τ {found.kendall:.2f})"
    return [f"{text}."]


def notes(model: str, subset: str | None, objects: int, engines: str) -> list[str]:
    """Caption of one model's tables: model, objects, engines, and how to read the numbers."""
    paper = "the paper's nine objects (its Table 1)" if subset == NINE_SUBSET else "the paper's large set (its Table 6)"
    return [
        f"Model: {described(model)}. {objects} objects, judged in {engines}. In brackets 95 % bootstrap intervals over "
        f"objects; small print is the paper's figure, over {paper}. Ours is bold where no method is better.",
    ]


def by_model(rows: Sequence[Row]) -> Mapping[str, list[Row]]:
    """Model → its rows and those of methods without a model."""
    models = dict.fromkeys(str(row["model"]) for row in rows if row["model"] != NO_MODEL)
    return {model: [row for row in rows if _asked(row, model)] for model in models or (NO_MODEL,)}


def _asked(row: Row, model: str) -> bool:
    return row["model"] in (model, NO_MODEL)


def _methods(rows: Sequence[Row], model: str) -> list[Method]:
    there = {row["method"] for row in rows if _asked(row, model)}
    return [method for method in METHODS if method.value in there]


def _find(rows: Sequence[Row], method: Method, model: str, figure: Figure) -> Row:
    for row in rows:
        if row["method"] == method.value and row["figure"] == figure.key and _asked(row, model):
            return row
    return {}


def _cell(row: Row, figure: Figure, method: Method) -> str:
    value = _number(row.get("value"), figure.digits)
    shown = f"**{value}**" if method is OURS and row.get("first") else value
    cell = shown + (_interval(row.get("low"), row.get("high"), figure.digits) if value != DASH else "")
    if row.get("paper") is None:
        return cell
    spread = f" ± {_plain(row['paper_spread'])}" if row.get("paper_spread") is not None else ""
    return f"{cell}<br><sub>paper {_plain(row['paper'])}{spread}</sub>"


def _interval(low: object, high: object, digits: int) -> str:
    if low is None or high is None:
        return ""
    return f"<br><sub>[{_number(low, digits)}, {_number(high, digits)}]</sub>"


def _number(value: object, digits: int) -> str:
    """A number with fixed decimals, so that a column can be compared; an exponent where it would be too wide."""
    if not isinstance(value, int | float):
        return DASH
    if value != 0.0 and abs(value) >= 1e6:
        return f"{value:.1e}"
    rounded = round(float(value), digits)
    return f"{rounded if rounded else 0.0:,.{digits}f}".replace(",", "\u202f").replace("-", MINUS)


def _signed(value: object, digits: int) -> str:
    shown = _number(value, digits)
    return f"+{shown}" if isinstance(value, float) and round(value, digits) > 0.0 else shown


def _plain(value: object) -> str:
    return f"{value:g}"


def _heading(columns: Sequence[str]) -> list[str]:
    return [_line(["method", *columns]), "|" + "---|" + "---:|" * len(columns)]


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"
