"""Answers of the models of this process (``local_models``) in the form of LiteLLM's responses: without key, network or
LiteLLM, whose import takes 3 s of a core."""

import json
from collections.abc import Iterable, Mapping, Sequence
from types import SimpleNamespace
from typing import Any

from asset2sim.models.gateway.chat_messages import message_text
from asset2sim.models.prior.answer import answers_of
from schemas.declared import TOOLS
from schemas.errors import ModelError
from schemas.extensions import object_at, offline_answers

CHARACTERS_PER_TOKEN = 4
"""Characters per token of what these models read and say, which no tokenizer cuts: English has 4."""


class PriorError(ModelError):
    """A model of this process failed; asking again cannot help, because it depends on the question alone."""

    status_code = 400


def completion(model: str, messages: Sequence[Mapping[str, Any]], with_tools: bool, sample: int) -> SimpleNamespace:
    """One response, with its tokens. A request with tools is answered by the extension that has a method which asks so,
    any other by ``prior.answer`` from the last user message that describes an object. It depends only on the messages,
    whether there are tools, and the number of the sample. Raises ``PriorError``, whatever went wrong."""
    try:
        content, calls = next_answer(model, messages, with_tools, sample)
    except Exception as error:
        raise PriorError(f"{type(error).__name__}: {error}") from error
    asked = sum(count_tokens(text_and_calls(message)) for message in messages)
    said = count_tokens((content or "") + "".join(call["function"]["arguments"] for call in calls))
    tool_calls = [SimpleNamespace(id=call["id"], function=SimpleNamespace(**call["function"])) for call in calls]
    message = SimpleNamespace(content=content, tool_calls=tool_calls)
    choice = SimpleNamespace(message=message, finish_reason="tool_calls" if calls else "stop")
    return SimpleNamespace(choices=[choice], usage=SimpleNamespace(prompt_tokens=asked, completion_tokens=said))


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
    said: tuple[str | None, list[dict[str, Any]]] = object_at(turns)(messages, proposal)
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


def count_tokens(text: str) -> int:
    """Tokens of a text, estimated from its length."""
    return -(-len(text) // CHARACTERS_PER_TOKEN)
