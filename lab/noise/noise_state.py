"""Errors about the state: the wrong end of a range, the wrong part, the wrong unit."""

import math
from collections.abc import Mapping
from typing import Any

from asset2sim.guidance.object_info import JointInfo
from lab.noise.noise_level import Draws, NoiseLevel

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
    """The position a little off, but not beyond an end of the range: nobody misses "closed" or "fully open" by 3 %."""
    if change == 0.0 or at in (joint.closed, joint.open):
        return at
    low, high = sorted((joint.closed, joint.open))
    return min(max(at + change, low), high) if joint.motion != "spin" else at + change
