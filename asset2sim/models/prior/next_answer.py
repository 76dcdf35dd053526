"""The next message of a conversation from a model of this process, with LiteLLM around it or without."""

import json
import time
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from asset2sim.models.gateway.chat_messages import chat_messages, message_text, tool_parameters
from asset2sim.models.prior.answer import answers_of
from schemas.declared import TOOLS
from schemas.extensions import named, offline_answers
from schemas.request import ModelAnswer, ModelCall, ModelRequest, ToolCall

CHARACTERS_PER_TOKEN = 4
"""Characters per token where LiteLLM's own tokenizer cannot be loaded."""


def answer_here(request: ModelRequest, model: str, prompt_hash: str) -> ModelAnswer:
    """The answer of a model of this process where LiteLLM is not installed: the same, its tokens guessed."""
    start, messages = time.monotonic(), chat_messages(request, with_images=False)
    content, calls = next_answer(model, messages, bool(tool_parameters(request.tools)), request.sample)
    spent = ModelCall(
        purpose=request.purpose,
        model=model,
        attempt=1,
        prompt_tokens=sum(guessed_tokens(text_and_calls(message)) for message in messages),
        completion_tokens=guessed_tokens(content or ""),
        cost_usd=0.0,
        latency_s=time.monotonic() - start,
        cached=False,
        outcome="ok",
        prompt_hash=prompt_hash,
    )
    asked = tuple(ToolCall(call_id=call["id"], **call["function"]) for call in calls)
    return ModelAnswer(content=content, calls=(spent,), tool_calls=asked)


def next_answer(
    model: str, messages: Sequence[Mapping[str, Any]], with_tools: bool, sample: int
) -> tuple[str | None, list[dict[str, Any]]]:
    """Text and tool calls (in OpenAI's format) of the next message from a model of this process."""
    answers = answers_of(model)
    conversation = "\n".join(text_and_calls(message) for message in messages if message.get("role") != "system")

    def proposal(text: str) -> str:
        return answers(text, conversation, sample)

    turns = offline_answers().get(TOOLS) if with_tools else None
    if turns is None:
        return proposal(user_text(messages)), []
    said: tuple[str | None, list[dict[str, Any]]] = named(turns)(messages, proposal)
    return said


def user_text(messages: Iterable[Mapping[str, Any]]) -> str:
    """The text of the last user message with an object's facts, else of the last; empty where there is none."""
    texts = [message_text(message) for message in messages if message.get("role") == "user"]
    stating = [text for text in texts if "<structured_information>" in text]
    return (stating or texts or [""])[-1]


def text_and_calls(message: Mapping[str, Any]) -> str:
    """A message's text, with its tool calls as JSON below."""
    calls = [
        {key: (call.get("function") or {}).get(key) for key in ("name", "arguments")}
        for call in message.get("tool_calls") or ()
    ]
    return message_text(message) + (f"\n{json.dumps(calls)}" if calls else "")


def guessed_tokens(text: str) -> int:
    """Tokens of a text by its length."""
    return -(-len(text) // CHARACTERS_PER_TOKEN)
