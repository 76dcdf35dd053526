"""Declarations of checks, engines and methods, in modules of a package or from outside it, and extensions.

An installed distribution names, in an entry point of the group ``asset2sim.extensions``, a module that declares a
check, an engine or a method, or an ``Extension``, which names such modules and adds commands, tables and more. A file
that the environment variable ``ASSET2SIM_DECLARED`` names declares as well (several are parted as in ``PATH``); child
processes inherit it.
"""

import functools
import os
import pkgutil
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from importlib import import_module
from importlib.metadata import entry_points
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Self

GROUP = "asset2sim.extensions"
VARIABLE = "ASSET2SIM_DECLARED"
CHECK, ENGINE, METHOD = "CHECK", "ENGINE", "METHOD"
"""Names of declarations in their modules."""
KINDS = {"FailureMode": CHECK, "Engine": ENGINE, "Method": METHOD}
"""Kind of values → what is declared by the modules that add to it as they are imported."""
HOMES = {CHECK: "asset2sim.checks", METHOD: "asset2sim.baselines"}
"""Name of a declaration → the product's package of modules that have one; engines are imported one by one."""


@dataclass(frozen=True)
class DeclaredCommand:
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
    """Columns (``schemas.table.Column``) that it adds to ``assets``; ``StageResult.further`` has their values."""
    sources: tuple[str, ...]
    """Modules and packages that decide what it finds, which the content hash of an asset counts."""


@dataclass(frozen=True)
class LocalModel:
    """A model of this process: ``name`` alone, or ``name@…`` with parameters."""

    name: str
    form: str
    """How names with parameters are written, for messages."""
    label: str
    """Words beside its name in reports."""
    answers: str
    """Function of the model's whole name to a function of a question, its conversation and the number of the sample,
    to the answer's text. Raises UnknownChoiceError for parameters that it does not know."""
    sources: tuple[str, ...]
    """Modules and packages that decide its answers, as for a check."""


@dataclass(frozen=True)
class Extension:
    """Additions of a distribution. What it refers to is written ``module:attribute`` and imported where it is used, so
    that a list of names costs nothing."""

    commands: tuple[DeclaredCommand, ...] = ()
    checks: tuple[FurtherCheck, ...] = ()
    models: tuple[LocalModel, ...] = ()
    tables: str = ""
    """Name → ``schemas.table.Table`` of tables beside the catalog: a folder ``NAME`` of Parquet files in an output."""
    declares: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """``CHECK``, ``ENGINE`` or ``METHOD`` → modules that declare one, or packages of such modules."""
    offline: Mapping[str, str] = field(default_factory=dict)
    """Purpose of a method's question → function that makes the offline model's answer of an ``ObjectInfo`` and the
    overlay that the tables give; ``TOOLS`` → that of messages, which have tools, and a function from a question to an
    overlay as JSON, to the text and the tool calls of the next message."""


TOOLS = "tools"
"""In ``Extension.offline``: conversations with tools, whatever their purpose."""


@functools.cache
def extensions() -> tuple[Extension, ...]:
    """The extensions of all installed distributions, by the names of their entry points."""
    found = [point.load() for point in sorted(entry_points(group=GROUP))]
    return tuple(
        item if isinstance(item, Extension) else Extension(declares=dict.fromkeys(KINDS.values(), (item.__name__,)))
        for item in found
    )


class OpenValues(StrEnum):
    """Values to which modules outside the package may add their own."""

    @classmethod
    def add(cls, value: str) -> Self:
        """The member of this value, made if there is none."""
        if value not in cls._value2member_map_:
            member = str.__new__(cls, value)
            member._name_, member._value_ = value.upper().replace("-", "_"), value
            cls._member_names_.append(member._name_)
            cls._member_map_[member._name_] = cls._value2member_map_[value] = member
        return cls(value)

    @classmethod
    def _missing_(cls, value: object) -> Self | None:
        declared(KINDS[cls.__name__])
        found = cls._value2member_map_.get(value)
        return found if isinstance(found, cls) else None


@functools.cache
def outside(kind: str, files: str) -> tuple[ModuleType, ...]:
    """The modules from outside the package that may declare ``kind``; ``files`` is the environment variable's value."""
    places = [place for item in extensions() for place in item.declares.get(kind, ())]
    modules = [module for place in places for module in modules_in(place)]
    return (*modules, *(module_of(Path(file)) for file in files.split(os.pathsep) if file))


def modules_in(name: str) -> list[ModuleType]:
    """The modules of a package by their names, or the one module of that name."""
    found = import_module(name)
    if not hasattr(found, "__path__"):
        return [found]
    return [import_module(f"{name}.{item.name}") for item in pkgutil.iter_modules(found.__path__)]


@functools.cache
def module_of(file: Path) -> ModuleType:
    """The module of a file outside all packages, imported under its own name as ``asset2sim_declared_NAME``, so that
    what it defines can be pickled. Raises ImportError where there is no such Python file."""
    name = f"asset2sim_declared_{file.stem}"
    spec = spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise ImportError(f"{VARIABLE} names {file}, which is not a Python file")
    module = module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def outside_code() -> bytes:
    """The files that the environment variable names, as they are: what is found depends on them."""
    return b"".join(Path(file).read_bytes() for file in os.environ.get(VARIABLE, "").split(os.pathsep) if file)


def declared(kind: str) -> list[object]:
    """Values of the name ``kind`` in the modules of its package, by file name, then in those from outside."""
    own = modules_in(HOMES[kind]) if kind in HOMES else []
    modules = (*own, *outside(kind, os.environ.get(VARIABLE, "")))
    return [getattr(module, kind) for module in modules if hasattr(module, kind)]
