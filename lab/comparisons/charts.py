"""The comparison's charts: outcomes of each method, and its success and scale error by the model's error level."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from asset2sim.baselines.declared_method import known_methods
from lab.comparisons.comparison_rows import OK, OURS, OUTCOMES
from lab.comparisons.markdown import name_of
from lab.comparisons.method_runs import METHODS, WITHOUT_MODEL
from lab.noise.noise_level import NOISY
from schemas.table import Row
from schemas.vocabulary import Method

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

METHOD_LINES = {method: (item.colour, item.dashes) for method, item in known_methods().items()}
"""Colour and dashes of each method's curve, in Okabe and Ito's palette; ours is the darkest blue."""
OUTCOME_COLOURS = ("#0072B2", "#F0E442", "#E69F00", "#D55E00", "#CC79A7", "#56B4E9", "#7F7F7F")
"""Colours of the outcomes in their order, ok first."""
INK, GREY, RULE = "#222222", "#5f5f5f", "#dddddd"
WIDTH_IN = 8.0
"""Width of a chart, inches: a README shows it 800 pixels wide, so that a point is 1.4 pixels."""
DPI = 200


def new_figure(height_in: float) -> "Figure":
    """An empty figure that needs no display."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH_IN, height_in), dpi=DPI, layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def plain(axes: "Axes", grid: Literal["both", "x", "y"]) -> None:
    """Remove the frame and ticks of the axes, and draw a light grid."""
    axes.spines[["top", "right", "left", "bottom"]].set_visible(False)
    axes.tick_params(length=0, labelsize=9, colors=INK)
    axes.grid(axis=grid, color=RULE, linewidth=0.8)
    axes.set_axisbelow(True)


def save(figure: "Figure", path: Path) -> Path:
    """Write the picture."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)
    return path


MIN_LABELLED_PERCENT = 4.0
"""Share, %, from which a piece of a bar is wide enough to hold its own number."""
LOG_SCALE_RATIO = 8.0
"""Ratio of the largest to the smallest value from which an axis is logarithmic."""


def failure_chart(rows: Sequence[Row], path: Path, title: str) -> Path:
    """Writes a PNG with a bar for each method of one model: shares of assets by outcome."""
    there = {row["method"] for row in rows}
    methods = [method for method in METHODS if method.value in there]
    figure = new_figure(1.45 + 0.40 * len(methods))
    axes = figure.add_subplot()
    used = [outcome for outcome in OUTCOMES if any(_share(rows, method, outcome) > 0.0 for method in methods)]
    lefts = np.zeros(len(methods))
    for outcome in used:
        shares = np.array([_share(rows, method, outcome) for method in methods])
        colour = OUTCOME_COLOURS[OUTCOMES.index(outcome)]
        bars = axes.barh(range(len(methods)), shares, 0.66, lefts, color=colour, edgecolor="white", label=outcome)
        for bar in bars:
            bar.set_linewidth(0.8)
        ink = "white" if outcome == OK or colour == "#D55E00" else INK
        axes.bar_label(bars, [_bar_label(share) for share in shares], label_type="center", fontsize=9, color=ink)
        lefts = lefts + shares
    names = {Method(str(row["method"])): name_of(Method(str(row["method"])), str(row["model"])) for row in rows}
    axes.set_yticks(range(len(methods)), [names[method] for method in methods])
    for label, method in zip(axes.get_yticklabels(), methods, strict=True):
        label.set_fontweight("bold" if method is OURS else "normal")
    axes.invert_yaxis()
    axes.set_xlim(0.0, 100.0)
    plain(axes, "x")
    axes.tick_params(axis="x", colors=GREY)
    axes.set_xlabel("share of assets, %", color=GREY, fontsize=9)
    figure.suptitle(title, x=0.01, ha="left", fontsize=11, fontweight="bold", color=INK)
    box = {"handlelength": 1.0, "handleheight": 1.0, "columnspacing": 1.6}
    figure.legend(loc="outside lower left", ncols=3, frameon=False, fontsize=9, **box)
    return save(figure, path)


def growth_chart(rows: Sequence[Row], path: Path, title: str) -> Path:
    """Writes a PNG of success and scale error by size of the model's errors: a curve and 95 % band a method."""
    figure = new_figure(4.3)
    left, right = figure.subplots(1, 2)
    _curves(left, [row for row in rows if row["figure"] == "success"])
    left.set_ylim(0.0, 102.0)
    left.set_title("assets that pass every test, %", loc="left", fontsize=9.5, color=INK)
    # A method without a model chooses no scale for the prompt: its error would only flatten the other curves.
    asking = [row for row in rows if row["figure"] == "scale" and not _needs_no_model(row)]
    _curves(right, asking)
    _from_zero_or_logarithmic(right, [_float(row["value"]) for row in asking if row["value"] is not None])
    right.set_title("scale off the experts', %", loc="left", fontsize=9.5, color=INK)
    for axes in (left, right):
        axes.set_xlabel("size of the model's errors", color=GREY, fontsize=9)
    figure.suptitle(title, x=0.01, ha="left", fontsize=11, fontweight="bold", color=INK)
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower left", ncols=4, frameon=False, fontsize=8.5)
    return save(figure, path)


def _curves(axes: "Axes", rows: Sequence[Row]) -> None:
    levels = sorted({_float(row["level"]) for row in rows})
    places = {level: place for place, level in enumerate(levels)}
    for method in METHODS:
        own = [row for row in rows if row["method"] == method.value and row["value"] is not None]
        if not own:
            continue
        x = [float(places[_float(row["level"])]) for row in own]
        values = [_float(row["value"]) for row in own]
        (colour, dashes), ours = METHOD_LINES[method], method is OURS
        (curve,) = axes.plot(x, values, color=colour, linestyle=dashes, linewidth=2.6 if ours else 1.5)
        curve.set_label(name_of(method, NOISY))
        curve.set_marker("" if _needs_no_model(own[0]) else "o")
        curve.set_markersize(4.5 if ours else 3.0)
        curve.set_zorder(4 if ours else 3)
        if all(row["low"] is not None for row in own) and not _needs_no_model(own[0]):
            low, high = [_float(row["low"]) for row in own], [_float(row["high"]) for row in own]
            axes.fill_between(x, low, high, color=colour, alpha=0.16 if ours else 0.09, linewidth=0)
    axes.set_xticks(range(len(levels)), [f"{level:g}" for level in levels])
    axes.set_xlim(-0.15, len(levels) - 0.85)
    plain(axes, "y")
    axes.tick_params(axis="both", colors=GREY)


def _from_zero_or_logarithmic(axes: "Axes", values: Sequence[float]) -> None:
    """Start the axis at zero, or make it logarithmic where the largest value would flatten the others."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    if not values or min(values) <= 0.0 or max(values) / min(values) < LOG_SCALE_RATIO:
        axes.set_ylim(bottom=0.0)
        return
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.minorticks_off()


def _needs_no_model(row: Row) -> bool:
    return Method(str(row["method"])) in WITHOUT_MODEL


def _share(rows: Sequence[Row], method: Method, outcome: str) -> float:
    found = [row for row in rows if row["method"] == method.value and row["outcome"] == outcome]
    return _float(found[0]["share_percent"]) if found else 0.0


def _float(value: object) -> float:
    assert isinstance(value, int | float)
    return float(value)


def _bar_label(share: float) -> str:
    if share < MIN_LABELLED_PERCENT:
        return ""
    return f"{share:.0f}" if share >= 10.0 or share == round(share) else f"{share:.1f}"
