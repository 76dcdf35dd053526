"""The options of the command ``asset2sim``, a model for each of its commands."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import AfterValidator, Field, create_model, model_validator
from pydantic_settings import CliDualFlag, CliPositionalArg, CliSubCommand, CliToggleFlag, CliVariadicArg
from pydantic_settings import get_subcommand as chosen_command

from asset2sim.runs import option_types as typed
from asset2sim.runs.command_line import Options
from asset2sim.runs.command_line import parse as parse_words
from asset2sim.runs.option_groups import (
    ALLOW_OUTSIDE,
    AT_ONCE,
    MACRO,
    PACKAGE,
    AnswerOptions,
    CatalogOptions,
    ChosenAssets,
    FileOptions,
    ModelOptions,
    Selection,
)
from schemas.authored import KEEP_WORDS
from schemas.csv_rows import rows_beside
from schemas.declared import DeclaredCommand
from schemas.errors import UsageError
from schemas.extensions import commands, missing, object_at
from schemas.location import Location
from schemas.support import SupportKind
from schemas.vocabulary import (
    BaseMode,
    CollisionMode,
    DynamicsRule,
    Engine,
    Export,
    Gate,
    Grouping,
    Keep,
    Method,
    Proposer,
    StateMode,
    UpAxis,
)

EXAMPLE = """\
for example:
  asset2sim refine data/raw --out data/refined
  asset2sim refine PARTNET --out OUT --subset paper9 --model openai/gpt-4o
  asset2sim settings > settings.yaml
  asset2sim failures --out OUT --compare previous latest
"""


class SettingsOptions(FileOptions):
    """Print every setting, with its unit and its reason: a file for --settings."""

    format: typed.FORMAT = Field("yaml", description="yaml or toml")


class DoctorOptions(ModelOptions):
    """Check what works here, and what does not."""

    out: typed.OUT = Field(Location("data/refined"), description="where it would go")


class RefineOptions(AnswerOptions, ModelOptions, Selection):
    """Refine a dataset."""

    data: CliPositionalArg[Location] = Field(
        description="a folder, or its URL, with manifest.csv, of asset folders, or of one asset; or an asset's file"
    )
    out: typed.OUT = Field(description="the output folder, or its URL")
    engines: Annotated[typed.Listed[typed.ENGINES | None], AfterValidator(typed.none_if_empty)] = Field(
        None, description=f"engines to verify in: {', '.join(Engine)} (default: all installed)"
    )
    verify: Annotated[typed.Listed[typed.ENGINES | None], AfterValidator(typed.none_if_empty)] = Field(
        None, description="those of them whose verdicts decide; the others are recorded (default: all)"
    )
    collision: typed.MODE = Field(
        CollisionMode.DECOMPOSE,
        description=f"{', '.join(CollisionMode)}: collision geometry as authored, hulls, or pieces with interiors",
    )
    dynamics: typed.RULE = Field(
        DynamicsRule.INERTIA,
        description=f"{', '.join(DynamicsRule)}: joint dynamics from what a joint moves, or the paper's ranges",
    )
    proposer: typed.PROPOSER = Field(
        Proposer.SEARCH,
        description=f"{', '.join(Proposer)}: what parts overlapping links, a search first or a model at every step",
    )
    state: typed.STATE = Field(
        StateMode.DOCUMENT,
        description=f"{', '.join(StateMode)}: keep the authored zero, or make the requested state the zero",
    )
    support: typed.SUPPORT | None = Field(
        None, description=f"{', '.join(SupportKind)}: what carries objects whose manifest row does not say"
    )
    prompt: typed.TEXT | None = Field(
        None, description="what is asked of it, where DATA is one asset: 'its lid half open'"
    )
    base: typed.BASE = Field(
        BaseMode.ROOT,
        description=f"{', '.join(BaseMode)}: hold a fixed object's root by the loader's flag, or by a link 'world'",
    )
    up: typed.AXIS | None = Field(
        None, description=f"{', '.join(UpAxis)}: the axis that points up in the files, --up=-y (default: found out)"
    )
    package: typed.Listed[typed.PACKAGES] = PACKAGE
    macro: typed.NAME = MACRO
    keep: typed.Listed[typed.KEEP] = Field(
        (Keep.PLAUSIBLE.value,),
        description=f"authored numbers that stay where no words ask otherwise: {', '.join(KEEP_WORDS)}",
    )
    split: CliDualFlag[bool] = Field(
        False, description="cut files of several objects (a kitchen) into them, and put the whole together again"
    )
    allow_outside: CliDualFlag[bool] = ALLOW_OUTSIDE
    export: typed.Listed[typed.FORMATS] = Field(
        (), description=f"formats to write beside the URDF: {', '.join(Export)}"
    )
    method: typed.METHOD = Field(Method.ASSET2SIM, description=f"where the physics come from: {', '.join(Method)}")
    budget_usd: typed.USD | None = Field(None, description="the most that the run's model calls may cost")
    budget_calls: typed.COUNT | None = Field(None, description="the most model calls of the run")
    budget_tokens: typed.COUNT | None = Field(None, description="the most tokens of the run")
    asset_budget_usd: typed.USD | None = Field(None, description="the same for each asset")
    asset_budget_calls: typed.COUNT | None = Field(None, description="the same for each asset")
    rpm: typed.RATE | None = Field(None, description="the most requests a minute to one provider, over all workers")
    answer_cache: CliDualFlag[bool] = Field(True, description="take an answer again that models have given before")
    scheduler: typed.URL | None = Field(
        None, description="tcp://…, a Dask scheduler to use instead of a cluster of our own"
    )
    keep_days: typed.N | None = Field(
        None, description="remove what the history and MLflow hold of runs older than N days"
    )
    force: CliToggleFlag[bool] = Field(False, description="refine unchanged assets again")
    retry_failed: CliToggleFlag[bool] = Field(False, description="refine unchanged assets again that failed")
    dry_run: CliToggleFlag[bool] = Field(
        False, description="say what would be refined, why, at what cost; write nothing"
    )
    asset_timeout: typed.SECONDS | None = Field(
        None, description="most seconds for an asset, and for its answers (default: 300)"
    )
    views: CliDualFlag[bool] = Field(True, description="write pictures; without them, `asset2sim views` can later")
    report: CliDualFlag[bool] = Field(True, description="write the report for people, OUT/report, after the run")
    strict: CliToggleFlag[bool] = Field(False, description="exit with 1 if an asset failed")
    min_success: typed.SHARE | None = Field(
        None, description="gate: least share of the run's assets that must pass, unchanged ones included, as 0.95"
    )
    max_new_failures: typed.COUNT | None = Field(
        None, description="gate: most assets that may fail and did not before; on a first run every failure is new"
    )
    gate: typed.GATE = Field(
        Gate.ERROR, description=f"{', '.join(Gate)}: a run that misses a gate says so, and with error exits with 3"
    )
    hook: Annotated[typed.SHELL | None, AfterValidator(typed.none_if_empty)] = Field(
        None, description="a shell command to run after the run; ASSET2SIM_… variables say how it went"
    )

    @model_validator(mode="after")
    def _one_redo(self) -> Self:
        typed.exclusive(self, "force", "retry_failed")
        return self


class NightlyOptions(RefineOptions):
    """Refine a dataset on the schedule of catalog.yaml."""

    now: CliToggleFlag[bool] = Field(
        False,
        description="one night at once: by the nightly that serves OUT, or here where none does; exits as refine does",
    )
    cron: typed.CRON | None = Field(
        None, description="another schedule, 'minute hour day month weekday', in the time zone of catalog.yaml"
    )


class FailuresOptions(CatalogOptions):
    """Count the failures in a refined dataset."""

    by: typed.GROUP = Field(Grouping.FAILURE_MODE, description=f"what to count by: {', '.join(Grouping)}")
    since: typed.DAY | None = Field(None, description="failures of all runs since then, as 2026-11-01 (UTC)")
    compare: CliVariadicArg[typed.Words[typed.RUN | None]] = Field(
        None, description="what broke and what got mended between two runs: ids or their beginnings, latest, previous"
    )
    reviewed: CliToggleFlag[bool] = Field(
        False, description="each failure with what people said of it in the viewer, the unreviewed first"
    )

    @model_validator(mode="after")
    def _one_period(self) -> Self:
        typed.exclusive(self, "since", "compare")
        for other in ("by", "since", "compare"):
            typed.exclusive(self, other, "reviewed")
        return self


class QueryOptions(CatalogOptions):
    """Ask the tables and the history of all runs in SQL."""

    sql: CliPositionalArg[str] = Field(description="a DuckDB query; tables go by their names")
    csv: CliToggleFlag[bool] = Field(False, description="comma-separated values instead of a table")
    allow_files: CliToggleFlag[bool] = Field(False, description="let the query read and write other files, too")


class ShowOptions(CatalogOptions):
    """Show one refined asset."""

    asset_id: CliPositionalArg[str] = Field(description="an asset's id, as the manifest has it")


class ViewsOptions(CatalogOptions, FileOptions):
    """Write the pictures that a run with --no-views left out."""

    workers: typed.N | None = Field(None, description="assets drawn at once (default: all cores)")


class RecordOptions(CatalogOptions):
    """Keep a run's answers as a recorded model: files that anybody can run again without a key."""

    folder: CliPositionalArg[Path] = Field(description="the folder to write to, then --model recorded/FOLDER")


