"""A request in OpenAI's chat format, which LiteLLM translates for every other provider."""

from typing import Any

from asset2sim.models.gateway.images import image_parts
from schemas.request import LabelledImage, ModelRequest, Tool, ToolCall, Turn


def chat_messages(request: ModelRequest, with_images: bool) -> list[dict[str, Any]]:
    """Messages of a request: system part, question, and the later turns.

    A tool's result is text only in this format: its pictures follow in a user message, after all the results of one
    set of tool calls, which must stay together.
    """
    messages: list[dict[str, Any]] = [
        {"role": "system", "content": request.system},
        {"role": "user", "content": _user_content(request.text, request.images if with_images else ())},
    ]
    waiting: tuple[LabelledImage, ...] = ()
    for turn in request.turns:
        if waiting and turn.role != "tool":
            messages.append({"role": "user", "content": image_parts(waiting)})
            waiting = ()
        shown = turn.images if with_images else ()
        messages.append(_message(turn, shown))
        if turn.role == "tool":
            waiting += shown
    if waiting:
        messages.append({"role": "user", "content": image_parts(waiting)})
    return messages


def tool_parameters(tools: tuple[Tool, ...]) -> list[dict[str, Any]]:
    """The tool definitions in OpenAI's format."""
    return [
        {
            "type": "function",
            "function": {"name": tool.name, "description": tool.description, "parameters": tool.parameters},
        }
        for tool in tools
    ]


def answer_format(schema: dict[str, Any] | None, name: str, level: str) -> dict[str, Any] | None:
    """The ``response_format`` of a level: ``schema``, ``object`` (any JSON), or ``prompt`` (none: the prompt says it).

    Never strict: an answer has maps whose keys are joint names, which strict mode cannot express.
    """
    if level == "prompt":
        return None
    if level == "schema" and schema is not None:
        return {"type": "json_schema", "json_schema": {"name": name, "schema": schema, "strict": False}}
    return {"type": "json_object"}


def _message(turn: Turn, shown: tuple[LabelledImage, ...]) -> dict[str, Any]:
    if turn.role == "tool":
        return {"role": "tool", "tool_call_id": turn.call_id or "", "content": turn.content}
    if turn.role == "user":
        return {"role": "user", "content": _user_content(turn.content, shown)}
    message: dict[str, Any] = {"role": "assistant", "content": turn.content or None}
    if turn.tool_calls:
        message["tool_calls"] = [_tool_call(call) for call in turn.tool_calls]
    elif not turn.content:
        message["content"] = ""
    return message


def _tool_call(call: ToolCall) -> dict[str, Any]:
    return {"id": call.call_id, "type": "function", "function": {"name": call.name, "arguments": call.arguments}}


def _user_content(text: str, images: tuple[LabelledImage, ...]) -> str | list[dict[str, Any]]:
    return [{"type": "text", "text": text}, *image_parts(images)] if images else text
