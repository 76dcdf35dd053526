"""The offline model as an agent: the next answer of a conversation with tools, from the conversation's text alone. It
states its whole estimate, simulates, and where that fails makes the obvious change (more damping, another start). It
ends once a simulation passes or no change is left, with the best trial."""

import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from asset2sim.guidance.object_info import JointInfo, ObjectInfo, decoded, read_prompt
from asset2sim.models.answers import OWN_FIELDS, RULE_FIELDS, STATED
from asset2sim.models.gateway.chat_messages import message_text
from asset2sim.models.prior.answer import answer

Arguments = Mapping[str, Any]

Result = tuple[str, Arguments, Mapping[str, Any]]
"""A tool's name, the arguments it was called with, and what it returned."""
Terms = dict[str, dict[str, float]]
"""Joint name → its fields that were set; ``position`` is its initial position, rad or m at scale 1."""
MEASURED = ("penetration_m", "drift_m", "drift_rad", "peak_speed_m_s")
"""Numbers of a simulation that have a limit each."""


def dicts(value: object) -> list[dict[str, Any]]:
    """The objects in a list; empty where it is none."""
    return [item for item in value if isinstance(item, dict)] if isinstance(value, list) else []


def failure_score(seen: Mapping[str, Any]) -> float:
    """How badly a simulation failed: 0 where it passed, else the sum of its numbers as shares of their limits, joints
    that oscillate counted one each; infinite where nothing is known."""
    if seen.get("passed") is True:
        return 0.0
    limits = seen.get("limits")
    if not isinstance(limits, dict):
        return math.inf
    shares = [number(seen.get(name)) / max(number(limits.get(name)), 1e-12) for name in MEASURED]
    reversals = number(limits.get("oscillation_sign_changes")) or math.inf
    return sum(shares) + sum(number(row.get("sign_changes")) >= reversals for row in dicts(seen.get("moving_joints")))


def trials_of(past: Sequence[Result]) -> list[tuple[float, Terms]]:
    """Every simulation so far: how badly it failed, and the joints' terms and positions that it was run with."""
    terms: Terms = {}
    trials = []
    for name, arguments, result in past:
        if name == "set_parameters" and "error" not in result:
            terms = with_changes(terms, arguments)
        elif name == "simulate":
            trials.append((failure_score(result), terms))
    return trials


def with_changes(terms: Terms, arguments: Arguments) -> Terms:
    """The terms after a ``set_parameters``."""
    new = {name: dict(fields) for name, fields in terms.items()}
    for item in dicts(arguments.get("joints")):
        found = {key: float(value) for key, value in item.items() if key != "name" and is_number(value)}
        new.setdefault(str(item.get("name")), {}).update(found)
    for item in dicts(arguments.get("initial_joint_positions")):
        if is_number(item.get("position")):
            new.setdefault(str(item.get("joint")), {})["position"] = float(item["position"])
    return new


def changes_to_best(trials: Sequence[tuple[float, Terms]], info: ObjectInfo) -> dict[str, Any] | None:
    """Arguments of ``set_parameters`` that restore the best trial; None where that is the last one."""
    if not trials:
        return None
    best = min(trials, key=lambda trial: trial[0])
    if trials[-1][0] <= best[0]:
        return None
    zeros = {joint.name: joint.zero for joint in info.joints}
    joints, starts = [], []
    for name, now in trials[-1][1].items():
        then = best[1].get(name, {})
        changed = {key: then.get(key, 0.0) for key in now if key != "position" and then.get(key) != now[key]}
        if changed:
            joints.append({"name": name, **changed})
        if "position" in now and then.get("position") != now["position"]:
            starts.append({"joint": name, "position": then.get("position", zeros.get(name, 0.0))})
    return {"joints": joints, "initial_joint_positions": starts}


