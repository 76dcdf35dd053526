"""Recorded interactions of refined objects: the study of trials as a flow, its table, and its pages."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from rich.console import RenderableType

from asset2sim.catalog.text import markdown_table, number_table, output, titled_table
from asset2sim.gym.arm.gripper import ROBOTIQ, robotiq_file
from lab.flows.in_flow import in_flow
from lab.judged.variant_folders import variant_folders
from lab.options import RecordMotionOptions
from lab.pages.blocks import Pages
from lab.runner import latest_own, require_one_done, run_study, telling
from lab.schemas.tables import TRIALS
from lab.trials.figures import MethodTrials, method_figures, task_rows, variant_names
from lab.trials.physical_judge import FAULTS
from lab.trials.study import STUDY, jobs_of
from schemas.settings import Settings
from schemas.table import Row

HEADINGS = ("method", "tasks done", "score, of 5", "recorded", *(fault.heading for fault in FAULTS.values()))


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
    """Names of the figures' methods."""
    return list(variant_names([(item.method, item.model) for item in figures]).values())


def rows_of(figures: Sequence[MethodTrials]) -> list[tuple[str, ...]]:
    """A row per method."""
    return [
        (name, f"{item.done} of {item.tasks}", f"{item.score:.2f}", f"{item.recorded}", *map(str, item.faults))
        for name, item in zip(names(figures), figures, strict=True)
    ]


BLOCK = "judged"
"""Name of the pages' block."""


def record_motion(options: RecordMotionOptions, settings: Settings) -> None:
    """Record the trials of these outputs' objects and print what became of them. Raises UsageError for an output
    without a catalog or refined objects, a page without the block's markers, and a gripper that is not installed;
    StudyError, once all is stored, where every trial failed."""
    if options.gripper == ROBOTIQ.name:
        robotiq_file()
    folders = [Path(folder) for folder in variant_folders(options.folders())]
    pages = Pages(BLOCK, {options.page: trials_block})
    jobs = [job for out in folders for job in jobs_of(out, options.assets, options.film, options.gripper)]
    rows: list[Row] = []
    in_flow(STUDY.name, lambda: run_study(STUDY, jobs, settings.run, telling(rows)))
    trials = latest_own(folders, TRIALS)
    for part in described(trials):
        output().print(part)
    pages.write(trials)
    require_one_done(rows, "trials")
