"""The ``prior`` provider of LiteLLM: answers of the models of this process, without key or network. Imports LiteLLM, so
it is itself imported late, by ``asset2sim.models.gateway.environment``."""

from collections.abc import Mapping
from typing import Any

import litellm
from litellm import CustomLLM, ModelResponse
from litellm.llms.custom_llm import CustomLLMError
from litellm.types.utils import Message

from asset2sim.models.prior.answer import answers_of
from asset2sim.models.prior.next_answer import guessed_tokens, next_answer, text_and_calls
from schemas.errors import UsageError
from schemas.model_names import PRIOR_PROVIDER


class PriorProvider(CustomLLM):  # type: ignore[misc]  # LiteLLM's base class is untyped to a checker that skips it
    """LiteLLM's interface to the models of this process (``local_models``), and token counts. A request with tools is
    answered by the extension that has a method which asks so, any other by ``prior.answer`` from the last user message
    that describes an object. It depends only on the messages, whether there are tools, and ``seed`` (the number of the
    sample)."""

    def completion(self, *args: Any, **kwargs: Any) -> ModelResponse:
        """One answer; any failure is a 400, because the prior is deterministic and asking again cannot help."""
        model, messages, response = kwargs["model"], kwargs["messages"], kwargs["model_response"]
        options: Mapping[str, Any] = kwargs.get("optional_params") or {}
        name = f"{PRIOR_PROVIDER}/{model}"
        try:
            answers_of(name)
        except UsageError as error:
            raise CustomLLMError(404, str(error)) from error
        try:
            content, calls = next_answer(name, messages, bool(options.get("tools")), int(options.get("seed") or 0))
        except Exception as error:
            raise CustomLLMError(400, f"{type(error).__name__}: {error}") from error
        asked = sum(count_tokens(text_and_calls(message)) for message in messages)
        said = count_tokens((content or "") + "".join(call["function"]["arguments"] for call in calls))
        response.model = name
        response.choices[0].message = Message(role="assistant", content=content, tool_calls=calls or None)
        response.choices[0].finish_reason = "tool_calls" if calls else "stop"
        response.usage = litellm.Usage(prompt_tokens=asked, completion_tokens=said, total_tokens=asked + said)
        return response


def register() -> None:
    """Make ``prior/…`` known to LiteLLM; a second call changes nothing."""
    if any(item["provider"] == PRIOR_PROVIDER for item in litellm.custom_provider_map):
        return
    entry = {"provider": PRIOR_PROVIDER, "custom_handler": PriorProvider()}
    litellm.custom_provider_map = [*litellm.custom_provider_map, entry]
    litellm.utils.custom_llm_setup()


def count_tokens(text: str) -> int:
    """Tokens of a text by the tokenizer that LiteLLM ships for unknown models, else one per four characters."""
    try:
        return int(litellm.token_counter(model="", text=text))
    except Exception:  # whatever a tokenizer raises that cannot be loaded
        return guessed_tokens(text)
