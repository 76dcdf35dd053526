"""What an agent has tried so far, as its conversation tells it: which trial went best, and how to get back to it."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from asset2sim.priors.information import ObjectInfo

Arguments = Mapping[str, Any]
Result = tuple[str, Arguments, Mapping[str, Any]]
"""A tool's name, the arguments it was called with, and what it returned."""
Terms = dict[str, dict[str, float]]
"""Joint name → its fields that were set; ``position`` is its initial position, rad or m at scale 1."""
MEASURED = ("penetration_m", "drift_m", "drift_rad", "peak_speed_m_s")
"""Numbers of a simulation that have a limit each."""


def badness(seen: Mapping[str, Any]) -> float:
    """How badly a simulation failed: 0 where it passed, else the sum of its numbers as shares of their limits, joints
    that oscillate counted one each; infinite where nothing is known."""
    if seen.get("passed") is True:
        return 0.0
    limits = seen.get("limits")
    if not isinstance(limits, dict):
        return math.inf
    shares = [number(seen.get(name)) / max(number(limits.get(name)), 1e-12) for name in MEASURED]
    reversals = number(limits.get("oscillation_sign_changes")) or math.inf
    moving = seen.get("moving_joints")
    rows = moving if isinstance(moving, list) else []
    return sum(shares) + sum(isinstance(row, dict) and number(row.get("sign_changes")) >= reversals for row in rows)


def trials_of(past: Sequence[Result]) -> list[tuple[float, Terms]]:
    """Every simulation so far: how badly it failed, and the joints' terms and positions that it was run with."""
    terms: Terms = {}
    trials = []
    for name, arguments, result in past:
        if name == "set_parameters" and "error" not in result:
            terms = with_changes(terms, arguments)
        elif name == "simulate":
            trials.append((badness(result), terms))
    return trials


def with_changes(terms: Terms, arguments: Arguments) -> Terms:
    """The terms after a ``set_parameters``."""
    new = {name: dict(fields) for name, fields in terms.items()}
    for item in rows(arguments, "joints"):
        found = {key: float(value) for key, value in item.items() if key != "name" and is_number(value)}
        new.setdefault(str(item.get("name")), {}).update(found)
    for item in rows(arguments, "initial_joint_positions"):
        if is_number(item.get("position")):
            new.setdefault(str(item.get("joint")), {})["position"] = float(item["position"])
    return new


def way_back(trials: Sequence[tuple[float, Terms]], info: ObjectInfo) -> dict[str, Any] | None:
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


def rows(arguments: Arguments, key: str) -> list[dict[str, Any]]:
    """The objects in a list among the arguments."""
    value = arguments.get(key)
    return [item for item in value if isinstance(item, dict)] if isinstance(value, list) else []


def is_number(value: object) -> bool:
    """Whether a JSON value is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300


def number(value: object) -> float:
    """A JSON value as a number, 0 where it is none."""
    return float(value) if isinstance(value, int | float) and is_number(value) else 0.0
