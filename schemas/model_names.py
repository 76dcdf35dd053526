"""Names of the models: those of this process, and which of a run's models answers which purpose, at which address."""

import re

from schemas.errors import UnknownChoiceError
from schemas.settings import ModelSettings

PRIOR_PROVIDER = "prior"
PRIOR_MODELS: tuple[str, ...] = ("prior/household", "prior/noisy")
NOISY = "prior/noisy"
NOISY_FORM = "prior/noisy[@LEVEL[:SEED]]"
"""Name of a simulated fallible model: its error level (0 to 10; 1, the default, is the paper's) and its seed."""
NOISY_LABEL = "simulation of a fallible model"
"""Label for all numbers of such a model: they say nothing about any real model."""
MAX_LEVEL = 10.0
"""Largest error level: beyond it every answer is wrong in every way."""
REFINEMENT_PURPOSE = "refinement"
JUDGE_PURPOSE = "judge"

_NOISY = re.compile(r"prior/noisy(?:@(\d{1,4}(?:\.\d{1,6})?)(?::(\d{1,9}))?)?")


def is_prior(model: str) -> bool:
    """Whether the model runs in this process, whatever its name says after the slash."""
    return _prefix(model) == PRIOR_PROVIDER


def is_noisy(model: str) -> bool:
    """Whether the model is a simulation of a fallible one; for any name, valid or not."""
    return model == NOISY or model.startswith(f"{NOISY}@")


def noise_parameters(model: str) -> tuple[float, int] | None:
    """Level and seed of the errors that a model in this process makes; None for the offline prior itself. Raises
    ``UnknownChoiceError`` for a name that is none of ``PRIOR_MODELS`` and not of the form ``NOISY_FORM``."""
    if model == "prior/household":
        return None
    found = _NOISY.fullmatch(model)
    level = float(found.group(1) or 1.0) if found else MAX_LEVEL + 1.0
    if found is None or level > MAX_LEVEL:
        raise UnknownChoiceError(
            "model", model, ("prior/household", f"{NOISY_FORM} with LEVEL 0 to {MAX_LEVEL:g} (such as prior/noisy@2:7)")
        )
    return level, int(found.group(2) or 0)


def described(model: str) -> str:
    """The model's name in reports, with a label where its errors are simulated."""
    return f"{model} ({NOISY_LABEL})" if is_noisy(model) else model


def model_for(settings: ModelSettings, purpose: str) -> str:
    """The model that is asked for this purpose: the one that is named for it, else ``settings.model``."""
    named = {REFINEMENT_PURPOSE: settings.refinement_model, JUDGE_PURPOSE: settings.judge_model}
    return named.get(purpose) or settings.model


def named_models(settings: ModelSettings) -> tuple[str, ...]:
    """Every model that the settings name, each once."""
    models = (settings.model, settings.refinement_model, settings.judge_model)
    return tuple(dict.fromkeys(model for model in models if model is not None))


def settings_for(settings: ModelSettings, model: str) -> ModelSettings:
    """The settings for a call of one of the named models. ``api_base`` is the address of one server, so it goes with
    one provider: that of the first named model that does not run in this process. A model of another provider is asked
    at its default address."""
    addressed = next((_prefix(name) for name in named_models(settings) if not is_prior(name)), None)
    api_base = settings.api_base if _prefix(model) == addressed else None
    return settings.model_copy(
        update={"model": model, "api_base": api_base, "refinement_model": None, "judge_model": None}
    )


def _prefix(model: str) -> str:
    return model.split("/", 1)[0]
