"""Trials of a policy with refined objects: the study of them as a flow, its table, and its pages."""

import sys
from pathlib import Path

import pandas as pd

from asset2sim.catalog.text import output
from asset2sim.gym.arm.gripper import ROBOTIQ, robotiq_file
from lab.flows.in_flow import in_flow
from lab.judged.published import published_rates
from lab.judged.show_fidelity import describe_probes, fidelity_block, real_rates, short_block
from lab.judged.variant_folders import variant_folders
from lab.options import ProbeOptions
from lab.pages.blocks import Pages
from lab.probes.cloning import FIRST_SEED
from lab.probes.policies import CLONED, check_installed, policy_spec
from lab.probes.probe_study import ProbeChoice, chosen_tasks, jobs_of, probe_study, run_probes
from lab.runner import StudyError, latest_own, left_to_do, require_one_done, telling
from lab.schemas.settings import ProbeSettings
from lab.schemas.tables import PROBE_TRIALS
from schemas.errors import UsageError
from schemas.settings import Settings
from schemas.table import Row

BLOCK = "probe"
"""Name of the page's block."""


def probe(options: ProbeOptions, settings: Settings) -> None:
    """Do the trials that have no result yet and print what all of these outputs' say. Raises UsageError for an output
    without a catalog or a refined object that has one of the tasks, a policy that is none, and a page without the
    block's markers; StudyError, once all is stored, where every trial failed, or the policy went away."""
    spec = policy_spec(options.policy, options.name, options.actions, options.camera, options.network)
    check_installed(spec)
    if options.gripper == ROBOTIQ.name:
        robotiq_file()
    if spec.name == CLONED and options.seed + options.trials > FIRST_SEED:
        raise UsageError(f"a clone has seen the starts from seed {FIRST_SEED} on: choose seeds below")
    folders = [Path(folder) for folder in variant_folders(options.folders())]
    tasks = chosen_tasks(options.tasks, options.gripper)
    choice = ProbeChoice(tasks, options.assets, [*options.methods], options.trials, options.seed, options.film)
    # A folder without them is said before the trials.
    rates = published_rates(options.published) if options.published is not None else None
    real = real_rates(options.published)
    pages = Pages[pd.DataFrame](
        BLOCK, {options.page: lambda trials: f"{short_block(trials, rates)}\n\n{fidelity_block(trials, real)}"}
    )
    jobs = jobs_of(folders, spec, choice)
    limits = ProbeSettings()
    todo = jobs if options.force else left_to_do(probe_study(limits), jobs)
    if len(todo) < len(jobs):
        sys.stderr.write(f"{len(jobs) - len(todo)} of {len(jobs)} trials have a result; --force does them again\n")
    done: list[Row] = []
    left = in_flow("probe", lambda: run_probes(todo, settings.run, limits, telling(done))) if todo else 0
    trials = latest_own(folders, PROBE_TRIALS)
    for part in describe_probes(trials, real):
        output().print(part)
    pages.write(trials)
    if left:
        raise StudyError(f"nobody answers for {spec.name}: {left} trials are left for the next run")
    require_one_done(done, "trials", lambda row: row["success"] is None)
