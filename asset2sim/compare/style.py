"""How the comparison's charts look: one colour for each method and outcome, told apart by the colour-blind too."""

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from schemas.vocabulary import Method

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

METHOD_COLOURS: dict[Method, str] = {
    Method.ASSET2SIM: "#0072B2",
    Method.NO_SEMANTICS: "#56B4E9",
    Method.DIRECT: "#D55E00",
    Method.IVW: "#E69F00",
    Method.AGENT: "#CC79A7",
    Method.REFERENCE: "#009E73",
    Method.RAW: "#7F7F7F",
}
"""Okabe and Ito's palette; ours is the darkest blue."""
METHOD_DASHES: dict[Method, str | tuple[int, tuple[int, ...]]] = {
    Method.ASSET2SIM: "-",
    Method.NO_SEMANTICS: (0, (5, 1)),
    Method.DIRECT: "-",
    Method.IVW: (0, (5, 1)),
    Method.AGENT: (0, (3, 1, 1, 1)),
    Method.REFERENCE: (0, (1, 1)),
    Method.RAW: (0, (1, 1)),
}
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
    """No frame, no ticks, and a light grid along one axis."""
    axes.spines[["top", "right", "left", "bottom"]].set_visible(False)
    axes.tick_params(length=0, labelsize=9, colors=INK)
    axes.grid(axis=grid, color=RULE, linewidth=0.8)
    axes.set_axisbelow(True)


def save(figure: "Figure", path: Path) -> Path:
    """Write the picture."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)
    return path
