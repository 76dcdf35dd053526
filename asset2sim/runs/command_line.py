"""From words to options: pydantic-settings' command line, with a mistake as one line."""

import argparse
from collections.abc import Sequence
from typing import Any, NoReturn, TypeVar

from pydantic import ValidationError
from pydantic_settings import (
    BaseSettings,
    CliApp,
    CliSettingsSource,
    PydanticBaseSettingsSource,
    SettingsConfigDict,
    SettingsError,
)

from asset2sim.runs.mistakes import mistakes_in
from schemas.errors import UsageError

OPTIONAL_VALUES = {"--views": "now"}
"""Option whose value may be left out → what it then is."""
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
    if names[0] in OPTIONAL_VALUES:
        how |= {"nargs": "?", "const": OPTIONAL_VALUES[names[0]]}
    parser.add_argument(*names, **how)


def _add_subparsers(parser: argparse.ArgumentParser, **how: Any) -> object:
    """The library takes a command line without a command."""
    return parser.add_subparsers(**how, required=True)
