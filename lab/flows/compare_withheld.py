"""One dataset whole, without labels, and with each category left out of the tables in turn: DATA OUT [PAGE]."""

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from pydantic import Field
from pydantic_settings import CliPositionalArg

from asset2sim.catalog.read import latest_rows
from asset2sim.guidance.csv_rows import LEFT_OUT_VARIABLE
from asset2sim.models.gateway.environment import quiet_environment
from asset2sim.runs.check_request import check_run
from asset2sim.runs.command_line import Options, parse
from asset2sim.runs.dataset import load_dataset
from asset2sim.runs.option_types import FILE
from asset2sim.runs.request import RefineRequest, usable_cores
from flows.command import refine
from lab.comparisons.withheld import BLOCK, LEFT_OUT, UNLABELLED, WHOLE, withheld_table
from lab.pages.blocks import check_page, write_block
from schemas.asset import AssetRef, FoundAssets
from schemas.errors import DONE, exit_code_of
from schemas.settings import RunSettings, Settings, ViewSettings
from schemas.vocabulary import Method

PROGRAM = "python -m lab.flows.compare_withheld"


class WithheldOptions(Options):
    """Compare one dataset whole, without labels, and without each category's rows."""

    data: CliPositionalArg[Path] = Field(description="the dataset, whose manifest names categories")
    out: CliPositionalArg[Path] = Field(description="a folder for the runs")
    page: CliPositionalArg[FILE | None] = Field(None, description="write the tables between this file's markers")


def compare_withheld(options: WithheldOptions) -> int:
    """Refine the dataset twice, and each category once more without its rows, into folders under OUT; write the tables.
    Returns the exit code."""
    base = Settings(views=ViewSettings(write=False), run=RunSettings(workers=usable_cores()))
    if options.page is not None:
        check_page(options.page, BLOCK)
    refs = load_dataset(options.data, None, (), None)
    whole = run(options, options.out / "whole", base, refs)
    unlabelled = run(options, options.out / "unlabelled", base.model_copy(update={"method": Method.NO_SEMANTICS}), refs)
    single: list[tuple[str, pd.DataFrame, pd.DataFrame]] = []
    for category in sorted({ref.category for ref in refs if ref.category}):
        own = [ref.asset_id for ref in refs if ref.category == category]
        single.append((category, *run_without(category, own, options, options.out / "left_out" / category)))
    joined = pd.concat([assets for _, assets, _ in single]), pd.concat([joints for _, _, joints in single])
    table = withheld_table(
        [(WHOLE, *whole), (UNLABELLED, *unlabelled), (LEFT_OUT, *joined)],
        [(category, assets) for category, assets, _ in single],
    )
    if options.page is None:
        sys.stdout.write(f"{table}\n")
    else:
        write_block(options.page, BLOCK, table)
    return DONE


def run(
    options: WithheldOptions, out: Path, settings: Settings, refs: Sequence[AssetRef]
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Refine these assets into ``out``; the rows of its assets and joints."""
    found = FoundAssets(refs)
    check_run(found, options.data, out, settings)
    refine(RefineRequest(data=options.data, out=out, settings=settings, found=found))
    assets, joints = latest_rows(out, "assets", "joints")
    return assets, joints


def run_without(
    category: str, asset_ids: Sequence[str], options: WithheldOptions, out: Path
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Refine these assets into ``out`` without the rows of their category, in a program of its own: what serves forks
    keeps the environment with which it once started. The rows of its assets and joints."""
    command = [sys.executable, "-m", "flows.command", "refine", str(options.data), "--out", str(out), "--no-views"]
    environment = {**os.environ, LEFT_OUT_VARIABLE: category}
    subprocess.run([*command, "--assets", ",".join(asset_ids)], env=environment, check=True)
    assets, joints = latest_rows(out, "assets", "joints")
    return assets, joints


def main(words: Sequence[str]) -> int:
    """Run one command line and return its exit code."""
    quiet_environment()
    return exit_code_of("compare_withheld", lambda: compare_withheld(parse(WithheldOptions, words, PROGRAM)))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