class AskOptions(FileOptions, ChosenAssets):
    """Write the questions of a run as files, for a person or another program to answer; again, what follows from it."""

    data: CliPositionalArg[Location] = Field(description="a dataset, as asset2sim refine takes it")
    folder: CliPositionalArg[Path] = Field(description="the folder to write to, then --model recorded/FOLDER")
    method: typed.METHOD = Field(Method.ASSET2SIM, description="whose questions")
    workers: typed.N | None = AT_ONCE


class Command(Options):
    """Make articulated URDF assets interaction-ready: mass, inertia, joint dynamics, scale, state."""


def all_commands() -> tuple[DeclaredCommand, ...]:
    """The product's commands, a row of ``commands.csv`` each, and those that extensions add."""
    return (*(DeclaredCommand(**row) for row in rows_beside(__file__, "commands.csv")), *commands())


def parse(words: Sequence[str]) -> Options:
    """The options of the command that a command line names, of extensions too. Raises UsageError."""
    fields: dict[str, Any] = {}
    subcommand: Any = CliSubCommand
    for item in all_commands():
        field = Field(alias=item.name, description=item.description)
        fields[item.name.replace("-", "_")] = subcommand[object_at(item.options)], field
    if words and words[0] not in [item.name for item in commands()] and missing(words[0]):
        raise UsageError(missing(words[0]))
    whole = create_model("Command", __base__=Command, __doc__=Command.__doc__, **fields)
    found = chosen_command(parse_words(whole, words, "asset2sim", EXAMPLE), is_required=True)
    assert isinstance(found, Options)
    return found
