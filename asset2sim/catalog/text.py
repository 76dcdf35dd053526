"""Numbers and tables for people, in Markdown and on the terminal."""

import math
import re
from collections.abc import Collection, Iterable, Sequence

NOTHING = "–"
"""Placeholder for a missing value."""

_BAR = re.compile(r"(?<!\\)\|")


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


def vector(values: tuple[object, ...], digits: int = 3) -> str:
    """Numbers in brackets."""
    return "(" + ", ".join(number(value, digits=digits) for value in values) + ")"


def markdown_table(headings: Sequence[str], rows: Iterable[Sequence[str]], right: Collection[int] = ()) -> str:
    """Markdown table; ``right`` holds the indices of right-aligned columns.

    A cell becomes one line, and each ``|`` in it that has no backslash yet gets one.
    """
    rule = ["---:" if index in right else "---" for index in range(len(headings))]
    cells = [[_BAR.sub(r"\\|", " ".join(cell.split())) for cell in row] for row in rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in (headings, rule, *cells))
