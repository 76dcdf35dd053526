"""Models of a run: their settings, names of those of this process, and which answers which purpose and where."""

from pydantic import Field

from schemas.base import Frozen, NonNegative, Positive
from schemas.extensions import local_models
from schemas.secret import Address

PRIOR_PROVIDER = "prior"
HOUSEHOLD = "prior/household"
"""The model that looks values up in our tables, in this process."""
RECORDED_PROVIDER = "recorded"
RECORDED_FORM = "recorded/<folder>"
"""Name of recorded answers: a folder of files, relative to where the run was started."""
REFINEMENT_PURPOSE = "refinement"
JUDGE_PURPOSE = "judge"


class ModelSettings(Frozen):
    """Which model answers, how patiently it is asked, and what it may cost."""

    model: str = HOUSEHOLD
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


def described(model: str) -> str:
    """The model's name in reports, with a label where an extension gives it one."""
    found = local_models().get(model.partition("@")[0])
    return f"{model} ({found.label})" if found is not None else model


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
