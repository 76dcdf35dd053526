"""Checks before a run that the named models can be asked: provider, key, address and price."""

import ipaddress
import os
from collections.abc import Sequence
from urllib.parse import urlsplit

from asset2sim.models.purposes import named_models, settings_for
from schemas.errors import UnknownChoiceError, UsageError
from schemas.model_names import PRIOR_MODELS, is_prior, noise_parameters
from schemas.settings import ModelSettings

_AMBIENT_PROVIDERS = ("azure", "azure_ai", "bedrock", "sagemaker", "vertex_ai", "vertex_ai_beta")
"""Providers whose credentials may also come from a profile, a role or a login: a missing variable proves nothing."""

_SHOWN_CHOICES = (
    *PRIOR_MODELS,
    "anthropic/<model>",
    "azure/<deployment>",
    "bedrock/<model>",
    "gemini/<model>",
    "hosted_vllm/<model>",
    "mistral/<model>",
    "ollama/<model>",
    "openai/<model>",
    "openrouter/<model>",
    "vertex_ai/<model>",
    "or any other provider's prefix that LiteLLM knows",
)


def check_model(settings: ModelSettings) -> None:
    """Refuse models that cannot be asked, or whose budget cannot be kept. Costs nothing for priors; imports LiteLLM for
    every other model.

    Every named model is checked. Raises ``UnknownChoiceError`` for a name of no provider and ``UsageError`` for a
    missing key, a malformed address, or a budget in USD for a model that LiteLLM knows no price of.
    """
    if settings.api_base is not None:
        _check_address(settings.api_base)
    for model in named_models(settings):
        _check_named(settings_for(settings, model))


def _check_named(settings: ModelSettings) -> None:
    model = settings.model
    if is_prior(model):
        noise_parameters(model)
        return
    if find_provider(model) is None:
        raise UnknownChoiceError("model", model, _SHOWN_CHOICES)
    missing = missing_variables(settings)
    if missing:
        raise UsageError(
            f"model '{model}' needs {listed(missing)} in the environment or in .env: set it, or use {PRIOR_MODELS[0]}, "
            "which needs no key"
        )
    if settings.run_usd is not None or settings.asset_usd is not None:
        _check_price(settings)


def _check_price(settings: ModelSettings) -> None:
    from asset2sim.models.gateway.prices import price_of

    if price_of(settings) is None:
        raise UsageError(
            f"model '{settings.model}' has no price in LiteLLM's list, so no budget in USD can be kept for it; use "
            "--budget-tokens or --budget-calls"
        )


def find_provider(model: str) -> str | None:
    """LiteLLM's name for the model's provider, or None where the name belongs to none."""
    from asset2sim.models.gateway.lite import load_litellm

    try:
        return str(load_litellm().get_llm_provider(model)[1])
    except Exception:  # whatever LiteLLM raises of a name that it does not know
        return None


def missing_variables(settings: ModelSettings) -> tuple[str, ...]:
    """The environment variables that the model needs and that are not set."""
    if runs_without_key(settings) or find_provider(settings.model) in _AMBIENT_PROVIDERS:
        return ()
    return unset_variables(settings.model)


def unset_variables(model: str) -> tuple[str, ...]:
    """The environment variables that the model's provider reads its key from, where none of them is set."""
    from asset2sim.models.gateway.lite import load_litellm

    report = load_litellm().validate_environment(model)
    names = tuple(str(name) for name in report["missing_keys"] if not str(name).endswith("_BASE"))
    return () if report["keys_in_environment"] else names


def listed(variables: Sequence[str]) -> str:
    """The variable names joined by "or" where all are API keys (alternatives), else by "and"."""
    alternatives = all(name.endswith("_API_KEY") for name in variables)
    return (" or " if alternatives else " and ").join(variables)


def key_variable(model: str) -> str | None:
    """The variable that is set and most likely holds the key of this model's provider: ``<PROVIDER>_API_KEY``."""
    provider = find_provider(model)
    name = f"{provider.upper()}_API_KEY" if provider else ""
    return name if name in os.environ else None


def runs_without_key(settings: ModelSettings) -> bool:
    """Whether the model is served from this machine or its own network, where servers mostly ask for no key."""
    host = urlsplit(settings.api_base or "").hostname
    if host is None:
        return is_prior(settings.model) or settings.model.startswith(("ollama/", "ollama_chat/"))
    if host == "localhost" or host.endswith((".local", ".internal")):
        return True
    try:
        return ipaddress.ip_address(host).is_private
    except ValueError:
        return False


def _check_address(api_base: str) -> None:
    try:
        parts = urlsplit(api_base)
        usable = parts.scheme in ("http", "https") and bool(parts.hostname) and parts.port != 0
    except ValueError:
        usable = False
    if not usable:
        raise UsageError("api_base must be an address such as http://127.0.0.1:8000/v1 or https://host/v1")
