"""What proposes states, a search first or a model at every step, on objects that overlap: DATA … --out OUT [--page]."""

import sys
from collections.abc import Sequence
from pathlib import Path

from pydantic import Field
from pydantic_settings import CliPositionalArg

from asset2sim.catalog.read import latest_rows
from asset2sim.models.gateway.environment import quiet_environment
from asset2sim.runs.check_request import check_run
from asset2sim.runs.command_line import Options, parse
from asset2sim.runs.dataset import load_dataset
from asset2sim.runs.option_types import FILE, FOLDERS, IDS, Listed
from asset2sim.runs.request import RefineRequest, usable_cores
from flows.command import refine
from lab.comparisons.proposers import BLOCK, ProposerRun, answered, overlapping_at_start, proposers_table, settings_with
from lab.pages.blocks import check_page, write_block
from schemas.asset import FoundAssets
from schemas.errors import DONE, STOPPED, exit_code_of
from schemas.location import Location
from schemas.settings import RunSettings, Settings, ViewSettings
from schemas.vocabulary import Proposer

PROGRAM = "python -m lab.flows.compare_proposers"
MODELS = ("prior/noisy", "prior/noisy@2")


class ProposerOptions(Options):
    """Compare a search first with a model at every step, on the objects that overlap in the requested state."""

    data: CliPositionalArg[FOLDERS] = Field(description="the datasets")
    out: Path = Field(description="a folder for the runs")
    models: Listed[IDS] = Field(MODELS, description="models, separated by commas; recorded/FOLDER for its assets alone")
    assets: Listed[IDS] = Field((), description="only these assets, separated by commas")
    page: FILE | None = Field(None, description="write the table between this file's markers")


def compare_proposers(options: ProposerOptions) -> int:
    """Find out which objects overlap with each model's proposals, refine these by both proposers, into folders under
    OUT, and write the table. Returns the exit code."""
    base = Settings(views=ViewSettings(write=False), run=RunSettings(workers=usable_cores()))
    if options.page is not None:
        check_page(options.page, BLOCK)
    runs: list[ProposerRun] = []
    for model in options.models:
        for data in options.data:
            found = both_proposers(options.out, data, model, options.assets, base)
            if found is None:
                sys.stderr.write("stopped; run it again to go on\n")
                return STOPPED
            runs.extend(found)
    if options.page is None:
        sys.stdout.write(f"{proposers_table(runs)}\n")
    else:
        write_block(options.page, BLOCK, proposers_table(runs))
    return DONE


def both_proposers(
    out: Path, data: Location, model: str, chosen: Sequence[str], base: Settings
) -> list[ProposerRun] | None:
    """Both proposers' runs of one model over the objects of one dataset that overlap; empty where none does, None where
    a run was stopped."""
    known = [ref.asset_id for ref in load_dataset(data, None, (), None)]
    known = [asset_id for asset_id in known if asset_id in chosen or not chosen]
    folder = out / Path(str(data)).name / model.replace("/", "_")
    ids = answered(model, known)
    if not ids:
        return []
    if not refine_some(data, folder / "found", settings_with(base, model, None), ids):
        return None
    (trace,) = latest_rows(folder / "found", "trace")
    ids = overlapping_at_start(trace, 1e3 * base.search.target_phi_m)
    runs = []
    for proposer in Proposer if ids else ():
        if not refine_some(data, folder / proposer.value, settings_with(base, model, proposer), ids):
            return None
        tables = latest_rows(folder / proposer.value, "assets", "joints", "trace", "model_calls", "findings")
        runs.append(ProposerRun(model, proposer, *tables))
    return runs


def refine_some(data: Location, out: Path, settings: Settings, asset_ids: Sequence[str]) -> bool:
    """Refine these assets of a dataset into ``out``; whether the run came to its end."""
    found = FoundAssets(load_dataset(data, None, tuple(asset_ids), None))
    check_run(found, data, out, settings)
    return refine(RefineRequest(data=data, out=out, settings=settings, found=found)).stopped is None


def main(words: Sequence[str]) -> int:
    """Run one command line and return its exit code."""
    quiet_environment()
    return exit_code_of("compare_proposers", lambda: compare_proposers(parse(ProposerOptions, words, PROGRAM)))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
