"""Input and answer formats that a model supports, and whether it can be asked at all, before a run begins."""

import contextlib
import functools
import re
import threading
from dataclasses import dataclass, replace
from typing import Any
from urllib.parse import urlsplit

from asset2sim.models.gateway import provider_errors
from asset2sim.models.gateway.budget import price_of
from asset2sim.models.gateway.chat_messages import has_images
from asset2sim.models.gateway.environment import find_provider, listed, load_litellm, missing_variables
from asset2sim.models.gateway.recorded import check_recorded
from asset2sim.models.prior.answer import answers_of
from schemas.errors import UnknownChoiceError, UsageError
from schemas.model_names import HOUSEHOLD, RECORDED_FORM, is_prior, is_recorded, named_models, settings_for
from schemas.request import ModelRequest
from schemas.settings import ModelSettings

_FORMAT_WORDS = (
    "response_format", "responseformat", "output_format", "outputconfig", "schema", "json_object", "json mode",
    "json_tool_call", "structured output",
)  # fmt: skip
_IMAGE_WORDS = ("image", "vision", "multimodal", "multi-modal")
_GENERAL_REFUSAL = re.compile(r"support|vision|multi-?modal|text.only|must be text|not (?:allowed|enabled|available)")
"""Words of a refusal of images in general, not of one image that is too large or broken."""

_LOWER = {"schema": "object", "object": "prompt"}
_CLOSED_SCHEMA_NAME = "claude"
"""Models whose schemas are sent with every object closed: a map with free keys would have to stay empty."""


@dataclass(frozen=True)
class ModelAbilities:
    """Abilities of a model, by LiteLLM's list. A model that is not listed is taken to accept images."""

    images: bool
    answer_format: str
    """Strictest answer format that the model supports: ``schema``, ``object`` or ``prompt``."""
    max_output_tokens: int | None


@dataclass(frozen=True)
class AttemptOptions:
    """Images and answer format of one attempt; ``refusal`` says why no images are sent."""

    images: bool
    answer_format: str
    refusal: str | None = None


_refused: dict[tuple[str, str | None], AttemptOptions] = {}
_lock = threading.Lock()


@functools.lru_cache(maxsize=64)
def model_abilities(model: str) -> ModelAbilities:
    """Abilities of a model, looked up once in LiteLLM, which for some providers (Ollama) asks the model's server."""
    if is_prior(model):
        return ModelAbilities(images=False, answer_format="prompt", max_output_tokens=None)
    litellm = load_litellm()
    info, parameters = dict[str, Any](), list[str]()
    # Whatever a lookup of names or a server raises: nothing is known then.
    with contextlib.suppress(Exception):
        info = dict(litellm.get_model_info(model))
    with contextlib.suppress(Exception):
        parameters = litellm.get_supported_openai_params(model) or []
    limit = info.get("max_output_tokens")
    mode = "object" if "response_format" in parameters else "prompt"
    return ModelAbilities(
        images=bool(litellm.supports_vision(model)) if info else True,
        answer_format="schema" if mode == "object" and litellm.supports_response_schema(model) else mode,
        max_output_tokens=limit if isinstance(limit, int) else None,
    )


def first_attempt_options(request: ModelRequest, settings: ModelSettings) -> AttemptOptions:
    """Images and answer format of the first attempt: all that the model supports and its server has not refused. With
    tools no format is asked for: several providers refuse the two together, and an answer may be a tool call."""
    able = model_abilities(settings.model)
    level = "prompt" if request.tools else able.answer_format
    schema, closes_objects = request.answer_schema, _CLOSED_SCHEMA_NAME in settings.model.lower()
    if level == "schema" and (schema is None or (closes_objects and has_free_keys(schema))):
        level = "object"
    with _lock:
        known = _refused.get(_server(settings))
    refusal = None
    if has_images(request) and not able.images and not is_prior(settings.model):
        refusal = f"model '{settings.model}' takes no images, by LiteLLM's list of models"
    elif known is not None and not known.images:
        refusal = known.refusal
    if known is not None and _rank(known.answer_format) < _rank(level):
        level = known.answer_format
    images = able.images and has_images(request) and refusal is None
    return AttemptOptions(images=images, answer_format=level, refusal=refusal if has_images(request) else None)


def has_free_keys(schema: object) -> bool:
    """Whether a JSON Schema has a map whose keys it does not name, such as joint names."""
    if isinstance(schema, dict):
        return isinstance(schema.get("additionalProperties"), dict) or any(map(has_free_keys, schema.values()))
    return isinstance(schema, list) and any(map(has_free_keys, schema))


def without_refused(options: AttemptOptions, error: BaseException, settings: ModelSettings) -> AttemptOptions | None:
    """The options without the images or the format that the error refuses by name; None for any other error."""
    if provider_errors.status_of(error) not in (400, 415, 422):
        return None
    text = str(error).lower()
    if options.images and any(word in text for word in _IMAGE_WORDS):
        refusal = f"the server of model '{settings.model}' refused them: {provider_errors.cause(error)}"
        return replace(options, images=False, refusal=refusal)
    if options.answer_format in _LOWER and any(word in text for word in _FORMAT_WORDS):
        return replace(options, answer_format=_LOWER[options.answer_format])
    return None


def remember_refusal(
    tried: AttemptOptions, worked: AttemptOptions, error: BaseException, settings: ModelSettings
) -> None:
    """Record, for this process, the images or format that a server refused before it answered without them. A refusal
    of one picture, too large or broken, is not recorded."""
    images_refused = tried.images and not worked.images and _GENERAL_REFUSAL.search(str(error).lower()) is not None
    with _lock:
        before = _refused.get(_server(settings), AttemptOptions(images=True, answer_format="schema"))
        level = worked.answer_format if worked.answer_format != tried.answer_format else before.answer_format
        _refused[_server(settings)] = AttemptOptions(
            images=before.images and not images_refused,
            answer_format=min(level, before.answer_format, key=_rank),
            refusal=worked.refusal if images_refused else before.refusal,
        )


def _rank(level: str) -> int:
    return ("prompt", "object", "schema").index(level)


def _server(settings: ModelSettings) -> tuple[str, str | None]:
    return settings.model, settings.api_base


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
