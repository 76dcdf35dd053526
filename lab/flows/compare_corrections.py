"""One dataset with a model's answers as they are, corrected, and asked again, for a table: DATA OUT --models A,B."""

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
from asset2sim.runs.option_types import FILE, NAME, Listed
from asset2sim.runs.request import RefineRequest, usable_cores
from flows.command import refine
from lab.comparisons.corrections import BLOCK, corrections_table, ways_of
from lab.comparisons.method_runs import MODELS, slug
from lab.pages.blocks import check_page, write_block
from schemas.asset import FoundAssets
from schemas.errors import DONE, exit_code_of
from schemas.settings import EngineSettings, RunSettings, Settings, ViewSettings
from schemas.vocabulary import Engine

PROGRAM = "python -m lab.flows.compare_corrections"


class CorrectionsOptions(Options):
    """Compare how far a model's answers are corrected."""

    data: CliPositionalArg[Path] = Field(description="a dataset with expectations")
    out: CliPositionalArg[Path] = Field(description="a folder for the runs")
    models: Listed[MODELS] = Field(
        ("prior/noisy", "prior/noisy@2"), description="models; of recorded/FOLDER no repeats"
    )
    subset: NAME | None = Field(None, description="only the manifest's rows of this subset")
    page: FILE | None = Field(None, description="write the table between this file's markers")


def compare_corrections(options: CorrectionsOptions) -> int:
    """Refine the dataset once for each model and way, into a folder each under OUT, with the paper's tests in PyBullet,
    and write the table. Returns the exit code."""
    base = Settings(
        views=ViewSettings(write=False),
        run=RunSettings(workers=usable_cores()),
        engine=EngineSettings(verify=(Engine.PYBULLET,), interact=False),
    )
    if options.page is not None:
        check_page(options.page, BLOCK)
    found = FoundAssets(load_dataset(options.data, options.subset, (), None))
    runs = {}
    for model in options.models:
        for way, settings in ways_of(base, model).items():
            out = options.out / slug(model) / slug(way)
            check_run(found, options.data, out, settings)
            refine(RefineRequest(data=options.data, out=out, settings=settings, found=found))
            assets, expected = latest_rows(out, "assets", "expectations")
            runs[model, way] = assets, expected
    table = corrections_table(runs)
    if options.page is None:
        sys.stdout.write(f"{table}\n")
    else:
        write_block(options.page, BLOCK, table)
    return DONE


def main(words: Sequence[str]) -> int:
    """Run one command line and return its exit code."""
    quiet_environment()
    return exit_code_of("compare_corrections", lambda: compare_corrections(parse(CorrectionsOptions, words, PROGRAM)))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
