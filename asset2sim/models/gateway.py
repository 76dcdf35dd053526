"""One question to any model, through LiteLLM: asked patiently, counted, and answered even where the provider fails."""

import base64
import functools
import hashlib
import time
from dataclasses import dataclass
from typing import Any

from asset2sim.models import provider_errors
from asset2sim.models.choices import check_model, listed, missing_variables, runs_without_key, unset_variables
from asset2sim.models.lite import load_litellm
from asset2sim.models.priors_known import is_prior
from schemas.call import ModelCall
from schemas.request import ModelAnswer, ModelRequest
from schemas.settings import ModelSettings

__all__ = ["ask", "check_model", "prompt_hash"]

_NO_KEY = "no-key-needed"


@dataclass(frozen=True)
class Abilities:
    """What a model can take. A model that LiteLLM does not know is given images: whoever made them wants them seen."""

    images: bool
    json_mode: bool
    max_output_tokens: int | None


@dataclass(frozen=True)
class _Extras:
    """What goes with the text of one attempt."""

    images: bool
    json_mode: bool


def ask(request: ModelRequest, settings: ModelSettings) -> ModelAnswer:
    """Ask one model one question: at most ``max_attempts`` tries, one ``ModelCall`` a try.

    Tries again, after a jittered wait, where the provider answers 429, 5xx or not at all. Where a server refuses JSON
    mode or images as such (400, 415, 422), it is asked once more without. Every failure of the provider comes back as
    ``error``, one line that names the model, the cause and the remedy.
    """
    litellm = load_litellm()
    able = abilities(settings.model)
    extras = _Extras(images=able.images and bool(request.images), json_mode=able.json_mode)
    calls: list[ModelCall] = []
    failure = ""
    for attempt in range(1, settings.max_attempts + 1):
        arguments = _arguments(request, settings, able, extras)
        start = time.monotonic()
        try:
            response = litellm.completion(**arguments)
        except Exception as error:
            calls.append(_call(request, settings, attempt, time.monotonic() - start, "provider_error"))
            missing = missing_variables(settings)
            if missing:
                # Some providers' clients report this as a server fault, which it is not.
                failure = f"model '{settings.model}': no key; set {listed(missing)} in the environment"
                break
            failure = provider_errors.describe(error, settings, attempt)
            reduced = _reduced(extras, error)
            if reduced is not None:
                extras = reduced
            elif not provider_errors.is_worth_retrying(error):
                break
            elif attempt < settings.max_attempts:
                time.sleep(provider_errors.retry_delay_s(error, attempt))
            continue
        latency = time.monotonic() - start
        content = _content(response)
        outcome = "ok" if content else "provider_error"
        calls.append(_call(request, settings, attempt, latency, outcome, response))
        if content:
            return ModelAnswer(content=content, calls=tuple(calls))
        failure = _explain_silence(response, settings)
        break
    return ModelAnswer(content=None, calls=tuple(calls), error=failure)


def prompt_hash(request: ModelRequest) -> str:
    """Sixteen hexadecimal digits of the SHA-256 over system part and text."""
    text = f"{request.system}\0{request.text}"
    return hashlib.sha256(text.encode("utf-8", "replace")).hexdigest()[:16]


@functools.lru_cache(maxsize=64)
def abilities(model: str) -> Abilities:
    """What LiteLLM knows of a model, looked up once; for some providers (Ollama) it asks the model's own server."""
    litellm = load_litellm()
    if is_prior(model):
        return Abilities(images=False, json_mode=False, max_output_tokens=None)
    try:
        info: dict[str, Any] | None = dict(litellm.get_model_info(model))
    except Exception:
        info = None
    try:
        parameters = litellm.get_supported_openai_params(model) or []
    except Exception:
        parameters = []
    limit = info.get("max_output_tokens") if info else None
    return Abilities(
        images=bool(litellm.supports_vision(model)) if info else True,
        # JSON mode, never a JSON schema: the overlay's map of joint positions has free keys, which the schema modes of
        # several providers refuse or silently empty.
        json_mode="response_format" in parameters,
        max_output_tokens=limit if isinstance(limit, int) else None,
    )


