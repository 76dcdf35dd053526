"""Comparisons of settings on the same objects, each a table of the documentation: ``python -m lab.flows.compare NAME``
with the name of a comparison, a dataset and a folder for its runs; ``--help`` after the name says more."""

import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import pandas as pd
from pydantic import Field
from pydantic_settings import CliDualFlag, CliPositionalArg

from asset2sim.catalog.read import latest_rows
from asset2sim.guidance.csv_rows import LEFT_OUT_VARIABLE
from asset2sim.intake.dataset import load_dataset
from asset2sim.models.gateway.environment import quiet_environment
from asset2sim.runs.check_request import check_request, check_run
from asset2sim.runs.command_line import Options, parse
from asset2sim.runs.option_types import FILE, FOLDERS, NAME, Listed
from asset2sim.runs.request import RefineRequest, usable_cores
from flows.command import refine
from lab.comparisons import corrections, origins, rules, withheld
from lab.comparisons.method_runs import MODELS, slug
from lab.pages.blocks import Pages
from schemas.asset import FoundAssets
from schemas.errors import DONE, UnknownChoiceError, UsageError, exit_code_of
from schemas.location import Location
from schemas.settings import EngineSettings, RunSettings, Settings, ViewSettings
from schemas.vocabulary import Engine, Method

PROGRAM = "python -m lab.flows.compare"


class CompareSettingsOptions(Options):
    """Compare settings on one dataset."""

    data: CliPositionalArg[Path] = Field(description="the dataset")
    out: CliPositionalArg[Path] = Field(description="a folder for the runs")
    page: CliPositionalArg[FILE | None] = Field(None, description="write the table between this file's markers")


class CorrectionsOptions(Options):
    """Compare how far a model's answers are corrected."""

    data: CliPositionalArg[Path] = Field(description="a dataset with expectations")
    out: CliPositionalArg[Path] = Field(description="a folder for the runs")
    models: Listed[MODELS] = Field(
        ("prior/noisy", "prior/noisy@2"), description="models; of recorded/FOLDER no repeats"
    )
    subset: NAME | None = Field(None, description="only the manifest's rows of this subset")
    page: FILE | None = Field(None, description="write the table between this file's markers")


class OriginsOptions(Options):
    """Refine what others made, and count what is read, passes and is kept of each origin."""

    data: CliPositionalArg[FOLDERS] = Field(description="datasets, each a row called after its folder")
    out: Path = Field(description="a folder for the runs")
    split: CliDualFlag[bool] = Field(True, description="cut a file of several objects into them")
    allow_outside: CliDualFlag[bool] = Field(False, description="also read what files name outside their dataset")
    page: FILE | None = Field(None, description="write the tables between this file's markers")


def base_settings() -> Settings:
    """Settings that all runs share."""
    return Settings(views=ViewSettings(write=False), run=RunSettings(workers=usable_cores()))


def refine_each(data: Location, found: FoundAssets, runs: Mapping[Path, Settings]) -> None:
    """Refine the found assets once into each folder, with its settings. Raises UsageError before anything is refined,
    and KeyboardInterrupt where a run was stopped."""
    for out, settings in runs.items():
        check_run(found, data, out, settings)
    for out, settings in runs.items():
        if refine(RefineRequest(data=data, out=out, settings=settings, found=found)).stopped is not None:
            raise KeyboardInterrupt("stopped; run it again to go on")


def compare_rules(options: CompareSettingsOptions) -> str:
    """The table of one dataset raw, with the paper's ranges of joint terms, and by our rules."""
    base = base_settings()
    ways = rules.settings_of(base)
    folders = {name: options.out / name.split("'")[0] for name in ways}
    found = FoundAssets(load_dataset(options.data, None, (), None))
    refine_each(Location(options.data), found, {folders[name]: settings for name, settings in ways.items()})
    tables = {name: latest_rows(out, "assets", "measurements", "interactions") for name, out in folders.items()}
    return rules.rules_table(
        {name: rules.engine_results(own[0], own[1], own[2], base.thresholds) for name, own in tables.items()}
    )


