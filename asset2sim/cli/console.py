"""Where commands write to."""

from rich.console import Console

WIDE = 120
"""Columns where there is no terminal to ask: the tables must not be folded in a log."""


def output() -> Console:
    """Standard output: as wide as the terminal, or ``WIDE`` columns in a file or a pipe."""
    console = Console(highlight=False)
    return console if console.is_terminal else Console(highlight=False, width=WIDE)