def _arguments(request: ModelRequest, settings: ModelSettings, able: Abilities, extras: _Extras) -> dict[str, Any]:
    arguments: dict[str, Any] = {
        "model": settings.model,
        "messages": [
            {"role": "system", "content": request.system},
            {"role": "user", "content": _user_content(request, extras.images)},
        ],
        "temperature": settings.temperature,
        "max_completion_tokens": min(settings.max_completion_tokens, able.max_output_tokens or 1_000_000_000),
        "timeout": settings.timeout_s,
        "max_retries": 0,  # or the provider's own client would retry behind our back, uncounted
        "num_retries": 0,
        "drop_params": True,  # reasoning models refuse a temperature, for one
    }
    if settings.api_base is not None:
        arguments["api_base"] = settings.api_base
        # The provider's client would refuse to start for want of a key that a local server does not look at.
        if runs_without_key(settings) and unset_variables(settings.model):
            arguments["api_key"] = _NO_KEY
    if extras.json_mode:
        arguments["response_format"] = {"type": "json_object"}
    return arguments


def _user_content(request: ModelRequest, with_images: bool) -> str | list[dict[str, Any]]:
    if not with_images:
        return request.text
    parts: list[dict[str, Any]] = [{"type": "text", "text": request.text}]
    for image in request.images:
        url = "data:image/png;base64," + base64.b64encode(image.png).decode("ascii")
        parts.append({"type": "text", "text": f"Image: {image.label}"})
        parts.append({"type": "image_url", "image_url": {"url": url}})
    return parts


def _reduced(extras: _Extras, error: Exception) -> _Extras | None:
    """What is left to send once the provider refuses images or JSON mode by name; None where that is not it."""
    if provider_errors.status_of(error) not in (400, 415, 422):
        return None
    text = str(error).lower()
    if extras.images and ("image" in text or "vision" in text or "multimodal" in text):
        return _Extras(images=False, json_mode=extras.json_mode)
    if extras.json_mode and ("response_format" in text or "json_object" in text or "json mode" in text):
        return _Extras(images=extras.images, json_mode=False)
    return None


def _content(response: Any) -> str | None:
    try:
        content = response.choices[0].message.content
    except (AttributeError, IndexError):
        return None
    return content if isinstance(content, str) and content.strip() else None


def _explain_silence(response: Any, settings: ModelSettings) -> str:
    try:
        reason = str(response.choices[0].finish_reason)
    except (AttributeError, IndexError):
        reason = "none given"
    remedy = "raise max_completion_tokens" if reason == "length" else "try again, or choose another model"
    return f"model '{settings.model}': answered nothing (finish reason: {reason}); {remedy}"


def _call(
    request: ModelRequest, settings: ModelSettings, attempt: int, latency_s: float, outcome: str, response: Any = None
) -> ModelCall:
    usage = getattr(response, "usage", None)
    return ModelCall(
        purpose=request.purpose,
        model=settings.model,
        attempt=attempt,
        prompt_tokens=int(getattr(usage, "prompt_tokens", 0) or 0),
        completion_tokens=int(getattr(usage, "completion_tokens", 0) or 0),
        cost_usd=0.0 if response is None else _cost_usd(response, settings.model),
        latency_s=latency_s,
        cached=False,
        outcome=outcome,
        prompt_hash=prompt_hash(request),
    )


def _cost_usd(response: Any, model: str) -> float:
    """What the call cost by LiteLLM's price list, USD; 0 where the price is unknown."""
    if is_prior(model):
        return 0.0
    try:
        return float(load_litellm().completion_cost(completion_response=response, model=model))
    except Exception:
        return 0.0
