"""Settings as a file in YAML or TOML: read with its mistakes named, and written with units and reasons."""

import ast
import difflib
import inspect
import json
import re
import textwrap
import tomllib
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import yaml
from pydantic import BaseModel, ValidationError

from asset2sim.runs.command_line import Place, mistakes_in, schema_at
from schemas.errors import UsageError
from schemas.secret import WHOLE
from schemas.settings import Settings

DEFAULTS = Settings()
COMMENT_WIDTH = 118


class _Loader(yaml.SafeLoader):
    """YAML as PyYAML reads it, where 1e-5 is a number, as in YAML 1.2."""


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"[-+]?\d+(\.\d*)?[eE][-+]?\d+$"), list("-+0123456789")
)


def read_settings(file: Path) -> dict[str, Any]:
    """The fields that a settings file states, by section. Raises UsageError, which names the file and the field."""
    text = _text(file)
    content = _parsed(text, file)
    if not isinstance(content, dict):
        raise UsageError(f"{file}: it holds no fields; `asset2sim settings` prints what a settings file looks like")
    # A section whose every line is commented out reads as null.
    stated = {
        str(name): {} if value is None and isinstance(getattr(DEFAULTS, str(name), None), BaseModel) else value
        for name, value in content.items()
    }
    try:
        # As JSON, so that a text is no number and true is not 1, and yet a list is a tuple and a word a choice.
        Settings.model_validate_json(json.dumps(stated, default=str), strict=True)
    except ValidationError as error:
        unknown = [found["loc"] for found in error.errors() if found["type"] == "extra_forbidden"]
        said = [(place, _unknown(place)) for place in unknown]
        said += [(place, f"{'.'.join(map(str, place))}: {wrong}") for place, wrong in mistakes_in(error, Settings)
                 if place not in unknown]  # fmt: skip
        by_line = sorted((_line(text, place), wrong) for place, wrong in said)
        raise UsageError(*(f"{file}, line {line}: {wrong}" for line, wrong in by_line)) from None
    return stated


def settings_text(settings: Settings, form: Literal["yaml", "toml"]) -> str:
    """Every field with its unit and its reason as a comment; ``read_settings`` reads it back as it is."""
    sections = [(name, value) for name, value in settings if isinstance(value, BaseModel)]
    lines = ["# Settings of a run, for --settings. What is left out has its built-in value.", ""]
    lines += _fields(settings, form, "")
    for name, section in sections:
        lines += ["", *_comment(inspect.getdoc(type(section)) or "", "")]
        lines += [f"[{name}]" if form == "toml" else f"{name}:"]
        lines += _fields(section, form, "" if form == "toml" else "  ")
    return "\n".join(lines) + "\n"


def _text(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8")
    except OSError as error:
        raise UsageError(f"{file}: it cannot be read ({error.strerror}); name a settings file") from None
    except UnicodeDecodeError as error:
        raise UsageError(f"{file}: it cannot be read: {error}") from None


def _parsed(text: str, file: Path) -> object:
    try:
        match file.suffix.lower():
            case ".yaml" | ".yml":
                content = yaml.load(text, _Loader)
                return {} if content is None else content
            case ".toml":
                return tomllib.loads(text)
    except (yaml.YAMLError, tomllib.TOMLDecodeError) as error:
        raise UsageError(f"{file}: it cannot be read: {' '.join(str(error).split())}") from None
    raise UsageError(f"{file}: a settings file ends in .yaml, .yml or .toml")


def _line(text: str, place: Place) -> int:
    """The line of a settings file at which a field, or what it is part of, is stated; in YAML and in TOML."""
    lines, line = text.splitlines(), 1
    for name in (part for part in place if isinstance(part, str)):
        begins = re.compile(rf"[\s\[\"']*([\w-]+\.)*{re.escape(name)}[\"']?\s*[\]:=]")
        line = next((number for number in range(line, len(lines) + 1) if begins.match(lines[number - 1])), line)
    return line


def _unknown(place: tuple[int | str, ...]) -> str:
    """Advice on a field that there is not: the nearest name beside it, or where a field of its name stands."""
    *above, name = map(str, place)
    beside = list(schema_at(Settings, above)["properties"])
    elsewhere = [f"{section}.{name}" for section, value in DEFAULTS if hasattr(value, name) and section != name]
    near = [".".join([*above, found]) for found in difflib.get_close_matches(name, beside, n=1)] or elsewhere[:1]
    hint = f"did you mean {near[0]}?" if near else f"choose from {', '.join(beside)}"
    return f"unknown field {'.'.join([*above, name])}; {hint}"


def _fields(model: BaseModel, form: str, indent: str) -> Iterator[str]:
    reasons = _reasons(type(model))
    for name, value in json.loads(model.model_dump_json(context={WHOLE: True})).items():
        if isinstance(value, dict):
            continue
        yield from _comment(reasons.get(name, ""), indent)
        if form == "yaml":
            shown = yaml.safe_dump([value], default_flow_style=True, allow_unicode=True, width=10_000)
            yield f"{indent}{name}: {shown.strip()[1:-1]}"
        else:
            # TOML knows no null, and None is built in wherever it is a setting's value.
            yield f"# {name} =" if value is None else f"{name} = {json.dumps(value, ensure_ascii=False)}"


def _comment(text: str, indent: str) -> list[str]:
    start = f"{indent}# "
    text = " ".join(text.split()).replace("``", "").replace("None", "null")
    return textwrap.wrap(text, COMMENT_WIDTH, initial_indent=start, subsequent_indent=start)


def _reasons(model: type[BaseModel]) -> dict[str, str]:
    """Field → the docstring below it: its unit, and why it has its value."""
    (definition,) = ast.parse(inspect.getsource(model)).body
    assert isinstance(definition, ast.ClassDef)
    found = {}
    for field, below in pairwise(definition.body):
        if isinstance(field, ast.AnnAssign) and isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant):
            found[ast.unparse(field.target)] = str(below.value.value)
    return found
