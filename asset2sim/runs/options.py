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
from asset2sim.runs.option_groups import AT_ONCE, CatalogOptions, ChosenAssets, FileOptions, Selection
from schemas.authored import KEEP_WORDS
from schemas.csv_rows import rows_beside
from schemas.declared import DeclaredCommand
from schemas.errors import UsageError
from schemas.extensions import commands, missing, object_at
from schemas.location import Location
from schemas.vocabulary import Grouping, Keep

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


@typed.with_settings("doctor")
class DoctorOptions(FileOptions):
    """Check what works here, and what does not."""

    out: typed.OUT = Field(Location("data/refined"), description="where it would go")


@typed.with_settings("refine")
class RefineOptions(FileOptions, Selection):
    """Refine a dataset."""

    data: CliPositionalArg[Location] = Field(
        description="a folder, or its URL, with manifest.csv, of asset folders, or of one asset; or an asset's file"
    )
    out: typed.OUT = Field(description="the output folder, or its URL")
    keep: typed.Listed[typed.KEEP] = Field(
        (Keep.PLAUSIBLE.value,),
        description=f"authored numbers that stay where no words ask otherwise: {', '.join(KEEP_WORDS)}",
    )
    ask_again: CliDualFlag[bool] = Field(
        True,
        description="ask once more, with what an answer comes to, where that is doubtful; of prior/… and with "
        "--correct semantic only where stated",
    )
    force: CliToggleFlag[bool] = Field(False, description="refine unchanged assets again")
    retry_failed: CliToggleFlag[bool] = Field(False, description="refine unchanged assets again that failed")
    dry_run: CliToggleFlag[bool] = Field(
        False, description="say what would be refined, why, at what cost; write nothing"
    )
    strict: CliToggleFlag[bool] = Field(False, description="exit with 1 if an asset failed")
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


@typed.with_settings("ask")
class AskOptions(FileOptions, ChosenAssets):
    """Write the questions of a run as files, for a person or another program to answer; again, what follows from it."""

    data: CliPositionalArg[Location] = Field(description="a dataset, as asset2sim refine takes it")
    folder: CliPositionalArg[Path] = Field(description="the folder to write to, then --model recorded/FOLDER")
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
