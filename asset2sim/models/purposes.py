"""Which model answers which purpose, and at which address."""

from schemas.settings import ModelSettings

REFINEMENT_PURPOSE = "refinement"
JUDGE_PURPOSE = "judge"


def model_for(settings: ModelSettings, purpose: str) -> str:
    """The model that is asked for this purpose: the one that is named for it, else ``settings.model``."""
    named = {REFINEMENT_PURPOSE: settings.refinement_model, JUDGE_PURPOSE: settings.judge_model}
    return named.get(purpose) or settings.model


def named_models(settings: ModelSettings) -> tuple[str, ...]:
    """Every model that the settings name, each once."""
    models = (settings.model, settings.refinement_model, settings.judge_model)
    return tuple(dict.fromkeys(model for model in models if model is not None))


def settings_for(settings: ModelSettings, model: str) -> ModelSettings:
    """The settings for a call of one of the named models.

    ``api_base`` is the address of one server, so it goes with one provider: that of the first named model that does
    not run in this process. A model of another provider is asked at its default address.
    """
    addressed = next((_prefix(name) for name in named_models(settings) if _prefix(name) != "prior"), None)
    api_base = settings.api_base if _prefix(model) == addressed else None
    return settings.model_copy(
        update={"model": model, "api_base": api_base, "refinement_model": None, "judge_model": None}
    )


def _prefix(model: str) -> str:
    return model.split("/", 1)[0]
