"""A step of the joint state, with the paper's step sizes: large while the state is wrong, small near the end."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

APPROVE_M = 0.002
"""Φ at which the paper approves a state, m."""
STATE_TOLERANCE = 0.10
"""Share of its range that a joint may be off the asked position ..."""
ROUNDING = 1e-4
"""... and how much beyond, since a prompt's numbers are rounded."""
STEPS = ((0.02, 0.15), (0.01, 0.08), (0.0, 0.03))
"""(Φ above which, share of the range): the paper moves 5 to 25 % above 0.02 m, and little under 0.01 m."""
WRONG_STATE_STEP = 0.25
"""Share of the range that a joint in the wrong state moves (paper: 10 to 40 %)."""

MARGIN = 1.15
"""How much further than what is said to part two links a joint goes: contacts shift as it moves."""


@dataclass(frozen=True)
class FocusJoint:
    """A joint under refinement: where it is, where it was asked to be, the positions that refused proposals gave it
    since the last accepted one, its range, and its reach; rad or m. ``apart`` is the change of position that parts the
    worst of the collisions that it can part, 0 for none, ``first`` whether it is the cheapest joint to do so. ``asked``
    is false where the prompt says nothing of the joint; its ``desired`` position is then only where it started."""

    name: str
    position: float
    desired: float
    lower: float
    upper: float
    closed: float
    open: float
    tried: tuple[float, ...] = ()
    reach: tuple[float, float] = (-math.inf, math.inf)
    apart: float = 0.0
    first: bool = False
    asked: bool = True


def read_refinement(data: Mapping[str, Any]) -> tuple[float, tuple[FocusJoint, ...]]:
    """Φ in m and the joints to move, from a refinement prompt; joints without limits are given a full turn."""
    history = data.get("tried", [])
    kept = [index for index, item in enumerate(history) if item.get("accepted")]
    since = history[kept[-1] + 1 :] if kept else history
    apart, first = parting_step(data.get("collisions", ()))
    joints = []
    for item in data["focus_joints"]:
        name, position = item["name"], item["position"]
        limits = item.get("lower"), item.get("upper")
        lower, upper = (turn if at is None else at for at, turn in zip(limits, (-math.pi, math.pi), strict=True))
        joints.append(
            FocusJoint(
                name=name,
                position=position,
                desired=item["desired"],
                lower=min(lower, upper),
                upper=max(lower, upper),
                closed=item["closed"],
                open=item["open"],
                tried=tuple(tried["positions"].get(name, position) for tried in since),
                reach=tuple(item.get("reach", (-math.inf, math.inf))),
                apart=apart.get(name, 0.0),
                first=name in first,
                asked=item.get("asked", True),
            )
        )
    return data["phi_m"], tuple(joints)


def parting_step(collisions: Sequence[Mapping[str, Any]]) -> tuple[dict[str, float], frozenset[str]]:
    """Joint → change of position (rad or m) that parts the worst collision it can, and each collision's cheapest."""
    apart: dict[str, float] = {}
    parting = [collision.get("parted_by", ()) for collision in collisions]
    for item in (item for ways in parting for item in ways):
        apart.setdefault(item["joint"], item["change"])
    return apart, frozenset(ways[0]["joint"] for ways in parting if ways)


def refinement_step(phi_m: float, joints: Sequence[FocusJoint]) -> dict[str, object]:
    """state_ok, approved, and deltas (rad or m) that keep every joint within its limits.

    Joints out of the asked state go back to it. While parts overlap, the joints that part them go as far as the prompt
    says that it takes; after a refusal in another of ``parting_ways``, while there are any.
    Where the prompt names none, joints go towards open (doors, drawers and lids overlap with their body when they are
    closed too far), and back to the asked position once they are as open as its tolerance allows. After a refusal such
    a step goes the other way, once; then nothing is proposed.
    """
    state_ok = not any(_off(joint) for joint in joints)
    approved = state_ok and phi_m <= APPROVE_M
    deltas: dict[str, float] = {}
    if state_ok and not approved and any(joint.apart for joint in joints):
        refused = max(len(joint.tried) for joint in joints)
        deltas = next(iter(parting_ways(joints)[refused:]), {})
        return {"state_ok": state_ok, "approved": approved, "deltas": deltas}
    for joint in joints:
        span = joint.upper - joint.lower
        if approved or span <= 0.0 or len(joint.tried) > 1:
            continue
        if _off(joint):
            gap = joint.desired - joint.position
            step = math.copysign(min(abs(gap), WRONG_STATE_STEP * span), gap)
        else:
            step = _opening_step(joint, span, phi_m)
        deltas |= _within(joint, -step if joint.tried else step)
    return {"state_ok": state_ok, "approved": approved, "deltas": deltas}


def parting_ways(joints: Sequence[FocusJoint]) -> list[dict[str, float]]:
    """Steps worth a try while parts overlap, the best first, each of which leads somewhere: the cheapest joint of each
    collision as far as it takes, all that part some, the first by half, and the first the other way."""
    first = {joint.name: MARGIN * joint.apart for joint in joints if joint.first}
    every = {joint.name: MARGIN * joint.apart for joint in joints}
    half, back = ({name: share * step for name, step in first.items()} for share in (0.5, -1.0))
    found: list[dict[str, float]] = []
    for way in (first, every, half, back):
        deltas: dict[str, float] = {}
        for joint in joints:
            deltas |= _within(joint, way.get(joint.name, 0.0))
        if deltas and deltas not in found:
            found.append(deltas)
    return found


def _within(joint: FocusJoint, step: float) -> dict[str, float]:
    """The joint's step, cut off at its limits and its reach; empty where nothing is left of it."""
    low, high = max(joint.lower, joint.reach[0]), min(joint.upper, joint.reach[1])
    target = min(max(joint.position + step, low), high)
    return {joint.name: target - joint.position} if target != joint.position else {}


def _off(joint: FocusJoint) -> bool:
    """Whether a joint is out of the state that is asked."""
    span = joint.upper - joint.lower
    return joint.asked and span > 0.0 and abs(joint.position - joint.desired) > (STATE_TOLERANCE + ROUNDING) * span


def _opening_step(joint: FocusJoint, span: float, phi_m: float) -> float:
    share = next(share for above, share in STEPS if phi_m > above or above == 0.0)
    direction = math.copysign(1.0, joint.open - joint.closed) if joint.open != joint.closed else 0.0
    furthest = joint.desired + direction * STATE_TOLERANCE * span
    room = (furthest - joint.position) * direction
    if direction == 0.0 or room <= 1e-6 * span or joint.position == joint.open:
        return joint.desired - joint.position
    return direction * min(share * span, room)
