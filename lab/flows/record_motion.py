"""Recorded interactions of refined objects, as a flow: trials on Dask, a child each, and the table of trials."""

import sys
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from prefect import flow

from asset2sim.catalog.text import output
from asset2sim.gym.arm.gripper import ROBOTIQ
from asset2sim.gym.arm.robotiq import robotiq_file
from flows.server.client import use_server
from flows.server.server import temporary_server
from lab.judged.variant_folders import variant_folders
from lab.options.trial_options import RecordMotionOptions
from lab.pages.blocks import check_page, write_block
from lab.trials.show_trials import described, methods_block, trials_block
from lab.trials.study import jobs_of, latest_trials, run_trials
from schemas.settings import RunSettings
from schemas.table import Row

BLOCK = "judged"
"""Name of the pages' block."""


def record_motion(options: RecordMotionOptions, run: RunSettings) -> None:
    """Record the trials of these outputs' objects and print what became of them. Raises UsageError for an output
    without a catalog or refined objects, a page without the block's markers, and a gripper that is not installed."""
    if options.gripper == ROBOTIQ.name:
        robotiq_file()
    folders = [Path(folder) for folder in variant_folders(options.folders())]
    pages = [(options.page, trials_block), (options.readme, methods_block)]
    for page, _ in pages:
        if page is not None:
            check_page(page, BLOCK)
    with temporary_server() as address, use_server(address):
        trials = record_motions(folders, options.assets, run, options.film, options.gripper)
    for part in described(trials):
        output().print(part)
    for page, block in pages:
        if page is not None:
            write_block(page, BLOCK, block(trials))


@flow(name="record-motion", persist_result=False, validate_parameters=False)
def record_motions(
    outs: Sequence[Path], asset_ids: tuple[str, ...], run: RunSettings, filmed: bool, gripper: str
) -> pd.DataFrame:
    """Do every trial and store its row; the latest of each, those of earlier recordings included."""
    jobs = [job for out in outs for job in jobs_of(out, asset_ids, filmed, gripper)]
    run_trials(jobs, run, tell)
    return latest_trials(outs)


def tell(row: Row, left: int) -> None:
    """A line about a trial that has ended, on standard error."""
    why = f": {row['reason']}" if row["reason"] else ""
    sys.stderr.write(f"{row['method']} {row['task']} ({row['asset_id']}): {row['outcome']}{why}; {left} left\n")
