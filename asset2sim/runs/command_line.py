"""From words to options: pydantic-settings' command line, with a mistake as one line that says what would be right."""

import argparse
import re
from collections.abc import Iterator, Mapping, Sequence
from importlib import metadata
from typing import Any, NoReturn, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails
from pydantic_settings import (
    BaseSettings,
    CliApp,
    CliSettingsSource,
    PydanticBaseSettingsSource,
    SettingsConfigDict,
    SettingsError,
)

from schemas.errors import UsageError

NULL = "null"
"""The word that stands for None on a command line, as in a settings file."""


class Options(BaseSettings):
    """The options of a command, from its command line alone: pydantic-settings would look at the environment too."""

    model_config = SettingsConfigDict(
        frozen=True,
        extra="forbid",
        cli_avoid_json=True,
        cli_enforce_required=True,
        cli_hide_none_type=True,
        cli_kebab_case=True,
        cli_parse_none_str=NULL,
    )

    @classmethod
    def settings_customise_sources(
        cls, settings_cls: type[BaseSettings], init_settings: PydanticBaseSettingsSource, *_: Any, **__: Any
    ) -> tuple[PydanticBaseSettingsSource, ...]:
        """Settings that the command line states, and nothing else."""
        return (init_settings,)


Parsed = TypeVar("Parsed", bound=Options)


class _Parser(argparse.ArgumentParser):
    """The library leaves with a page of usage, or says "error parsing CLI" without where help is."""

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message} (see: {self.prog} --help)")


def parse(options: type[Parsed], words: Sequence[str], prog: str, epilog: str | None = None) -> Parsed:
    """The options that a command line states. Raises UsageError."""
    parser = _Parser(
        prog=prog,
        description=options.__doc__,
        epilog=epilog,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    source = CliSettingsSource[_Parser](
        options, root_parser=parser, add_argument_method=_add_argument, add_subparsers_method=_add_subparsers
    )
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            action.metavar = "COMMAND"
    try:
        return CliApp.run(options, list(words), cli_settings_source=source)
    except ValidationError as error:
        said = []
        for place, text in mistakes_in(error, options):
            *above, name = [part for part in place if isinstance(part, str)]
            see = f"(see: {' '.join([prog, *above])} --help)"
            said.append(f"argument --{name.replace('_', '-')}: {text} {see}")
        raise UsageError(*said) from None
    except SettingsError as error:
        parser.error(str(error))


def _add_argument(parser: argparse.ArgumentParser, *names: str, **how: Any) -> None:
    """The library ends every help with a default, also where there is none."""
    for ending in (f"(default: {NULL})", "(default: ())", "(required)"):
        how["help"] = how["help"].removesuffix(ending).rstrip()
    parser.add_argument(*names, **how)


def _add_subparsers(parser: argparse.ArgumentParser, **how: Any) -> object:
    """The library takes a command line without a command."""
    return parser.add_subparsers(**how, required=True)


DISTRIBUTION, NOT_FOR_USERS = "asset2sim", ("dev", "browser")
OTHER_NAMES = {"pxr": "usd-core", "pybullet_utils": "pybullet"}
"""Imported package → distribution of another name that has it."""
_REQUIREMENT = re.compile(r"""^([\w.-]+).*;.*extra\s*==\s*['"]([\w-]+)['"]""")


def missing_package(error: ModuleNotFoundError) -> Exception:
    """The error for a package that cannot be imported: UsageError with what to install where an extra brings it, else
    the error itself, which is a broken program's."""
    package = (error.name or "").partition(".")[0]
    extra = extra_with(OTHER_NAMES.get(package, package))
    if extra is None:
        return error
    return UsageError(f"this needs {package}, which is not installed: pip install '{DISTRIBUTION}[{extra}]'")


def extra_with(name: str) -> str | None:
    """The first extra that brings a distribution; None where none does, or we are not installed."""
    try:
        requirements = metadata.requires(DISTRIBUTION) or []
    except metadata.PackageNotFoundError:
        return None
    wanted = name.replace("_", "-").lower()
    for found in filter(None, map(_REQUIREMENT.match, requirements)):
        distribution, extra = found.groups()
        if distribution.replace("_", "-").lower() == wanted and extra not in NOT_FOR_USERS:
            return extra
    return None


Schema = Mapping[str, Any]


Place = tuple[int | str, ...]


def mistakes_in(error: ValidationError, model: type[BaseModel]) -> Iterator[tuple[Place, str]]:
    """Where each refused value stands, and what is wrong with it: "'0' is not a whole number from 1 on"."""
    told = set[Place]()
    for found in error.errors(include_url=False):
        # Of a list one, and of what may be of several kinds.
        field = tuple(part for part in found["loc"] if isinstance(part, str))
        if field not in told:
            told.add(field)
            yield found["loc"], _mistake(found, model)


def _mistake(found: ErrorDetails, model: type[BaseModel]) -> str:
    place = found["loc"]
    if found["type"] == "value_error":
        return str(found["ctx"]["error"])
    schema = schema_at(model, place)
    value = ", ".join(map(str, found["input"])) if isinstance(found["input"], list) else found["input"]
    if "enum" in schema or "const" in schema:
        return f"invalid choice: '{value}' (choose from {', '.join(schema.get('enum', [schema.get('const')]))})"
    if found["type"] in ("missing", "too_short", "too_long"):
        whole = schema_at(model, [part for part in place if isinstance(part, str)])
        return f"expected {whole.get('minItems', 1)} arguments"
    return f"'{value}' is not {condition_in_words(schema)}"


def condition_in_words(schema: Schema) -> str:
    """Condition of a value, in words: "a number above 0"."""
    kinds = {"integer": "a whole number", "number": "a number", "boolean": "true or false", "string": "a text"}
    kind = kinds.get(schema.get("type", ""))
    if kind is None:
        return "a list" if schema.get("type") == "array" else "a section of fields"
    above, least, most = (schema.get(name) for name in ("exclusiveMinimum", "minimum", "maximum"))
    if above is not None:
        return f"{kind} above {above:g}"
    if least is not None:
        return f"{kind} from {least:g} {'on' if most is None else f'to {most:g}'}"
    return kind


def schema_at(model: type[BaseModel], place: Sequence[int | str]) -> Schema:
    """The JSON schema of the field at a place in a model; what else may be null is left out."""
    root = model.model_json_schema()
    schema = _resolved(root, root)
    for part in place:
        if isinstance(part, str):
            schema = schema.get("properties", {}).get(part, {})
        else:
            schema = schema.get("items") or (schema.get("prefixItems", [])[part : part + 1] or [{}])[0]
        schema = _resolved(schema, root)
    return schema


def _resolved(schema: Schema, root: Schema) -> Schema:
    while "$ref" in schema or "anyOf" in schema:
        if "$ref" in schema:
            schema = root["$defs"][schema["$ref"].rpartition("/")[2]]
        else:
            schema = next(kind for kind in schema["anyOf"] if kind.get("type") != "null")
    return schema
