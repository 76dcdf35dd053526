"""API keys: which variable a model's key is read from."""

import ipaddress
import os
from collections.abc import Sequence
from urllib.parse import urlsplit

from asset2sim.models.gateway.environment import load_litellm
from schemas.model_names import is_local
from schemas.settings import ModelSettings

_AMBIENT_PROVIDERS = ("azure", "azure_ai", "bedrock", "sagemaker", "vertex_ai", "vertex_ai_beta")
"""Providers whose credentials may also come from a profile, a role or a login: a missing variable proves nothing."""


def find_provider(model: str) -> str | None:
    """LiteLLM's name for the model's provider, or None where the name belongs to none."""
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
        return is_local(settings.model) or settings.model.startswith(("ollama/", "ollama_chat/"))
    if host == "localhost" or host.endswith((".local", ".internal")):
        return True
    try:
        return ipaddress.ip_address(host).is_private
    except ValueError:
        return False
