"""Formats in which assets are described: each module of this folder that declares a ``FORMAT`` is one."""

from collections.abc import Mapping
from importlib import import_module
from pkgutil import iter_modules

from asset2sim.intake.formats.format import Format


def declared() -> Mapping[str, Format]:
    """Suffix → format, in the order of their ranks."""
    modules = (import_module(f"{__name__}.{module.name}") for module in iter_modules(__path__))
    found: list[Format] = [module.FORMAT for module in modules if hasattr(module, "FORMAT")]
    return {
        suffix: item for item in sorted(found, key=lambda item: item.rank) for suffix in (item.suffix, *item.further)
    }


FORMATS = declared()
PREFERRED = tuple(item.preferred for item in FORMATS.values() if item.preferred)
NOT_MODELS = tuple(name for item in FORMATS.values() for name in item.not_models)
