"""The failure-mode bar chart."""

from collections.abc import Sequence
from pathlib import Path

from asset2sim.catalog.figures import failure_counts
from schemas.asset import AssetRecord
from schemas.vocabulary import PAPER_FAILURE_MODES, FailureMode, Status

_OK = "#2f7d5b"
_FAILED = "#c8553d"
_GREY = "#6b6b6b"


def failure_chart(records: Sequence[AssetRecord], path: Path, title: str = "How the assets ended") -> Path:
    """Writes a PNG with a bar for the assets that passed and one for each failure mode, the most frequent on top."""
    # Imported late: it takes most of a second, and only the flow's last step draws. Figure needs no display.
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    total = len(records)
    ok = sum(record.status is Status.OK for record in records)
    modes = sorted(failure_counts(records).items(), key=lambda item: -item[1])
    labels = ["ok", *(_label(mode) for mode, _ in modes)]
    counts = [ok, *(count for _, count in modes)]

    figure = Figure(figsize=(9.0, 0.9 + 0.42 * len(labels)), dpi=150, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.barh(labels, counts, color=[_OK] + [_FAILED] * len(modes), height=0.68)
    for position, count in enumerate(counts):
        share = f"{count}  ({100.0 * count / total:.1f} %)" if count else "0"
        axes.annotate(
            share,
            (count, position),
            xytext=(5, 0),
            textcoords="offset points",
            va="center",
            fontsize=9,
            color="black" if count else _GREY,
        )
    axes.invert_yaxis()
    axes.set_xlim(0, max(1.0, 1.18 * max(counts)))
    axes.set_xlabel("assets", color=_GREY)
    axes.set_title(title, loc="left", fontsize=11, fontweight="bold")
    axes.tick_params(axis="y", length=0, labelsize=8.5)
    axes.tick_params(axis="x", colors=_GREY)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid(axis="x", color="#dddddd", linewidth=0.8)
    axes.set_axisbelow(True)
    axes.spines[["top", "right", "left"]].set_visible(False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)
    return path


def _label(mode: FailureMode) -> str:
    return f"{mode.value.replace('_', ' ')}\n({PAPER_FAILURE_MODES[mode]})"
