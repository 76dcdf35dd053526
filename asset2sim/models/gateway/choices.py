"""Checks before a run that the named models can be asked: provider, key, address and price."""

from urllib.parse import urlsplit

from asset2sim.models.gateway.prices import price_of
from asset2sim.models.gateway.recorded import check_recorded
from asset2sim.models.gateway.secrets import find_provider, listed, missing_variables
from asset2sim.models.prior.answer import answers_of
from schemas.errors import UnknownChoiceError, UsageError
from schemas.model_names import HOUSEHOLD, RECORDED_FORM, is_prior, is_recorded, named_models, settings_for
from schemas.settings import ModelSettings

_SHOWN_CHOICES = (
    HOUSEHOLD, RECORDED_FORM, "anthropic/<model>", "azure/<deployment>", "bedrock/<model>", "gemini/<model>",
    "hosted_vllm/<model>", "mistral/<model>", "ollama/<model>", "openai/<model>", "openrouter/<model>",
    "vertex_ai/<model>", "or any other provider's prefix that LiteLLM knows",
)  # fmt: skip


def check_model(settings: ModelSettings) -> None:
    """Refuse models that cannot be asked, or whose budget cannot be kept. Costs nothing for priors and recorded
    models; imports LiteLLM for every other.

    Every named model is checked. Raises ``UnknownChoiceError`` for a name of no provider and ``UsageError`` for a
    missing key, a malformed address, a recorded model without answers, or a budget in USD for a model that LiteLLM
    knows no price of.
    """
    if settings.api_base is not None:
        _check_address(settings.api_base)
    for model in named_models(settings):
        _check_named(settings_for(settings, model))


def _check_named(settings: ModelSettings) -> None:
    model = settings.model
    if is_prior(model):
        answers_of(model)
        return
    if is_recorded(model):
        check_recorded(model)
        return
    if find_provider(model) is None:
        raise UnknownChoiceError("model", model, _SHOWN_CHOICES)
    missing = missing_variables(settings)
    if missing:
        raise UsageError(
            f"model '{model}' needs {listed(missing)} in the environment or in .env: set it, or use {HOUSEHOLD}, "
            "which needs no key"
        )
    if (settings.run_usd is not None or settings.asset_usd is not None) and price_of(settings) is None:
        raise UsageError(
            f"model '{model}' has no price in LiteLLM's list, so no budget in USD can be kept for it; use "
            "--budget-tokens or --budget-calls"
        )


def _check_address(api_base: str) -> None:
    try:
        parts = urlsplit(api_base)
        usable = parts.scheme in ("http", "https") and bool(parts.hostname) and parts.port != 0
    except ValueError:
        usable = False
    if not usable:
        raise UsageError("api_base must be an address such as http://127.0.0.1:8000/v1 or https://host/v1")
