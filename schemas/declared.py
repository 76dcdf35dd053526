"""Modules that declare a check, an engine or a method: those of a package, and those that come from outside it.

From outside: a module that an installed distribution names in an entry point of the group ``asset2sim.declared``, or a
file that the environment variable ``ASSET2SIM_DECLARED`` names (several are parted as in ``PATH``), which child
processes inherit.
"""

import functools
import os
import pkgutil
import sys
from enum import StrEnum
from importlib import import_module
from importlib.metadata import entry_points
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Self

GROUP = "asset2sim.declared"
VARIABLE = "ASSET2SIM_DECLARED"
HOMES = {"FailureMode": "asset2sim.checks", "Method": "asset2sim.baselines"}
"""Kind of values → package whose modules add to it as they are imported."""


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
        outside(os.environ.get(VARIABLE, ""))
        if cls.__name__ in HOMES:
            declared(HOMES[cls.__name__], "")
        found = cls._value2member_map_.get(value)
        return found if isinstance(found, cls) else None


@functools.cache
def outside(files: str) -> tuple[ModuleType, ...]:
    """The declaring modules that come from outside the package; ``files`` is the environment variable's value."""
    points = [point.load() for point in sorted(entry_points(group=GROUP))]
    return (*points, *(module_of(Path(file)) for file in files.split(os.pathsep) if file))


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
    """The sources of the modules from outside, as they are: what they find depends on them."""
    modules = outside(os.environ.get(VARIABLE, ""))
    return b"".join(Path(module.__file__).read_bytes() for module in modules if module.__file__)


def declared(package: str, name: str) -> list[object]:
    """Values of ``name`` in the modules of a package that have one, by file name, then in those from outside."""
    own = [import_module(f"{package}.{item.name}") for item in pkgutil.iter_modules(import_module(package).__path__)]
    return [getattr(module, name) for module in own if hasattr(module, name)] + outside_values(name)


def outside_values(name: str) -> list[object]:
    """Values of ``name`` in the modules from outside that have one."""
    modules = outside(os.environ.get(VARIABLE, ""))
    return [getattr(module, name) for module in modules if hasattr(module, name)]
