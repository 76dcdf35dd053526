"""Commands, tables, further checks and models of extensions, by their names."""

import pkgutil
from collections.abc import Iterable, Mapping
from typing import Annotated, Any

from pydantic import AfterValidator

from schemas.declared import DeclaredCommand, FurtherCheck, LocalModel, extensions
from schemas.errors import UnknownChoiceError, UsageError
from schemas.hand_settings import HAND_CHECKS

KNOWN: Mapping[str, tuple[str, ...]] = {
    "asset2sim-lab": (
        *("judge-videos", "learn", "probe", "rate", "ratings", "record-motion", "prior/noisy"),
        *("learning", "learning_curves", "probe_trials", "rating_keys", "trials", "video_scores"),
        *("agent", "constant", "direct", "ivw", "no-semantics", "reference"),
    )
}
"""Distribution → names that it adds, to say what is missing where it is not installed."""


def object_at(place: str) -> Any:
    """The object at ``module:attribute``."""
    return pkgutil.resolve_name(place)


def commands() -> tuple[DeclaredCommand, ...]:
    """The commands that extensions add."""
    return tuple(command for item in extensions() for command in item.commands)


def checks() -> dict[str, FurtherCheck]:
    """Name → further check that a run may be asked for: those of a hand, and of extensions."""
    return {check.name: check for checks in (HAND_CHECKS, *(item.checks for item in extensions())) for check in checks}


def further_check(name: str) -> FurtherCheck:
    """The further check of that name. Raises UsageError."""
    found = checks()
    if name not in found:
        raise unknown("check", name, found)
    return found[name]


def further_columns() -> list[tuple[Any, ...]]:
    """Columns of the table ``assets`` that the further checks add, in the checks' order."""
    return [column for check in checks().values() for column in object_at(check.columns)]


def further_tables() -> dict[str, Any]:
    """Name → table beside the catalog."""
    return {name: table for item in extensions() if item.tables for name, table in object_at(item.tables).items()}


def local_models() -> dict[str, LocalModel]:
    """Name without parameters → model of this process."""
    return {model.name: model for item in extensions() for model in item.models}


def offline_answers() -> dict[str, str]:
    """Purpose → function by which the offline model answers it, where an extension has the method that asks."""
    return {purpose: function for item in extensions() for purpose, function in item.offline.items()}


def missing(name: str) -> str:
    """A sentence that says which distribution has the name, where it is known to be in one; else empty."""
    owner = next((owner for owner, names in KNOWN.items() if name.partition("@")[0] in names), None)
    return "" if owner is None else f"'{name}' needs {owner}, which is not installed"


def unknown(kind: str, name: str, known: Iterable[str]) -> UsageError:
    """The error for a name that is not among the known: the distribution that has it, or the choices."""
    return UsageError(missing(name)) if missing(name) else UnknownChoiceError(kind, name, known)


def _checked(name: str) -> str:
    try:
        return further_check(name).name
    except UsageError as error:
        raise ValueError(str(error)) from None


CheckName = Annotated[str, AfterValidator(_checked)]
"""The name of a further check of an installed extension."""
