"""Models of a run: their settings, names of those of this process, and which answers which purpose and where."""

import re

from pydantic import Field

from schemas.base import Frozen, NonNegative, Positive
from schemas.errors import UnknownChoiceError
from schemas.secret import Address

PRIOR_PROVIDER = "prior"
PRIOR_MODELS: tuple[str, ...] = ("prior/household", "prior/noisy")
RECORDED_PROVIDER = "recorded"
RECORDED_FORM = "recorded/<folder>"
"""Name of recorded answers: a folder of files, relative to where the run was started."""
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


class ModelSettings(Frozen):
    """Which model answers, how patiently it is asked, and what it may cost."""

    model: str = "prior/household"
    """Answers syntheses, and everything else for which no other model is named."""
    refinement_model: str | None = None
    """Proposes steps of the state; None stands for ``model``."""
    judge_model: str | None = None
    """Looks at the refined object and scores it against its prompt; None: no score."""
    api_base: Address | None = None
    temperature: NonNegative = 0.0
    timeout_s: Positive = 120.0
    """Time limit of one request, s."""
    max_attempts: int = Field(4, ge=1)
    """Attempts at one request where the provider answers 429, 5xx or not at all."""
    max_completion_tokens: int = Field(16_384, ge=1)
    image_side_px: int = Field(512, ge=64)
    """Longest side of an image that is sent, px: what most providers bill as one tile."""
    cache: bool = True
    """Whether a cached answer is used instead of a new call."""
    requests_per_minute: Positive | None = None
    """Most requests a minute to one provider, over all workers of a run; None: as many as it lets through."""
    concurrent_requests: int = Field(8, ge=1)
    """Most requests to one provider at the same time, over all workers of a run."""
    asset_calls: int | None = Field(None, ge=0)
    """Most calls for one asset, attempts counted; None here and below: no limit."""
    asset_tokens: int | None = Field(None, ge=0)
    asset_usd: NonNegative | None = None
    run_calls: int | None = Field(None, ge=0)
    run_tokens: int | None = Field(None, ge=0)
    run_usd: NonNegative | None = None


def is_prior(model: str) -> bool:
    """Whether the model runs in this process, whatever its name says after the slash."""
    return _prefix(model) == PRIOR_PROVIDER


def is_recorded(model: str) -> bool:
    """Whether the model is a folder of recorded answers."""
    return _prefix(model) == RECORDED_PROVIDER


def recorded_folder(model: str) -> str:
    """The folder of a recorded model, as the user wrote it; empty where the name has none."""
    return model.partition("/")[2]


def is_local(model: str) -> bool:
    """Whether no server is asked: the model runs in this process, or its answers are files."""
    return is_prior(model) or is_recorded(model)


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
        noisy = f"{NOISY_FORM} with LEVEL 0 to {MAX_LEVEL:g} (such as prior/noisy@2:7)"
        raise UnknownChoiceError("model", model, ("prior/household", noisy))
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
    one provider: that of the first named model that is asked at a server. A model of another provider is asked
    at its default address."""
    addressed = next((_prefix(name) for name in named_models(settings) if not is_local(name)), None)
    api_base = settings.api_base if _prefix(model) == addressed else None
    own = {"model": model, "api_base": api_base, "refinement_model": None, "judge_model": None}
    return settings.model_copy(update=own)


def _prefix(model: str) -> str:
    return model.split("/", 1)[0]
