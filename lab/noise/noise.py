"""The simulated fallible model: ``prior/household``'s answers with seeded errors of stated sizes. A simulation: it says
how each method stands errors of these sizes, and nothing about any real model. The sizes and where they come from are
in ``noise_level``."""

import json
import math
import re
from collections.abc import Callable, Mapping
from typing import Any

from asset2sim.guidance.object_info import JointInfo, ObjectInfo, read_prompt
from asset2sim.models.prior.answer import answer as prior_answer
from asset2sim.models.prior.refinement import read_refinement
from lab.noise.noise_level import Draws, Noise, NoiseLevel, draws_for, noise_of
from lab.noise.noise_numbers import with_sigmas, with_wrong_numbers

SPRING = ("spring_hz", "spring_rest", "press_start", "press_end", "returns_s", "stiffness")
"""The fields by which an entry gives a joint a spring."""
MM_PER_M = 1000.0


def with_wrong_state(
    answer: dict[str, Any], joints: Mapping[str, JointInfo], draws: Draws, sizes: NoiseLevel
) -> dict[str, Any]:
    """The answer (an overlay as JSON) with its states and spring rests where a fallible model puts them."""
    positions = answer.get("initial_joint_positions") or {}
    for index, (name, joint) in enumerate(joints.items()):
        if name in positions:
            spread = sizes.position_share * (joint.range if joint.motion != "spin" else 2.0 * math.pi)
            positions[name] = _inside(joint, positions[name], spread * draws.normal(f"position {index}", sizes.shared))
    if draws.happens("wrong end", sizes.p_wrong_end, sizes.shared_state):
        answer = _each_position(answer, joints, _mirrored)
    if draws.happens("wrong part", sizes.p_wrong_part, sizes.shared_state):
        answer = with_wrong_part(answer, joints, draws)
    if draws.happens("degrees", sizes.p_degrees):
        answer = _each_position(answer, joints, _in_degrees)
    if draws.happens("millimetres", sizes.p_millimetres):
        answer = _each_position(answer, joints, _in_millimetres)
    return answer


def with_wrong_part(answer: dict[str, Any], joints: Mapping[str, JointInfo], draws: Draws) -> dict[str, Any]:
    """The answer with one state, or where none is asked one spring, given to another joint; unchanged without one."""
    positions: dict[str, float] = answer.get("initial_joint_positions") or {}
    stated = [name for name in positions if name in joints]
    entries = {entry["name"]: entry for entry in answer.get("joints") or [] if entry.get("name") in joints}
    sprung = [name for name, entry in entries.items() if entry.get("spring_hz") or entry.get("stiffness")]
    sources = stated or sprung
    others = [name for name in joints if name not in sources]
    if not sources or not others:
        return answer
    source = sources[draws.index("part taken from", len(sources), shared=True)]
    target = others[draws.index("part given to", len(others), shared=True)]
    if stated:
        moved = _carried(joints[source], joints[target], positions[source])
        left = {target if name == source else name: at for name, at in positions.items()} | {target: moved}
        asked = [target if name == source else name for name in answer.get("asked") or []]
        return answer | {"initial_joint_positions": left, "asked": asked}
    given = entries[source]
    spring = {key: given[key] for key in SPRING if given.get(key) is not None}
    if "spring_rest" in spring:
        spring["spring_rest"] = _carried(joints[source], joints[target], spring["spring_rest"])
    changed = []
    for entry in [*answer["joints"], *([] if target in entries else [{"name": target}])]:
        name = entry.get("name")
        kept = {key: value for key, value in entry.items() if key not in SPRING or name not in (source, target)}
        changed.append(kept | spring if name == target else kept)
    return answer | {"joints": changed}


def _each_position(answer: dict[str, Any], joints: Mapping[str, JointInfo], change: Any) -> dict[str, Any]:
    positions = {
        name: change(joints[name], at) if name in joints else at
        for name, at in (answer.get("initial_joint_positions") or {}).items()
    }
    entries = [
        entry | {"spring_rest": change(joints[entry["name"]], entry["spring_rest"])}
        if entry.get("spring_rest") is not None and entry.get("name") in joints
        else entry
        for entry in answer.get("joints") or []
    ]
    return answer | {"initial_joint_positions": positions, "joints": entries}


def _mirrored(joint: JointInfo, at: float) -> float:
    return at if joint.motion == "spin" else joint.closed + joint.open - at


def _in_degrees(joint: JointInfo, at: float) -> float:
    return at if joint.motion == "slider" else math.degrees(at)


def _in_millimetres(joint: JointInfo, at: float) -> float:
    return at * MM_PER_M if joint.motion == "slider" else at


def _carried(source: JointInfo, target: JointInfo, at: float) -> float:
    """The same share of the way from closed to open, on another joint."""
    share = (at - source.closed) / (source.open - source.closed) if source.range > 0.0 else 0.0
    return target.closed + share * (target.open - target.closed)


def _inside(joint: JointInfo, at: float, change: float) -> float:
    """The position a little off, but not beyond an end of the range: "closed" and "fully open" are exact."""
    if change == 0.0 or at in (joint.closed, joint.open):
        return at
    low, high = sorted((joint.closed, joint.open))
    return min(max(at + change, low), high) if joint.motion != "spin" else at + change


MALFORMED = ("truncated", "fenced", "prose", "comments", "nan")
"""The ways in which an answer is no plain JSON; the first and the last cannot be parsed at all."""
TRUNCATED_SHARE = (0.4, 0.95)
"""Share of its characters that a truncated answer keeps."""

