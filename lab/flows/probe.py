"""Trials of a policy with refined objects, as a flow: on Dask, a child each, and the table of probe trials."""

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pandas as pd
from prefect import flow

from asset2sim.catalog.text import output
from flows.server.client import use_server
from flows.server.server import temporary_server
from lab.judged.probe_tables import short_block
from lab.judged.published import published_rates
from lab.judged.show_fidelity import describe_probes, fidelity_block, real_rates
from lab.judged.variant_folders import variant_folders
from lab.options.trial_options import ProbeOptions
from lab.pages.blocks import check_page, write_block
from lab.probes.cloning import FIRST_SEED
from lab.probes.kept_trials import latest_probes
from lab.probes.policies import CLONED, check_installed, policy_spec
from lab.probes.probe_study import ProbeChoice, ProbeJob, chosen_tasks, jobs_of, left_to_do, run_probes
from lab.schemas.probe_settings import ProbeSettings
from schemas.errors import UsageError
from schemas.settings import RunSettings
from schemas.table import Row

BLOCK = "probe"
"""Name of the page's block."""


def probe(options: ProbeOptions, run: RunSettings) -> None:
    """Do the trials that have no result yet and print what all of these outputs' say. Raises UsageError for an output
    without a catalog or a refined object that has one of the tasks, a policy that is none, and a page without the
    block's markers."""
    spec = policy_spec(options.policy, options.name, options.actions, options.camera, options.network)
    check_installed(spec)
    if spec.name == CLONED and options.seed + options.trials > FIRST_SEED:
        raise UsageError(f"a clone has seen the starts from seed {FIRST_SEED} on: choose seeds below")
    folders = [Path(folder) for folder in variant_folders(options.folders())]
    tasks = chosen_tasks(options.tasks)
    choice = ProbeChoice(tasks, options.assets, [*options.methods], options.trials, options.seed)
    # A folder without them is said before the trials.
    rates = published_rates(options.published) if options.published is not None else None
    real = real_rates(options.published)
    pages: list[tuple[Path | None, Callable[[pd.DataFrame], str]]] = [
        (options.page, lambda trials: fidelity_block(trials, real)),
        (options.readme, lambda trials: short_block(trials, rates)),
    ]
    for page, _ in pages:
        if page is not None:
            check_page(page, BLOCK)
    jobs = jobs_of(folders, spec, choice)
    todo = jobs if options.force else left_to_do(jobs)
    if len(todo) < len(jobs):
        sys.stderr.write(f"{len(jobs) - len(todo)} of {len(jobs)} trials have a result; --force does them again\n")
    if todo:
        with temporary_server() as address, use_server(address):
            run_probe_trials(todo, run)
    trials = latest_probes(folders)
    for part in describe_probes(trials, real):
        output().print(part)
    for page, block in pages:
        if page is not None:
            write_block(page, BLOCK, block(trials))


@flow(name="probe", persist_result=False, validate_parameters=False)
def run_probe_trials(jobs: Sequence[ProbeJob], run: RunSettings) -> int:
    """Do every trial and store its row; how many were left undone because nobody answered."""
    left = run_probes(jobs, run, ProbeSettings(), tell)
    if left:
        sys.stderr.write(f"nobody answers for {jobs[0].spec.name}: {left} trials are left for the next run\n")
    return left


def tell(row: Row, left: int) -> None:
    """A line about a trial that has ended, on standard error."""
    what = f"{row['policy']} {row['method']} {row['task']} ({row['asset_id']}), trial {row['trial']}"
    why = f": {row['reason']}" if row["reason"] else ""
    sys.stderr.write(f"{what}: {row['outcome']}{why}; {left} left\n")
