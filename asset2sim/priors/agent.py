"""The offline model as an agent: the next answer of a conversation with tools, from the conversation's text alone.

It does what an agent plainly would: states its whole estimate, simulates, makes the obvious change where that fails
(more damping, another start), and ends once it passes or nothing more comes to mind, with the best that it saw. See
``asset2sim.methods.agent``.
"""

import json
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from asset2sim.priors.agent_corrections import correction
from asset2sim.priors.agent_trials import Result, trials_of, way_back
from asset2sim.priors.answer import answer
from asset2sim.priors.information import ObjectInfo, read_prompt

Message = Mapping[str, Any]

MAX_REFUSED = 2
"""Estimates that may be refused before this agent just says what it has."""
MAX_CORRECTIONS = 4
"""Changes after the first estimate: with it and the last word half of the steps that an agent has."""
FELT = ("coast_s", "spring_hz", "closes_s", "stops_within", "returns_s", "damping_level")
"""Fields of a joint's proposal from which rules of ours derive its dynamics; the agent's tools have none ..."""
VOLUMETRIC = ("density_kg_m3", "hollow_factor")
"""... and none for a mass that is derived from a volume."""
ASIDE = ("asked", "sigmas", "notes")
"""Fields of an overlay that are about its numbers; the agent's tools take none."""

_PURPOSE = re.compile(r'"purpose"\s*:\s*"(agent|synthesis)"')


def next_turn(
    messages: Sequence[Message], proposal: Callable[[str], str] = answer
) -> tuple[str | None, list[dict[str, Any]]]:
    """The next answer: its text, and its tool calls in OpenAI's form (``id``, ``type``, ``function``).

    ``messages`` are in OpenAI's form too; the first of the user holds the object's blocks. ``proposal`` maps a
    request's text to an overlay as JSON, right or wrong: a fallible model's errors come in here. What does not parse is
    passed on as the tool's arguments. Never raises for what the conversation holds.
    """
    first = next((text_of(message) for message in messages if message.get("role") == "user"), "")
    past = results_of(messages)
    estimates = [result for result in past if result[0] == "set_parameters"]
    refused = [result for result in estimates if "error" in result[2]]
    if not estimates or "error" in estimates[-1][2]:
        said = proposal(_direct(first) + _errors(refused))
        if len(refused) >= MAX_REFUSED:
            return said, []
        return None, [call(len(past), "set_parameters", arguments_of(said)), call(len(past) + 1, "simulate", "{}")]
    information, _ = read_prompt(first)
    info = ObjectInfo.from_json(information)
    trials = trials_of(past)
    rounds = len(estimates) - len(refused)
    seen = next((result for name, _, result in reversed(past) if name == "simulate"), {})
    if rounds <= MAX_CORRECTIONS and trials:
        changes = correction(seen, info, trials[-1][1], rounds)
        if changes is not None:
            return None, [call(len(past), "set_parameters", json.dumps(changes)), call(len(past) + 1, "simulate", "{}")]
    back = way_back(trials, info)
    ending = [call(len(past) + 1, "finish", "{}")]
    return None, ending if back is None else [call(len(past), "set_parameters", json.dumps(back)), *ending]


def arguments_of(overlay: str) -> str:
    """An overlay's JSON as the arguments of ``set_parameters``; the same text where it is no JSON object."""
    try:
        data = json.loads(overlay)
    except (ValueError, RecursionError):
        return overlay
    if not isinstance(data, dict):
        return overlay
    wanted = {key: value for key, value in data.items() if key not in ASIDE}
    for key in ("links", "joints"):
        if isinstance(wanted.get(key), list):
            wanted[key] = [_absolute(part) for part in wanted[key]]
    positions = wanted.get("initial_joint_positions")
    if isinstance(positions, dict):
        wanted["initial_joint_positions"] = [{"joint": key, "position": value} for key, value in positions.items()]
    return json.dumps(wanted)


def results_of(messages: Sequence[Message]) -> list[Result]:
    """Every tool's result so far, with the call that it answers; a result that is no JSON object counts as empty."""
    asked: dict[str, tuple[str, dict[str, Any]]] = {}
    results: list[Result] = []
    for message in messages:
        for item in message.get("tool_calls") or ():
            function = item.get("function") or {}
            asked[str(item.get("id"))] = (str(function.get("name")), _object(function.get("arguments")))
        if message.get("role") == "tool":
            name, arguments = asked.get(str(message.get("tool_call_id")), ("", {}))
            results.append((name, arguments, _object(text_of(message))))
    return results


def call(index: int, name: str, arguments: str) -> dict[str, Any]:
    """One tool call in OpenAI's form; ``index`` makes its identifier unique in the conversation."""
    return {"id": f"call_{index}", "type": "function", "function": {"name": name, "arguments": arguments}}


def text_of(message: Message) -> str:
    """A message's text: its content, or its text parts one below the other."""
    content = message.get("content") or ""
    if isinstance(content, str):
        return content
    return "\n".join(str(part["text"]) for part in content if part.get("type") == "text")


def _absolute(part: object) -> object:
    """A link's or joint's entry without what only rules make numbers of."""
    if not isinstance(part, dict):
        return part
    return {key: value for key, value in part.items() if key not in FELT + VOLUMETRIC}


def _direct(text: str) -> str:
    """The same request, asking for an overlay in absolute terms as one answer alone would give it."""
    return _PURPOSE.sub('"purpose":"direct"', text, count=1)


def _errors(refused: Sequence[Result]) -> str:
    """What was wrong with the last estimate, as the block that a repeated request has; empty before the first."""
    if not refused:
        return ""
    return f"\n\n<validation_errors>\n{json.dumps([str(refused[-1][2].get('error'))])}\n</validation_errors>"


def _object(text: object) -> dict[str, Any]:
    try:
        value = json.loads(text) if isinstance(text, str) else None
    except (ValueError, RecursionError):
        return {}
    return value if isinstance(value, dict) else {}
