"""What an agent changes after a simulation that failed: the obvious thing, with no model of why it failed."""

from collections.abc import Mapping
from typing import Any

from asset2sim.priors.agent_trials import Terms, number, rows
from asset2sim.priors.information import JointInfo, ObjectInfo

FACTOR = 3.0
"""By how much damping and friction grow: the paper advises ×2 to ×5 on persistent oscillation."""
LEAST = {"slider": (0.5, 0.1), "hinge": (0.05, 0.005), "spin": (0.05, 0.005)}
"""Damping and friction that a joint without any starts from: the low ends of the paper's ranges (N·s/m and N, N·m·s/rad
and N·m)."""
STEP = 0.05
"""Share of its range by which a joint's start is moved where parts overlap: the paper's small step."""
GRIPPY = "rubber"
"""What an object that slides as a whole is made to stand on."""


def correction(seen: Mapping[str, Any], info: ObjectInfo, terms: Terms, rounds: int) -> dict[str, Any] | None:
    """Arguments of ``set_parameters`` after a ``simulate`` that returned ``seen``; None where nothing is to be done.

    ``terms`` is what it was run with; ``rounds`` counts from 1.
    """
    failed = seen.get("failed")
    joints = {joint.name: joint for joint in info.joints}
    if failed == "penetration":
        return _moved(seen, joints, terms)
    if failed not in ("drift", "oscillation"):
        return None
    moving = [item for item in rows(seen, "moving_joints") if item.get("joint") in joints]
    if not moving:
        return {"contact_material": GRIPPY} if rounds == 1 else None
    return {"joints": [_stiffer(item, joints[item["joint"]], failed == "drift") for item in moving]}


def _stiffer(item: Mapping[str, Any], joint: JointInfo, with_friction: bool) -> dict[str, Any]:
    damping, friction = LEAST[joint.motion]
    changed: dict[str, Any] = {"name": joint.name, "damping": FACTOR * max(number(item.get("damping")), damping)}
    if with_friction:
        changed["friction"] = FACTOR * max(number(item.get("friction")), friction)
    return changed


def _moved(seen: Mapping[str, Any], joints: Mapping[str, JointInfo], terms: Terms) -> dict[str, Any] | None:
    """The joints of the worst pair, a step further open."""
    worst = next(iter(rows(seen, "pairs")), {})
    links = (worst.get("link_a"), worst.get("link_b"))
    starts = []
    for joint in joints.values():
        if joint.child not in links or joint.range == 0.0:
            continue
        target = terms.get(joint.name, {}).get("position", joint.zero) + STEP * (joint.open - joint.closed)
        low, high = sorted((joint.closed, joint.open))
        starts.append({"joint": joint.name, "position": min(max(target, low), high)})
    return {"initial_joint_positions": starts} if starts else None
