"""Extensions: commands, tables, further checks and models that another installed distribution adds.

A distribution names its ``Extension`` in an entry point of the group ``asset2sim.extensions``. What an extension refers
to is written ``module:attribute`` and imported where it is used, so that a list of names costs nothing.
"""

import functools
import pkgutil
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import entry_points
from typing import Annotated, Any

from pydantic import AfterValidator

from schemas.errors import UnknownChoiceError, UsageError

GROUP = "asset2sim.extensions"
KNOWN: Mapping[str, tuple[str, ...]] = {
    "asset2sim-lab": (
        *("judge-videos", "learn", "probe", "rate", "ratings", "record-motion", "reachable", "prior/noisy"),
        *("learning", "learning_curves", "probe_trials", "rating_keys", "trials", "video_scores"),
    )
}
"""Distribution → names that it adds, to say what is missing where it is not installed."""


@dataclass(frozen=True)
class Command:
    """A command of ``asset2sim``: its name, its line of help, its model of options, and the function that runs it."""

    name: str
    description: str
    options: str
    """``asset2sim.runs.command_line.Options``."""
    run: str
    """Function of the options and the settings that they state; returns the exit code, or None for 0."""


@dataclass(frozen=True)
class FurtherCheck:
    """A check that a run is asked for by name (``--check``). It may warn, and decides nothing."""

    name: str
    description: str
    run: str
    """Function of an ``AssetJob`` and the folder that was written, or None, to a ``StageResult``."""
    columns: str
    """Columns (``schemas.table.Column``, may be null) that it adds to the table ``assets``; ``StageResult.further`` has
    their values."""
    sources: tuple[str, ...]
    """Modules and packages that decide what it finds, which the content hash of an asset counts."""


@dataclass(frozen=True)
class LocalModel:
    """A model of this process: ``name`` alone, or ``name@…`` with parameters."""

    name: str
    form: str
    """How names with parameters are written, for messages."""
    label: str
    """What reports say beside its name."""
    answers: str
    """Function of the model's whole name to a function of a question, its conversation and the number of the sample,
    to the answer's text. Raises UnknownChoiceError for parameters that it does not know."""
    sources: tuple[str, ...]
    """Modules and packages that decide its answers, as for a check."""


@dataclass(frozen=True)
class Extension:
    """Additions of a distribution."""

    commands: tuple[Command, ...] = ()
    checks: tuple[FurtherCheck, ...] = ()
    models: tuple[LocalModel, ...] = ()
    tables: str = ""
    """Name → ``schemas.table.Table`` of tables beside the catalog: a folder ``NAME`` of Parquet files in an output."""


def named(place: str) -> Any:
    """The object at ``module:attribute``."""
    return pkgutil.resolve_name(place)


@functools.cache
def extensions() -> tuple[Extension, ...]:
    """The extensions of all installed distributions, by the names of their entry points."""
    return tuple(point.load() for point in sorted(entry_points(group=GROUP)))


def commands() -> tuple[Command, ...]:
    """The commands that extensions add."""
    return tuple(command for item in extensions() for command in item.commands)


def checks() -> dict[str, FurtherCheck]:
    """Name → further check that a run may be asked for."""
    return {check.name: check for item in extensions() for check in item.checks}


def further_check(name: str) -> FurtherCheck:
    """The further check of that name. Raises UsageError."""
    found = checks()
    if name not in found:
        raise UsageError(missing(name)) if missing(name) else UnknownChoiceError("check", name, found)
    return found[name]


def further_columns() -> list[tuple[Any, ...]]:
    """Columns of the table ``assets`` that the further checks add, in the checks' order."""
    return [column for check in checks().values() for column in named(check.columns)]


def further_tables() -> dict[str, Any]:
    """Name → table beside the catalog."""
    return {name: table for item in extensions() if item.tables for name, table in named(item.tables).items()}


def local_models() -> dict[str, LocalModel]:
    """Name without parameters → model of this process."""
    return {model.name: model for item in extensions() for model in item.models}


def missing(name: str) -> str:
    """A sentence that says which distribution has the name, where it is known to be in one; else empty."""
    owner = next((owner for owner, names in KNOWN.items() if name.partition("@")[0] in names), None)
    return "" if owner is None else f"'{name}' needs {owner}, which is not installed"


def _checked(name: str) -> str:
    try:
        return further_check(name).name
    except UsageError as error:
        raise ValueError(str(error)) from None


CheckName = Annotated[str, AfterValidator(_checked)]
"""The name of a further check of an installed extension."""
