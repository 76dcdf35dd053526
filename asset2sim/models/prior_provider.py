"""The ``prior`` provider of LiteLLM: answers from tables, in this process, without key or network.

Imports LiteLLM, so it is itself imported late, by ``asset2sim.models.lite``.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import litellm
from litellm import CustomLLM, ModelResponse
from litellm.llms.custom_llm import CustomLLMError

from asset2sim.models.priors_known import PRIOR_MODELS, PRIOR_PROVIDER

CHARACTERS_PER_TOKEN = 4
"""The rule of thumb by which tokens are counted where LiteLLM's own tokenizer is not to be had."""


class PriorProvider(CustomLLM):  # type: ignore[misc]  # LiteLLM's base class is untyped to a checker that skips it
    """Hands the last user message to ``asset2sim.priors.answer`` and reports the tokens of both texts."""

    def completion(self, *args: Any, **kwargs: Any) -> ModelResponse:
        """One answer; any failure is a 400, because the prior is deterministic and asking again cannot help."""
        model, messages, response = kwargs["model"], kwargs["messages"], kwargs["model_response"]
        if f"{PRIOR_PROVIDER}/{model}" not in PRIOR_MODELS:
            raise CustomLLMError(404, f"no prior is called '{model}'; there are: {', '.join(PRIOR_MODELS)}")
        try:
            from asset2sim.priors import answer

            content = answer(user_text(messages))
        except Exception as error:
            raise CustomLLMError(400, f"{type(error).__name__}: {error}") from error
        prompt_tokens = sum(count_tokens(message_text(message)) for message in messages)
        completion_tokens = count_tokens(content)
        response.model = f"{PRIOR_PROVIDER}/{model}"
        response.choices[0].message.content = content
        response.choices[0].finish_reason = "stop"
        response.usage = litellm.Usage(
            prompt_tokens=prompt_tokens,
            completion_tokens=completion_tokens,
            total_tokens=prompt_tokens + completion_tokens,
        )
        return response


def register() -> None:
    """Make ``prior/…`` known to LiteLLM; a second call changes nothing."""
    if any(item["provider"] == PRIOR_PROVIDER for item in litellm.custom_provider_map):
        return
    litellm.custom_provider_map = [
        *litellm.custom_provider_map,
        {"provider": PRIOR_PROVIDER, "custom_handler": PriorProvider()},
    ]
    litellm.utils.custom_llm_setup()


def user_text(messages: Iterable[Mapping[str, Any]]) -> str:
    """The text of the last user message; empty where there is none."""
    texts = [message_text(message) for message in messages if message.get("role") == "user"]
    return texts[-1] if texts else ""


def message_text(message: Mapping[str, Any]) -> str:
    """A message's text: its content, or its text parts one below the other."""
    content = message.get("content") or ""
    if isinstance(content, str):
        return content
    return "\n".join(str(part["text"]) for part in content if part.get("type") == "text")


def count_tokens(text: str) -> int:
    """Tokens of a text by the tokenizer that LiteLLM ships for unknown models, else one per four characters."""
    try:
        return int(litellm.token_counter(model="", text=text))
    except Exception:
        return -(-len(text) // CHARACTERS_PER_TOKEN)
