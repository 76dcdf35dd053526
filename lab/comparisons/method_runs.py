"""Runs of a comparison: methods × models, each with an output folder of its own."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, BeforeValidator, Field
from pydantic_settings import CliPositionalArg
from typing_extensions import TypeAliasType

from asset2sim.baselines.declared_method import known_methods
from asset2sim.runs.command_line import parse
from asset2sim.runs.option_groups import FileOptions, Selection
from asset2sim.runs.option_types import ENGINES, FILE, NAME, URL, Listed, none_if_empty
from asset2sim.runs.request import merged_mappings, settings_for_run, stated_settings
from lab.noise.noise_level import MAX_LEVEL, NOISY, is_noisy, noise_of
from lab.options import METHODS as METHOD_NAMES
from schemas.errors import UsageError
from schemas.location import Location
from schemas.settings import Settings
from schemas.vocabulary import Engine, Method

METHODS = tuple(known_methods())
"""Every method, in the order of the tables: the paper's, the trivial baseline, and the raw asset."""
WITHOUT_MODEL = tuple(method for method, item in known_methods().items() if not item.asks)
"""Methods without model calls: each is run once, however many models are compared."""
NO_MODEL = "none"
"""Model name of those methods in the tables."""


@dataclass(frozen=True)
class MethodRun:
    """One run of the flow. ``label`` is what the tables call its model, ``folder`` is below the comparison's output."""

    method: Method
    model: str
    folder: Path

    @property
    def label(self) -> str:
        """The model's name in the tables; ``NO_MODEL`` for a method without model calls."""
        return NO_MODEL if self.method in WITHOUT_MODEL else self.model

    def settings(self, base: Settings) -> Settings:
        """The settings of this run."""
        model = base.model.model_copy(update={"model": self.model})
        return base.model_copy(update={"method": self.method, "model": model})


def planned_runs(out: Path, methods: Sequence[Method], models: Sequence[str]) -> tuple[MethodRun, ...]:
    """A run for each method and model; one for a method that asks none. Raises UsageError for no method or model."""
    if not methods or not models:
        raise UsageError("name at least one method and one model")
    runs: list[MethodRun] = []
    for method in methods:
        for model in models[:1] if method in WITHOUT_MODEL else models:
            label = NO_MODEL if method in WITHOUT_MODEL else model
            runs.append(MethodRun(method, model, out / method.value / slug(label)))
    folders = [run.folder for run in runs]
    for run in runs:
        if folders.count(run.folder) > 1:
            raise UsageError(f"two models share the folder {run.folder}; name each model once")
    return tuple(runs)


def slug(model: str) -> str:
    """Folder name for a model."""
    return re.sub(r"[^A-Za-z0-9.@=-]+", "_", model).strip("._") or "model"


def noisy_models(levels: Sequence[float]) -> tuple[str, ...]:
    """The simulated fallible models of these levels; level 1 is the model itself."""
    return tuple(NOISY if level == 1.0 else f"{NOISY}@{level:g}" for level in levels)


def level_of(model: str) -> float | None:
    """The error level of a simulated fallible model; None for any other."""
    noise = noise_of(model) if is_noisy(model) else None
    return None if noise is None else noise.level


def in_order(methods: Sequence[Method]) -> tuple[Method, ...]:
    """The methods in the tables' order; all where none is named."""
    return tuple(method for method in METHODS if method in methods) or METHODS


def levels_of(text: str | None) -> tuple[float, ...]:
    """The error levels that a text names. Raises ValueError."""
    try:
        levels = {float(word) for word in (text or "").split(",") if word.strip()}
    except ValueError:
        levels = {-1.0}
    if not all(0.0 <= level <= MAX_LEVEL for level in levels):
        raise ValueError(f"'{text}': give numbers from 0 to {MAX_LEVEL:g}, such as 0,0.5,1,2,4")
    return tuple(sorted(levels))


def of_levels(text: str) -> str:
    """The text, where it names levels. Raises ValueError."""
    levels_of(text)
    return text


Folder = Annotated[Path, BeforeValidator(lambda text: Location(text).folder)]
MODELS = TypeAliasType("MODELS", tuple[str, ...])
LEVELS = TypeAliasType("LEVELS", Annotated[str, AfterValidator(of_levels)])


class CompareMethodsOptions(Selection, FileOptions):
    """Compare methods and models on the same objects."""

    data: CliPositionalArg[Folder] = Field(description="a dataset, as asset2sim refine takes it")
    out: CliPositionalArg[Annotated[Folder, AfterValidator(Path.resolve)]] = Field(
        description="the output folder: one folder for each method and model, and the tables"
    )
    methods: Annotated[Listed[METHOD_NAMES], AfterValidator(in_order)] = Field(
        METHODS, description=f"methods, of {', '.join(Method)} (default: all)"
    )
    models: Listed[MODELS] = Field((), description=f"any LiteLLM models (default: {NOISY})")
    levels: LEVELS | None = Field(None, description=f"also {NOISY} at these error levels, such as 0,0.5,1,2,4")
    engines: Annotated[Listed[ENGINES | None], AfterValidator(none_if_empty)] = Field(
        (Engine.PYBULLET,), description="engines to verify in (default: pybullet)"
    )
    api_base: URL | None = Field(None, description="the address of a server of your own for the models")
    judge_model: NAME | None = Field(None, description="a vision model that scores every asset against its prompt")
    page: FILE | None = Field(None, description="write the tables and charts between this file's markers")
    first: FILE | None = Field(None, description="write one table over all methods and models between this file's")
    shapes: FILE | None = Field(None, description="write Φ of every method on the same shapes between this file's")

    @property
    def all_models(self) -> tuple[str, ...]:
        """The models, the default one first, so that the documentation's tables are of it."""
        levels = noisy_models(levels_of(self.levels))
        models = self.models or ((NOISY,) if NOISY in levels or not levels else ())
        return tuple(dict.fromkeys((*models, *levels)))

    def shared_settings(self) -> Settings:
        """The settings that all runs share. Raises UsageError for a settings file that cannot be read."""
        stated = merged_mappings(stated_settings(self), {"views": {"write": False}})
        return settings_for_run(self.settings, stated, {"engine": {"verify": (Engine.PYBULLET,)}})


def parse_request(words: Sequence[str]) -> CompareMethodsOptions:
    """The comparison that a command line asks for. Raises UsageError."""
    return parse(CompareMethodsOptions, words, "python -m lab.flows.compare_methods")
