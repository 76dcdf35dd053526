"""Types of options: their names are what the help shows in the place of a value."""

from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from enum import EnumType
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, cast, get_args, get_origin

from pydantic import AfterValidator, BaseModel, BeforeValidator, Field, create_model
from pydantic_settings import CliDualFlag, NoDecode
from typing_extensions import TypeAliasType

from asset2sim.runs.command_line import Options
from schemas.authored import KeepWords
from schemas.base import Fraction, NonNegative, Positive
from schemas.csv_rows import rows_beside
from schemas.errors import UsageError
from schemas.extensions import CheckName
from schemas.location import Location
from schemas.settings import Settings
from schemas.vocabulary import Engine, Grouping


def comma_separated(text: object) -> object:
    """The names in a comma-separated list, in its order. Raises ValueError for an option without a value."""
    if text == []:
        raise ValueError("expected at least one argument")
    return tuple(name.strip() for name in text.split(",") if name.strip()) if isinstance(text, str) else text


def viewed(engine: Engine) -> Engine:
    """An engine of the viewer. Raises ValueError."""
    if engine not in VIEWED:
        raise ValueError(f"the viewer runs {' and '.join(VIEWED)}")
    return engine


def each_once(names: object) -> object:
    """The names of a list, each once."""
    return tuple(dict.fromkeys(names)) if isinstance(names, tuple) else names


def at_least_one(text: object) -> object:
    """The text of a list. Raises ValueError where it has no name: that would choose all."""
    if isinstance(text, str) and not comma_separated(text):
        raise ValueError("it names nothing; leave it out for all of them")
    return text


def utc(text: object) -> object:
    """A day or a time; what states no time zone is UTC. Raises ValueError."""
    try:
        found = datetime.fromisoformat(str(text))
    except ValueError:
        raise ValueError(f"'{text}' is not a day or a time such as 2026-11-01 or 2026-11-01T02:00") from None
    return found if found.tzinfo is not None else found.replace(tzinfo=UTC)


Kind = TypeVar("Kind")
Words = Annotated[Kind, NoDecode, BeforeValidator(comma_separated)]
"""The type of an option that takes several names: with commas between them, or each a word of its own."""
Listed = Words[Annotated[Kind, BeforeValidator(each_once)]]
Chosen = Annotated[Listed[Kind], BeforeValidator(at_least_one)]
"""The type of an option that chooses some of all."""

FILE = TypeAliasType("FILE", Path)
OUT = TypeAliasType("OUT", Location)
FOLDERS = TypeAliasType("FOLDERS", tuple[Location, ...])
NAME = TypeAliasType("NAME", str)
IDS = TypeAliasType("IDS", tuple[str, ...])
N = TypeAliasType("N", Annotated[int, Field(ge=1)])
COUNT = TypeAliasType("COUNT", Annotated[int, Field(ge=0)])
RATE = TypeAliasType("RATE", Positive)
SECONDS = TypeAliasType("SECONDS", Positive)
SHARE = TypeAliasType("SHARE", Fraction)
PORT = TypeAliasType("PORT", Annotated[int, Field(ge=1, le=65_535)])
CRON = TypeAliasType("CRON", str)
USD = TypeAliasType("USD", NonNegative)
URL = TypeAliasType("URL", str)
DAY = TypeAliasType("DAY", Annotated[datetime, BeforeValidator(utc)])
RUN = TypeAliasType("RUN", tuple[str, str])
SHELL = TypeAliasType("SHELL", str)
ENGINES = TypeAliasType("ENGINES", tuple[Engine, ...])
VIEWED = (Engine.PYBULLET, Engine.MUJOCO)
"""Engines of the viewer."""
ENGINE = TypeAliasType("ENGINE", Annotated[Engine, AfterValidator(viewed)])
CHECKS = TypeAliasType("CHECKS", tuple[CheckName, ...])
GROUP = TypeAliasType("GROUP", Grouping)
KEEP = TypeAliasType("KEEP", KeepWords)
FORMAT = TypeAliasType("FORMAT", Literal["yaml", "toml"])


def none_if_empty(value: Kind) -> Kind | None:
    """The value, or None for an empty list or text."""
    return value or None


def exclusive(options: Options, one: str, other: str) -> None:
    """Refuse two options together; the library would put them into a group, and the group into their names."""
    if {one, other} <= options.model_fields_set and getattr(options, one) and getattr(options, other):
        names = [f"--{name.replace('_', '-')}" for name in (other, one)]
        raise UsageError(f"argument {names[0]}: not allowed with argument {names[1]}")


Stated = TypeVar("Stated", bound=Options)


def with_settings(command: str) -> Callable[[type[Stated]], type[Stated]]:
    """Decorator that gives a command those options that state a setting: the rows of ``options.csv`` that name it."""

    def extended(options: type[Stated]) -> type[Stated]:
        rows = [row for row in rows_beside(__file__, "options.csv") if command in row["commands"].split()]
        fields: dict[str, Any] = {row["option"]: option_of(row) for row in rows}
        return create_model(
            options.__name__, __base__=options, __doc__=options.__doc__, __module__=options.__module__, **fields
        )

    return extended


def option_of(row: Mapping[str, str]) -> tuple[Any, Any]:
    """Type and field of an option: its setting's type and default, ``shown`` in the place of a value."""
    model: type[BaseModel] = Settings
    *sections, name = row["setting"].split(".")
    for section in sections:
        model = cast(type[BaseModel], model.model_fields[section].annotation)
    field, listed = model.model_fields[name], cast(Any, Listed)
    kinds = get_args(field.annotation) if get_origin(field.annotation) in (Union, UnionType) else (field.annotation,)
    kind, optional = kinds[0], NoneType in kinds
    several = get_origin(kind) is tuple
    one = get_args(kind)[0] if several else kind
    choices = ", ".join(one) if isinstance(one, EnumType) else ""
    described = Field(field.default, description=row["description"].replace("{choices}", choices))
    if kind is bool:
        return CliDualFlag[bool], described
    shown: Any = TypeAliasType(row["shown"], Annotated[kind, *field.metadata] if field.metadata else kind)
    if several and optional:
        return Annotated[listed[shown | None], AfterValidator(none_if_empty)], described
    return listed[shown] if several else shown | None if optional else shown, described
