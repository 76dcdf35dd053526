"""API keys: which variable a model's key is read from, and their removal from everything that is written or shown."""

import ipaddress
import os
import re
from collections.abc import Sequence
from urllib.parse import urlsplit

from asset2sim.models.gateway.lite import load_litellm
from schemas.model_names import is_local
from schemas.settings import ModelSettings

_AMBIENT_PROVIDERS = ("azure", "azure_ai", "bedrock", "sagemaker", "vertex_ai", "vertex_ai_beta")
"""Providers whose credentials may also come from a profile, a role or a login: a missing variable proves nothing."""

SHORTEST_SECRET = 8
"""Characters from which a variable's value counts as a secret: shorter ones are words like ``none``."""

_SECRET_NAME = re.compile(r"KEY|TOKEN|SECRET|PASSWORD|CREDENTIAL", re.IGNORECASE)
_SECRET_SHAPE = re.compile(
    r"(?i)\b(?:sk|pk|rk|gsk|xai|hf|r8)[-_][\w*.-]{6,}"  # keys as OpenAI, Anthropic, Groq, xAI and others shape them
    r"|\bAIza[\w*-]{10,}|\bAKIA[\w*]{8,}"
    r"|\bbearer\s+[^\s'\",}]+"
    r"|(?<=key=)[^\s&'\",}]+"
    r"|(?<=://)[^/\s@]+(?=@)"
)
_ESCAPED = re.compile(r"(?<!\\)((?:\\\\)*)(?:\\u00([0-9a-fA-F]{2})|\\(/))")
REDACTED = "***"


def redact(text: str) -> str:
    """The text without anything that looks like a key or stands in a secret's environment variable."""
    for value in _secrets():
        text = text.replace(value, REDACTED)
    return _SECRET_SHAPE.sub(REDACTED, text)


def redact_answer(text: str) -> str:
    """A model's answer without the keys that this process holds, should a server echo one.

    Only values are looked for, not shapes: a part may be called ``sk_handle_01``. A key that is spelt with JSON escapes
    is found too; the answer is then written without them, which leaves its meaning. Values of letters or of digits
    alone are left, since an answer is made of words and numbers.
    """
    secrets = [value for value in _secrets() if not value.isalpha() and not value.isdigit()]
    plain = _ESCAPED.sub(_unescaped, text)
    if any(value in plain for value in secrets):
        text = plain
    for value in secrets:
        text = text.replace(value, REDACTED)
    return text


def _secrets() -> list[str]:
    """Values of variables that are named like secrets, longest first: one may be part of another."""
    values = {text for name, text in os.environ.items() if len(text) >= SHORTEST_SECRET and _SECRET_NAME.search(name)}
    return sorted(values, key=lambda value: (-len(value), value))


def _unescaped(match: re.Match[str]) -> str:
    character = chr(int(match.group(2), 16)) if match.group(2) else match.group(3)
    return match.group(0) if character in '"\\' or not character.isprintable() else match.group(1) + character


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
