"""Trials for people: tables for the terminal and for the documentation."""

from collections.abc import Sequence

import pandas as pd
from rich.console import RenderableType

from asset2sim.catalog.text import markdown_table, number_table, titled_table
from lab.trials.figures import FAULTS, MethodTrials, method_figures, task_rows

HEADINGS = ("method", "tasks done", "score, of 5", "recorded", *FAULTS.values())


def described(trials: pd.DataFrame) -> list[RenderableType]:
    """A table of what became of each task, and one of the methods."""
    figures = method_figures(trials)
    table = titled_table("\nWhat became of each task")
    for heading in ("task", *names(figures)):
        table.add_column(heading, overflow="fold")
    for task, cells in task_rows(trials):
        table.add_row(task, *(cells.get((item.method, item.model), "") for item in figures))
    return [table, number_table("Physical judge", HEADINGS, rows_of(figures), 1)]


def trials_block(trials: pd.DataFrame) -> str:
    """The same two tables as Markdown."""
    figures = method_figures(trials)
    methods = markdown_table(HEADINGS, rows_of(figures), range(1, len(HEADINGS)))
    rows = [
        (task, *(cells.get((item.method, item.model), "") for item in figures)) for task, cells in task_rows(trials)
    ]
    return f"{methods}\n\n{markdown_table(('task', *names(figures)), rows)}"


def names(figures: Sequence[MethodTrials]) -> list[str]:
    """The methods, with their models where several were asked."""
    several = len({item.model for item in figures}) > 1
    return [f"{item.method}, {item.model}" if several else item.method for item in figures]


def rows_of(figures: Sequence[MethodTrials]) -> list[tuple[str, ...]]:
    """A row per method."""
    return [
        (name, f"{item.done} of {item.tasks}", f"{item.score:.2f}", f"{item.recorded}", *map(str, item.faults))
        for name, item in zip(names(figures), figures, strict=True)
    ]
