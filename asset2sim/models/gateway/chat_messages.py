"""A request in OpenAI's chat format, which LiteLLM translates for every other provider, and its images scaled down."""

import base64
import io
from collections.abc import Mapping
from typing import Any

from PIL import Image

from schemas.request import LabelledImage, ModelRequest, Turn


def chat_messages(request: ModelRequest, with_images: bool) -> list[dict[str, Any]]:
    """Messages of a request: system part, question, and the later turns. A tool's result is text only in this format:
    its pictures follow in a user message, after all the results of one set of tool calls, which must stay together."""
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


def answer_format(schema: dict[str, Any] | None, name: str, level: str) -> dict[str, Any] | None:
    """The ``response_format`` of a level: ``schema``, ``object`` (any JSON), or ``prompt`` (none: the prompt says it).
    Never strict: an answer has maps whose keys are joint names, which strict mode cannot express."""
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
        message["tool_calls"] = [
            {"id": call.call_id, "type": "function", "function": {"name": call.name, "arguments": call.arguments}}
            for call in turn.tool_calls
        ]
    elif not turn.content:
        message["content"] = ""
    return message


def _user_content(text: str, images: tuple[LabelledImage, ...]) -> str | list[dict[str, Any]]:
    return [{"type": "text", "text": text}, *image_parts(images)] if images else text


def message_text(message: Mapping[str, Any]) -> str:
    """A message's text: its content, or its text parts one below the other."""
    content = message.get("content") or ""
    if isinstance(content, str):
        return content
    return "\n".join(str(part["text"]) for part in content if part.get("type") == "text")


def downscaled(request: ModelRequest, side_px: int) -> ModelRequest:
    """The request with every picture, also those of its turns, at most ``side_px`` wide and high."""
    turns = tuple(
        turn.model_copy(update={"images": tuple(fitted(image, side_px) for image in turn.images)})
        for turn in request.turns
    )
    images = tuple(fitted(image, side_px) for image in request.images)
    return request.model_copy(update={"images": images, "turns": turns})


def fitted(image: LabelledImage, side_px: int) -> LabelledImage:
    """The picture with its longest side at most ``side_px``; one that fits, or that cannot be read, stays as it is. The
    same picture gives the same bytes, which the answer cache needs."""
    try:
        with Image.open(io.BytesIO(image.png)) as picture:
            if max(picture.size) <= side_px:
                return image
            picture.thumbnail((side_px, side_px), Image.Resampling.LANCZOS)
            out = io.BytesIO()
            picture.save(out, format="PNG", optimize=False)
    except (OSError, ValueError, Image.DecompressionBombError):
        return image
    return image.model_copy(update={"png": out.getvalue()})


def image_parts(images: tuple[LabelledImage, ...]) -> list[dict[str, Any]]:
    """OpenAI content parts: for each picture a text with its label, then the picture itself."""
    parts: list[dict[str, Any]] = []
    for image in images:
        url = "data:image/png;base64," + base64.b64encode(image.png).decode("ascii")
        parts.append({"type": "text", "text": f"Image: {image.label}"})
        parts.append({"type": "image_url", "image_url": {"url": url}})
    return parts


def has_images(request: ModelRequest) -> bool:
    """Whether the request, or a turn of it, has a picture."""
    return bool(request.images) or any(turn.images for turn in request.turns)
