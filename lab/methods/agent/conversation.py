"""Conversation with an agent, shortened to be sent again with every question."""

import json
from collections.abc import Collection, Sequence

from asset2sim.models.lenient_json import parse_json
from lab.methods.agent.results import cut, refused, short
from lab.methods.agent.specs import (
    MAX_ARGUMENT_CHARS,
    MAX_ID_CHARS,
    MAX_ROOMLESS_CHARS,
    MAX_SAID_CHARS,
    MAX_TALK_CHARS,
    TOOL_NAMES,
)
from schemas.errors import InvalidAnswerError
from schemas.request import ModelAnswer, ToolCall, Turn

LEFT_OUT = refused("left out: this result is too far back; call the tool again where it is needed")
"""Replacement for an old result."""


def model_turn(answer: ModelAnswer, most: int, known: Collection[str], step: int) -> Turn:
    """The model's turn as sent back to the model, with at most ``most`` of its calls.

    Providers refuse the whole conversation unless every call has a unique identifier (``known`` holds earlier ones), a
    tool's name and arguments that parse. The call's result says what was wrong.
    """
    calls = []
    seen = set(known)
    for index, call in enumerate(answer.tool_calls[:most]):
        fits = 0 < len(call.call_id) <= MAX_ID_CHARS and call.call_id not in seen
        call_id = call.call_id if fits else f"call_{step}_{index}"
        seen.add(call_id)
        name = call.name if call.name in TOOL_NAMES else "unknown"
        calls.append(ToolCall(call_id=call_id, name=name, arguments=parsing(call.arguments)))
    return Turn(role="assistant", content=cut(answer.content or "", MAX_SAID_CHARS), tool_calls=tuple(calls))


def parsing(arguments: str) -> str:
    """The arguments as strict JSON where they are an object, else an object that quotes their beginning."""
    try:
        return json.dumps(arguments_of(arguments))
    except InvalidAnswerError:
        return json.dumps({"malformed": short(arguments)})


def arguments_of(text: str) -> dict[str, object]:
    """A call's arguments. Raises ``InvalidAnswerError`` where they are no JSON object, or too long to be read."""
    if len(text) > MAX_ARGUMENT_CHARS:
        raise InvalidAnswerError(f"the arguments have {len(text)} characters; the most is {MAX_ARGUMENT_CHARS}")
    value = parse_json(text) if text.strip() else {}
    if not isinstance(value, dict):
        raise InvalidAnswerError("the arguments must be one JSON object")
    return value


def bounded(turns: Sequence[Turn]) -> tuple[Turn, ...]:
    """Turns to send: only the latest pictures, and without the oldest results and arguments where the whole is too
    long."""
    kept: list[Turn] = []
    room, looked = MAX_TALK_CHARS, False
    for turn in reversed(turns):
        if turn.images and looked:
            turn = turn.model_copy(update={"images": (), "content": "(pictures of an earlier look, left out)"})
        looked = looked or bool(turn.images)
        length = len(turn.content) + sum(len(call.arguments) for call in turn.tool_calls)
        if length > room:
            turn = shortened(turn)
            length = len(turn.content)
        room -= length
        kept.append(turn)
    return tuple(reversed(kept))


def shortened(turn: Turn) -> Turn:
    """A turn without long results and arguments; every call keeps its identifier and has a result."""
    calls = tuple(
        call if len(call.arguments) <= MAX_ROOMLESS_CHARS else call.model_copy(update={"arguments": "{}"})
        for call in turn.tool_calls
    )
    content = LEFT_OUT if turn.role == "tool" and len(turn.content) > len(LEFT_OUT) else turn.content
    return turn.model_copy(update={"content": content, "tool_calls": calls})
