"""What commands print: the console that they write to, and numbers as people read them."""

import math

from rich.console import Console

NOTHING = "–"
"""Placeholder for a missing value."""
WIDE = 120
"""Columns where there is no terminal to ask: the tables must not be folded in a log."""


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


def vector(values: tuple[object, ...], digits: int = 3) -> str:
    """Numbers in brackets."""
    return "(" + ", ".join(number(value, digits=digits) for value in values) + ")"
