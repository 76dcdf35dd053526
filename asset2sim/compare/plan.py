"""Which runs a comparison takes: methods × models, each into a folder of its own."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from asset2sim.models.prior.noise_level import noise_of
from schemas.errors import UsageError
from schemas.model_names import NOISY, is_noisy
from schemas.settings import Settings
from schemas.vocabulary import Method

METHODS = (
    Method.REFERENCE,
    Method.IVW,
    Method.DIRECT,
    Method.ASSET2SIM,
    Method.AGENT,
    Method.NO_SEMANTICS,
    Method.RAW,
)
"""Every method, in the order of the tables: the paper's, and the asset as it came."""
WITHOUT_MODEL = (Method.REFERENCE, Method.RAW)
"""Methods that ask no model: they are run once, whatever models there are."""
NO_MODEL = "none"
"""What the tables call the model of those."""


@dataclass(frozen=True)
class Run:
    """One run of the flow. ``label`` is what the tables call its model, ``folder`` is below the comparison's output."""

    method: Method
    model: str
    folder: Path

    @property
    def label(self) -> str:
        """The model, or that there is none."""
        return NO_MODEL if self.method in WITHOUT_MODEL else self.model

    def settings(self, base: Settings) -> Settings:
        """The settings of this run."""
        model = base.model.model_copy(update={"model": self.model})
        return base.model_copy(update={"method": self.method, "model": model})


def plan(out: Path, methods: Sequence[Method], models: Sequence[str]) -> tuple[Run, ...]:
    """A run for each method and model; one for a method that asks none. Raises UsageError for no method or model."""
    if not methods or not models:
        raise UsageError("name at least one method and one model")
    runs: list[Run] = []
    for method in methods:
        for model in models[:1] if method in WITHOUT_MODEL else models:
            label = NO_MODEL if method in WITHOUT_MODEL else model
            runs.append(Run(method, model, out / method.value / slug(label)))
    folders = [run.folder for run in runs]
    for run in runs:
        if folders.count(run.folder) > 1:
            raise UsageError(f"two models share the folder {run.folder}; name each model once")
    return tuple(runs)


def slug(model: str) -> str:
    """A model's name as a folder's."""
    return re.sub(r"[^A-Za-z0-9.@=-]+", "_", model).strip("._") or "model"


def noisy_models(levels: Sequence[float]) -> tuple[str, ...]:
    """The simulated fallible models of these levels; level 1 is the model itself."""
    return tuple(NOISY if level == 1.0 else f"{NOISY}@{level:g}" for level in levels)


def level_of(model: str) -> float | None:
    """The error level of a simulated fallible model; None for any other."""
    noise = noise_of(model) if is_noisy(model) else None
    return None if noise is None else noise.level