def is_number(value: object) -> bool:
    """Whether a JSON value is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300


def number(value: object) -> float:
    """A JSON value as a number, 0 where it is none."""
    return float(value) if isinstance(value, int | float) and is_number(value) else 0.0


FACTOR = 3.0
"""Factor by which damping and friction grow: the paper advises ×2 to ×5 on persistent oscillation."""
FIRST_TERMS = {"slider": (0.5, 0.1), "hinge": (0.05, 0.005), "spin": (0.05, 0.005)}
"""Damping and friction that a joint without any starts from: the low ends of the paper's ranges (N·s/m and N, N·m·s/rad
and N·m)."""
STEP = 0.05
"""Share of its range by which a joint's start is moved where parts overlap: the paper's small step."""
HIGH_FRICTION_MATERIAL = "rubber"
"""Contact material for an object that slides as a whole."""


def correction(seen: Mapping[str, Any], info: ObjectInfo, terms: Terms, rounds: int) -> dict[str, Any] | None:
    """Arguments of ``set_parameters`` after a ``simulate`` that returned ``seen``; None where nothing is to be done.
    ``terms`` is what it was run with; ``rounds`` counts from 1."""
    failed = seen.get("failed")
    joints = {joint.name: joint for joint in info.joints}
    if failed == "penetration":
        return _moved(seen, joints, terms)
    if failed not in ("drift", "oscillation"):
        return None
    moving = [item for item in dicts(seen.get("moving_joints")) if item.get("joint") in joints]
    if not moving:
        return {"contact_material": HIGH_FRICTION_MATERIAL} if rounds == 1 else None
    return {"joints": [_stiffer(item, joints[item["joint"]], failed == "drift") for item in moving]}


def _stiffer(item: Mapping[str, Any], joint: JointInfo, with_friction: bool) -> dict[str, Any]:
    damping, friction = FIRST_TERMS[joint.motion]
    changed: dict[str, Any] = {"name": joint.name, "damping": FACTOR * max(number(item.get("damping")), damping)}
    if with_friction:
        changed["friction"] = FACTOR * max(number(item.get("friction")), friction)
    return changed


def _moved(seen: Mapping[str, Any], joints: Mapping[str, JointInfo], terms: Terms) -> dict[str, Any] | None:
    """The joints of the worst pair, a step further open."""
    worst = next(iter(dicts(seen.get("pairs"))), {})
    links = (worst.get("link_a"), worst.get("link_b"))
    starts = []
    for joint in joints.values():
        if joint.child not in links or joint.range == 0.0:
            continue
        target = terms.get(joint.name, {}).get("position", joint.zero) + STEP * (joint.open - joint.closed)
        low, high = sorted((joint.closed, joint.open))
        starts.append({"joint": joint.name, "position": min(max(target, low), high)})
    return {"initial_joint_positions": starts} if starts else None


Message = Mapping[str, Any]

MAX_REFUSED = 2
"""Refused estimates after which this agent answers with its estimate as text."""
MAX_CORRECTIONS = 4
"""Most changes after the first estimate: with it and the last step half of the steps that an agent has."""
REASONED = ("appearance", "size_reason", "findings", "unclear")
"""Fields that say what was seen, why, and what cannot be told: a model that calls tools has no place for them."""
FIELDS_ABOUT_NUMBERS = ("asked", "sigmas", "uncertainty", "notes", "support", *REASONED, *STATED)
"""Fields of an overlay that the agent's tools do not accept, as little as ``RULE_FIELDS``."""
_PURPOSE = re.compile(r'"purpose"\s*:\s*"(agent|synthesis)"')


def next_turn(
    messages: Sequence[Message], proposal: Callable[[str], str] = answer
) -> tuple[str | None, list[dict[str, Any]]]:
    """The next answer: its text, and its tool calls in OpenAI's form (``id``, ``type``, ``function``).

    ``messages`` are in OpenAI's form too; the first user message has the object's blocks. ``proposal`` maps a request's
    text to an overlay as JSON, with a simulated fallible model's errors if any. Text that does not parse is
    passed on as the tool's arguments. Never raises, whatever is in the conversation.
    """
    first = next((message_text(message) for message in messages if message.get("role") == "user"), "")
    past = results_of(messages)
    estimates = [result for result in past if result[0] == "set_parameters"]
    refused = [result for result in estimates if "error" in result[2]]
    if not estimates or "error" in estimates[-1][2]:
        # The same request, for an overlay in absolute terms as one answer alone would give it.
        said = proposal(_PURPOSE.sub('"purpose":"direct"', first, count=1) + _errors(refused))
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
    back = changes_to_best(trials, info)
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
    wanted = {key: value for key, value in data.items() if key not in FIELDS_ABOUT_NUMBERS}
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
            results.append((name, arguments, _object(message_text(message))))
    return results


def call(index: int, name: str, arguments: str) -> dict[str, Any]:
    """One tool call in OpenAI's form; ``index`` makes its identifier unique in the conversation."""
    return {"id": f"call_{index}", "type": "function", "function": {"name": name, "arguments": arguments}}


def _absolute(part: object) -> object:
    """A link's or joint's entry without the fields from which our rules derive numbers."""
    if not isinstance(part, dict):
        return part
    return {key: value for key, value in part.items() if key not in (*RULE_FIELDS, *OWN_FIELDS)}


def _errors(refused: Sequence[Result]) -> str:
    """The last refused estimate's error, as the block of a repeated request; empty where none was refused."""
    if not refused:
        return ""
    return f"\n\n<validation_errors>\n{json.dumps([str(refused[-1][2].get('error'))])}\n</validation_errors>"


def _object(text: object) -> dict[str, Any]:
    value = decoded(text) if isinstance(text, str) else None
    return value if isinstance(value, dict) else {}
