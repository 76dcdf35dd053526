"""One dataset raw, with the paper's ranges and by our rules, for a table of the documentation: DATA OUT [PAGE]."""

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
from asset2sim.runs.option_types import FILE
from asset2sim.runs.request import RefineRequest, usable_cores
from flows.command import refine
from lab.comparisons.rules import BLOCK, engine_results, rules_table, settings_of
from lab.pages.blocks import check_page, write_block
from schemas.asset import FoundAssets
from schemas.errors import DONE, exit_code_of
from schemas.settings import RunSettings, Settings, ViewSettings

PROGRAM = "python -m lab.flows.compare_rules"


class RulesOptions(Options):
    """Compare one dataset raw, with the paper's ranges of joint terms, and by our rules."""

    data: CliPositionalArg[Path] = Field(description="the dataset")
    out: CliPositionalArg[Path] = Field(description="a folder for the three runs")
    page: CliPositionalArg[FILE | None] = Field(None, description="write the table between this file's markers")


def compare_rules(options: RulesOptions) -> int:
    """Refine the dataset three times, into a folder each under OUT, and write the table. Returns the exit code."""
    base = Settings(views=ViewSettings(write=False), run=RunSettings(workers=usable_cores()))
    ways = {name: (options.out / name.split("'")[0], settings) for name, settings in settings_of(base).items()}
    if options.page is not None:
        check_page(options.page, BLOCK)
    found = FoundAssets(load_dataset(options.data, None, (), None))
    for folder, settings in ways.values():
        check_run(found, options.data, folder, settings)
    for folder, settings in ways.values():
        refine(RefineRequest(data=options.data, out=folder, settings=settings, found=found))
    rules = {}
    for name, (folder, _) in ways.items():
        assets, measured, interactions = latest_rows(folder, "assets", "measurements", "interactions")
        rules[name] = engine_results(assets, measured, interactions, base.thresholds)
    if options.page is None:
        sys.stdout.write(f"{rules_table(rules)}\n")
    else:
        write_block(options.page, BLOCK, rules_table(rules))
    return DONE


def main(words: Sequence[str]) -> int:
    """Run one command line and return its exit code."""
    quiet_environment()
    return exit_code_of("compare_rules", lambda: compare_rules(parse(RulesOptions, words, PROGRAM)))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
