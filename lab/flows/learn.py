"""A robot learns to use refined objects: the study of trainings as a flow, its tables, and its page."""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pandas as pd

from asset2sim.catalog.text import output
from lab.flows.in_flow import in_flow
from lab.judged.published import published_learning
from lab.judged.variant_folders import variant_folders
from lab.learning.lesson import Point
from lab.learning.show_learning import described, draw_curves, learning_block
from lab.learning.study import Training, TrainingChoice, check_libraries, learning_study, trainings_left, trainings_of
from lab.options import LearnOptions
from lab.pages.blocks import check_page, write_block
from lab.runner import latest_own, require_one_done, run_study, telling
from lab.schemas.settings import warp_settings
from lab.schemas.tables import LEARNING, LEARNING_CURVES
from schemas.errors import UsageError
from schemas.location import Location
from schemas.settings import Settings
from schemas.table import Row

BLOCK, PICTURE = "learn", "learning_curves.svg"
"""Name of the page's block, and of the picture beside the page."""


def learn(options: LearnOptions, settings: Settings) -> None:
    """Train on these outputs' objects and print what became of it. Raises UsageError where a library is missing, for an
    output without a catalog, where nothing is chosen, and for a page without the block's markers; StudyError, once all
    is stored, where every training failed."""
    check_libraries(warp=options.warp is not None)
    if options.page is not None:
        check_page(options.page, BLOCK)
    published = published_learning(options.published) if options.published is not None else None
    for out in (*options.outs, Location(options.out)):
        if out.is_url:
            raise UsageError(f"{out}: a robot learns with objects in a folder; fetch the output first")
    chosen = TrainingChoice(
        options.tasks, options.assets, options.methods, options.seeds, options.budget, options.minutes, options.film
    )
    if options.warp is not None:
        chosen = replace(chosen, ppo=warp_settings(options.warp))
    todo = [item for data in variant_folders(options.outs) for item in trainings_of(Path(data), options.out, chosen)]
    if not todo:
        raise UsageError("no refined object of these outputs has a joint and is of these tasks, methods and assets")
    left = trainings_left(todo, heard, options.force)
    if len(left) < len(todo):
        sys.stderr.write(f"{len(todo) - len(left)} of {len(todo)} trainings have ended before; --force begins anew\n")
    done: list[Row] = []
    if left:
        study = learning_study(heard)
        in_flow(study.name, lambda: run_study(study, left, settings.run, telling(done)))
    rows, curves = (of_these(latest_own([options.out], table), todo) for table in (LEARNING, LEARNING_CURVES))
    for part in described(rows):
        output().print(part)
    if options.page is not None:
        write_block(options.page, BLOCK, learning_block(rows, published))
        draw_curves(curves, options.page.with_name(PICTURE))
    require_one_done(done, "trainings")


def heard(item: Training, point: Point) -> None:
    """A line about a checkpoint, on standard error."""
    lesson = item.lesson
    sys.stderr.write(
        f"{lesson.task.name} ({lesson.folder.name}) {item.method} seed {lesson.seed}: {point.steps} actions, "
        f"S {point.s:.2f}, {point.success:.0%} done, {point.fps:.0f} actions/s, {point.seconds:.0f} s\n"
    )


def of_these(rows: pd.DataFrame, todo: Sequence[Training]) -> pd.DataFrame:
    """The rows of these trainings."""
    names = list(todo[0].who)
    wanted = {tuple(item.who.values()) for item in todo}
    return rows[[key in wanted for key in rows[names].itertuples(index=False, name=None)]].reset_index(drop=True)