def compare_corrections(options: CorrectionsOptions) -> str:
    """The table of one dataset with a model's answers as they are, corrected, and asked again, with the paper's tests
    in PyBullet."""
    base = base_settings().model_copy(update={"engine": EngineSettings(verify=(Engine.PYBULLET,), interact=False)})
    ways = {(m, way): own for m in options.models for way, own in corrections.ways_of(base, m).items()}
    folders = {(model, way): options.out / slug(model) / slug(way) for model, way in ways}
    found = FoundAssets(load_dataset(options.data, options.subset, (), None))
    refine_each(Location(options.data), found, {folders[name]: settings for name, settings in ways.items()})
    tables = {name: latest_rows(out, "assets", "expectations") for name, out in folders.items()}
    return corrections.corrections_table({name: (assets, said) for name, (assets, said) in tables.items()})


def compare_origins(options: OriginsOptions) -> str:
    """The tables of datasets from other hands, a row each. Raises UsageError where two folders have one name."""
    base = base_settings()
    own = base.inputs.model_copy(update={"split": options.split, "allow_outside": options.allow_outside})
    settings = base.model_copy(update={"inputs": own})
    folders = {Path(str(data)).name: data for data in options.data}
    if len(folders) < len(options.data):
        raise UsageError("two of the datasets have folders of one name; name one of them otherwise")
    found: list[origins.Origin] = []
    for name, data in folders.items():
        out = options.out / name
        refine_each(data, check_request(data, out, settings, None, (), None), {out: settings})
        found.append(origins.Origin(name, *latest_rows(out, "assets", "links", "joints")))
    return origins.origins_tables(found)


def compare_withheld(options: CompareSettingsOptions) -> str:
    """The tables of one dataset whole, without labels, and with each category left out of the prior's tables."""
    base = base_settings()
    refs = load_dataset(options.data, None, (), None)
    ways = {withheld.WHOLE: (rules.OURS, base)}  # the same run as the other comparison's, where both have one folder
    ways[withheld.UNLABELLED] = "unlabelled", base.model_copy(update={"method": Method.NO_SEMANTICS})
    refine_each(Location(options.data), FoundAssets(refs), {options.out / folder: own for folder, own in ways.values()})
    runs = [(name, *assets_and_joints(options.out / folder)) for name, (folder, _) in ways.items()]
    single: list[tuple[str, pd.DataFrame, pd.DataFrame]] = []
    for category in sorted({ref.category for ref in refs if ref.category}):
        out, own = options.out / "left_out" / category, [ref.asset_id for ref in refs if ref.category == category]
        refine_without(category, own, options.data, out)
        single.append((category, *assets_and_joints(out)))
    joined = pd.concat([assets for _, assets, _ in single]), pd.concat([joints for _, _, joints in single])
    return withheld.withheld_table(
        [*runs, (withheld.LEFT_OUT, *joined)], [(category, assets) for category, assets, _ in single]
    )


def assets_and_joints(out: Path) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The rows of a run's assets and joints."""
    assets, joints = latest_rows(out, "assets", "joints")
    return assets, joints


def refine_without(category: str, asset_ids: Sequence[str], data: Path, out: Path) -> None:
    """Refine these assets into ``out`` without the rows of their category, in a program of its own: what serves forks
    keeps the environment with which it once started."""
    command = [sys.executable, "-m", "flows.command", "refine", str(data), "--out", str(out), "--no-views"]
    environment = {**os.environ, LEFT_OUT_VARIABLE: category}
    subprocess.run([*command, "--assets", ",".join(asset_ids)], env=environment, check=True)


COMPARISONS: Mapping[str, tuple[type[Options], Callable[..., str]]] = {
    rules.BLOCK: (CompareSettingsOptions, compare_rules),
    withheld.BLOCK: (CompareSettingsOptions, compare_withheld),
    corrections.BLOCK: (CorrectionsOptions, compare_corrections),
    origins.BLOCK: (OriginsOptions, compare_origins),
}
"""Name of each comparison, and of its block in the documentation → its options and what makes its table."""


def compare(words: Sequence[str]) -> int:
    """Make the table that a command line asks for, and put it on its page or print it. Returns the exit code."""
    name = words[0] if words else ""
    if name not in COMPARISONS:
        raise UnknownChoiceError("comparison", name, COMPARISONS)
    kind, make_table = COMPARISONS[name]
    options = parse(kind, words[1:], f"{PROGRAM} {name}")
    page: Path | None = getattr(options, "page", None)
    pages = Pages[str](name, {page: str})
    table = make_table(options)
    pages.write(table)
    if page is None:
        sys.stdout.write(f"{table}\n")
    return DONE


def main(words: Sequence[str]) -> int:
    """Run one command line and return its exit code."""
    quiet_environment()
    return exit_code_of("compare", lambda: compare(words))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
