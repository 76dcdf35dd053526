"""The bench's tables in Markdown. Pure."""

from collections.abc import Sequence

from asset2sim.bench.figures import Figure, figures
from asset2sim.bench.measured import Measured
from asset2sim.bench.stages import Part, parts

NOTHING = "–"
MET = {True: "yes", False: "**no**", None: NOTHING}


def bench_markdown(found: Measured) -> str:
    """Everything: on what machine, the figures, and where the time goes with one worker."""
    text = f"Measured on {found.machine}.\n\n{figure_table(figures(found))}\n"
    if found.one is not None and found.stages:
        text += f"\nWhere the time of {found.one.assets} objects goes with one worker:\n\n"
        text += f"{part_table(parts(found.one, found.stages))}\n"
    return text


def figure_table(lines: Sequence[Figure]) -> str:
    """A line a figure."""
    rows = [(line.name, line.target or NOTHING, line.measured, MET[line.met]) for line in lines]
    return _table(("figure", "target", "measured", "met"), rows, "llll")


def part_table(lines: Sequence[Part]) -> str:
    """A line a part of a run's time."""
    rows = [
        (
            line.name,
            f"{line.seconds:.2f}",
            NOTHING if line.share is None else f"{100.0 * line.share:.1f} %",
            NOTHING if line.median_s is None else f"{1000.0 * line.median_s:.0f}",
        )
        for line in lines
    ]
    return _table(("where", "s in all", "of the run", "ms an asset (median)"), rows, "lrrr")


def _table(headings: Sequence[str], rows: Sequence[Sequence[str]], sides: str) -> str:
    rule = ["---:" if side == "r" else "---" for side in sides]
    lines = [headings, rule, *(tuple(_cell(text) for text in row) for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")
