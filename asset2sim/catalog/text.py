"""Numbers and tables for people, in Markdown and on the terminal, and the console that commands write to."""

import math
import re
from collections.abc import Collection, Iterable, Sequence

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

NOTHING = "–"
"""Placeholder for a missing value."""
WIDE = 120
"""Columns where there is no terminal to ask: the tables must not be folded in a log."""
_BAR = re.compile(r"(?<!\\)\|")
_BLANK = re.compile(r"[ \t\r\n]+")


def output() -> Console:
    """Standard output: as wide as the terminal, or ``WIDE`` columns in a file or a pipe."""
    console = Console(highlight=False)
    return console if console.is_terminal else Console(highlight=False, width=WIDE)


def number(value: object, unit: str = "", digits: int = 3) -> str:
    """A number to so many significant digits, without a needless exponent; ``NOTHING`` for None and NaN."""
    if not isinstance(value, int | float) or math.isnan(value):
        return NOTHING
    if isinstance(value, int) or (float(value).is_integer() and abs(value) < 10**digits):
        shown = f"{int(value)}"
    elif 1e-4 <= abs(value) < 1e6:
        decimals = max(0, digits - 1 - math.floor(math.log10(abs(value))))
        shown = f"{value:.{min(decimals, 6)}f}"
    else:
        shown = f"{value:.{digits - 1}e}"
    return f"{shown} {unit}" if unit else shown


def numbers(values: Iterable[object]) -> str:
    """Numbers in brackets."""
    return f"({', '.join(map(number, values))})"


def markdown_table(headings: Sequence[str], rows: Iterable[Sequence[str]], right: Collection[int] = ()) -> str:
    """Markdown table; ``right`` holds the indices of right-aligned columns. A cell becomes one line, and each ``|`` in
    it that has no backslash yet gets one."""
    rule = ["---:" if index in right else "---" for index in range(len(headings))]
    cells = [[_BAR.sub(r"\\|", _BLANK.sub(" ", cell).strip()) for cell in row] for row in rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in (headings, rule, *cells))


def percent(count: int, total: int) -> str:
    """A share, as "98.7 %"; "100 %" only where it is all of them, "0 %" only where it is none."""
    if count in (0, total):
        return "100 %" if count else "0 %"
    return f"{min(99.9, max(0.1, 100.0 * count / total)):.1f} %"


def titled_table(title: str) -> Table:
    """An empty table for the terminal, with a bold title on the left."""
    return Table(box=box.SIMPLE_HEAD, title=title, title_justify="left", title_style="bold")


def number_table(title: str, headings: Iterable[str], rows: Iterable[Iterable[object]], left: int) -> Table:
    """Table for the terminal whose first ``left`` columns are text and whose others are numbers. Cells of rich's
    ``Text`` keep their style; all others are shown literally."""
    table = titled_table(f"\n{title}")
    table.padding = (0, 1, 0, 0)
    for index, heading in enumerate(headings):
        table.add_column(heading, justify="left" if index < left else "right", overflow="fold")
    for row in rows:
        table.add_row(*(cell if isinstance(cell, Text) else escape(str(cell)) for cell in row))
    return table
