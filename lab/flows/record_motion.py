"""Recorded interactions of refined objects: the study of trials as a flow, its table, and its pages."""

from pathlib import Path

from asset2sim.catalog.own_files import latest_own
from asset2sim.catalog.text import output
from asset2sim.experiments.study import require_one_done, run_study, telling
from asset2sim.gym.arm.gripper import ROBOTIQ
from asset2sim.gym.arm.robotiq import robotiq_file
from lab.flows.in_flow import in_flow
from lab.judged.variant_folders import variant_folders
from lab.options.trial_options import RecordMotionOptions
from lab.pages.blocks import Pages
from lab.schemas.tables_trials import TRIALS
from lab.trials.show_trials import described, trials_block
from lab.trials.study import STUDY, jobs_of
from schemas.settings import Settings
from schemas.table import Row

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
