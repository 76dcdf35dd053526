"""Cost of a model call by LiteLLM's price list: estimated before it, and actual."""

import functools
from dataclasses import dataclass
from typing import Any

from asset2sim.models.gateway.environment import load_litellm
from asset2sim.models.gateway.secrets import runs_without_key
from schemas.model_names import is_local, is_prior
from schemas.request import ModelRequest
from schemas.settings import ModelSettings

CHARACTERS_PER_TOKEN = 3
"""Characters of a prompt per estimated token: English has 4, JSON with numbers down to 2.5."""
PIXELS_PER_TOKEN = 750
"""Pixels of an image per estimated token, as Anthropic bills them; others bill fewer tokens."""
EXPECTED_ANSWER_TOKENS = 2000
"""Estimated tokens of an answer: an overlay of 20 links has 1500."""


@dataclass(frozen=True)
class Amount:
    """Calls, tokens (prompt and answer together) and USD."""

    calls: int = 0
    tokens: int = 0
    usd: float = 0.0


@dataclass(frozen=True)
class Price:
    """USD per token of the prompt and of the answer."""

    prompt_usd: float
    answer_usd: float


def price_of(settings: ModelSettings) -> Price | None:
    """The price of ``settings.model``: zero where it runs in this process, is recorded, or is on a local server and
    not in LiteLLM's list; None where it is not known."""
    listed = Price(0.0, 0.0) if is_local(settings.model) else _listed_price(settings.model)
    return Price(0.0, 0.0) if listed is None and runs_without_key(settings) else listed


@functools.lru_cache(maxsize=64)
def _listed_price(model: str) -> Price | None:
    try:
        info: dict[str, Any] = dict(load_litellm().get_model_info(model))
        prompt, answer = info.get("input_cost_per_token"), info.get("output_cost_per_token")
        return None if prompt is None or answer is None else Price(float(prompt), float(answer))
    except Exception:  # whatever LiteLLM raises of a name that it does not know
        return None


def expected_amount(request: ModelRequest, settings: ModelSettings, with_images: bool) -> Amount:
    """Estimated amount of one call for this request."""
    return _amount(request, settings, with_images, min(EXPECTED_ANSWER_TOKENS, settings.max_completion_tokens))


def largest_amount(request: ModelRequest, settings: ModelSettings, with_images: bool) -> Amount:
    """Largest amount of one call for this request: with an answer as long as is allowed."""
    return _amount(request, settings, with_images, settings.max_completion_tokens)


def _amount(request: ModelRequest, settings: ModelSettings, with_images: bool, answer_tokens: int) -> Amount:
    turns = sum(len(turn.content) + sum(len(call.arguments) for call in turn.tool_calls) for turn in request.turns)
    tools = sum(len(tool.description) + len(str(tool.parameters)) for tool in request.tools)
    text = len(request.system) + len(request.text) + turns + tools
    images = len(request.images) + sum(len(turn.images) for turn in request.turns) if with_images else 0
    prompt_tokens = text // CHARACTERS_PER_TOKEN + images * settings.image_side_px**2 // PIXELS_PER_TOKEN
    price = price_of(settings) or Price(0.0, 0.0)
    usd = prompt_tokens * price.prompt_usd + answer_tokens * price.answer_usd
    return Amount(calls=1, tokens=prompt_tokens + answer_tokens, usd=usd)


def cost_usd(response: Any, model: str) -> float:
    """Cost of a call by LiteLLM's price list, USD; 0 where the price is unknown."""
    if is_prior(model):
        return 0.0
    try:
        return float(load_litellm().completion_cost(completion_response=response, model=model))
    except Exception:  # whatever LiteLLM raises of a name that it does not know
        return 0.0