_NUMBER = re.compile(r"(?<=[:\[, ])-?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?(?=[,}\]\s])")


def noisy(answer: str, text: str, noise: Noise, sample: int = 0, conversation: str | None = None) -> str:
    """``prior/household``'s answer to the request ``text``, with the simulated errors of ``noise``.

    The shared part of every error depends on the object, the guidance and the seed; the rest on ``conversation`` (all
    that was said, by default ``text``) and ``sample``, so that a repeated request, another view or a request with
    validation errors draws that part anew. Level 0 changes nothing. Never raises for an answer of the prior.
    """
    if noise.level == 0.0:
        return answer
    information, guidance = read_prompt(text)
    draws = draws_for(information, guidance, text if conversation is None else conversation, sample, noise.seed)
    sizes, given = noise.sizes, json.loads(answer)
    if information.get("purpose") == "refinement":
        wrong = noisy_step(given, information, draws, sizes)
    else:
        wrong = noisy_overlay(given, ObjectInfo.from_json(information), draws, sizes)
    written = json.dumps(wrong)
    if draws.happens("malformed", sizes.p_malformed):
        return malformed(written, MALFORMED[draws.index("malformed how", len(MALFORMED))], draws)
    return written


def noisy_answers(model: str) -> Callable[[str, str, int], str]:
    """The answers of a model by its whole name: question, all that was said, number of the sample → text. Raises
    UnknownChoiceError for a level or a seed that it cannot have."""
    noise = noise_of(model)

    def answered(text: str, conversation: str, sample: int) -> str:
        right = prior_answer(text)
        return right if noise is None else noisy(right, text, noise, sample, f"{text}\n{conversation}")

    return answered


def noisy_overlay(given: dict[str, Any], info: ObjectInfo, draws: Draws, sizes: NoiseLevel) -> dict[str, Any]:
    """An overlay with every kind of error but malformed text; ``given`` is not changed."""
    joints = {joint.name: joint for joint in info.joints}
    links = [link.name for link in info.links]
    paths = tuple(given.get("sigmas") or ())
    wrong = with_wrong_numbers(given, links, list(joints), draws, sizes)
    wrong = with_wrong_state(wrong, joints, draws, sizes)
    wrong = _dropped(wrong, "links", draws, sizes.p_dropped_link)
    wrong = _dropped(wrong, "joints", draws, sizes.p_dropped_joint)
    return with_sigmas(wrong, joints, _paths(paths, wrong), draws, sizes) if paths else wrong


def noisy_step(
    given: dict[str, Any], information: Mapping[str, Any], draws: Draws, sizes: NoiseLevel
) -> dict[str, Any]:
    """A refinement's answer whose steps are too long or too short, the wrong way, or in degrees."""
    focus = information.get("focus_joints", [])
    sliders = {item.get("name") for item in focus if item.get("type") == "prismatic"}
    places = {joint.name: index for index, joint in enumerate(read_refinement(information)[1])}
    back = draws.happens("wrong end", sizes.p_wrong_end, sizes.shared_state)
    turned = draws.happens("degrees", sizes.p_degrees)
    deltas = {}
    for name, delta in (given.get("deltas") or {}).items():
        factor = draws.factor(f"step {places.get(name, -1)}", sizes.step_log, sizes.shared)
        unit = math.degrees(1.0) if turned and name not in sliders else 1.0
        deltas[name] = delta * factor * unit * (-1.0 if back else 1.0)
    return given | {"deltas": deltas}


def malformed(text: str, how: str, draws: Draws) -> str:
    """The JSON text spoiled in one of the ways of ``MALFORMED``."""
    if how == "truncated":
        low, high = TRUNCATED_SHARE
        return text[: max(int(len(text) * (low + (high - low) * draws.share("kept"))), 1)]
    if how == "fenced":
        return f"```json\n{text}\n```"
    if how == "prose":
        return f"Here is the physics of this object:\n\n{text}\n\nThe values are estimates; adjust them if needed."
    if how == "comments":
        return text.replace("{", "{  // all values in SI units\n", 1)
    numbers = list(_NUMBER.finditer(text))
    if not numbers:
        return f"{text[:-1]}, NaN"
    hit = numbers[draws.index("which number", len(numbers))]
    return f"{text[: hit.start()]}NaN{text[hit.end() :]}"


def _dropped(answer: dict[str, Any], key: str, draws: Draws, chance: float) -> dict[str, Any]:
    """The answer without one entry of a list, with that probability."""
    entries = list(answer.get(key) or [])
    if not entries or not draws.happens(f"dropped {key}", chance):
        return answer
    entries.pop(draws.index(f"which of {key}", len(entries)))
    return answer | {key: entries}


def _paths(paths: tuple[str, ...], wrong: Mapping[str, Any]) -> tuple[str, ...]:
    """The paths that the prior gave, with the states and springs that now belong to other joints."""
    states = [f"initial_joint_positions.{name}" for name in wrong.get("initial_joint_positions") or {}]
    moved = [
        f"joints.{entry['name']}.{field}"
        for entry in wrong.get("joints") or []
        for field in SPRING
        if entry.get(field) is not None and any(path.endswith(f".{field}") for path in paths)
    ]
    kept = [path for path in paths if not path.startswith("initial_joint_positions.")]
    return tuple(dict.fromkeys((*kept, *states, *moved)))
