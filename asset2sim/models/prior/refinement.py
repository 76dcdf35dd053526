"""A step of the joint state, with the paper's step sizes: large while the state is wrong, small near the end."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from asset2sim.models.language.object_info import dicts, number, number_or_none, text_or_empty, unique

APPROVE_M = 0.002
"""Φ at which the paper approves a state, m."""
STATE_TOLERANCE = 0.10
"""Share of its range that a joint may be off the asked position."""
STEPS = ((0.02, 0.15), (0.01, 0.08), (0.0, 0.03))
"""(Φ above which, share of the range): the paper moves 5 to 25 % above 0.02 m, and little under 0.01 m."""
WRONG_STATE_STEP = 0.25
"""Share of the range that a joint in the wrong state moves (paper: 10 to 40 %)."""


@dataclass(frozen=True)
class FocusJoint:
    """A joint under refinement: where it is, where it was asked to be, where it came to rest (None: not watched), the
    positions that earlier refused proposals gave it, and its range; rad or m."""

    name: str
    position: float
    desired: float
    lower: float
    upper: float
    closed: float
    open: float
    settled: float | None = None
    tried: tuple[float, ...] = ()


def read_refinement(data: Mapping[str, object]) -> tuple[float, tuple[FocusJoint, ...]]:
    """Φ in m and the joints to move, from a refinement prompt; joints without limits are given a full turn."""
    joints = []
    tried = [places for item in dicts(data.get("tried")) if isinstance(places := item.get("positions"), dict)]
    for item in dicts(data.get("focus_joints")):
        position = number(item.get("position"), 0.0)
        lower, upper = number(item.get("lower"), -math.pi), number(item.get("upper"), math.pi)
        joints.append(
            FocusJoint(
                name=text_or_empty(item.get("name")),
                position=position,
                desired=number(item.get("desired"), position),
                lower=min(lower, upper),
                upper=max(lower, upper),
                closed=number(item.get("closed"), lower),
                open=number(item.get("open"), upper),
                settled=number_or_none(item.get("settled")),
                tried=tuple(number(places.get(text_or_empty(item.get("name"))), position) for places in tried),
            )
        )
    return number(data.get("phi_m"), 0.0), unique(joints)


def refinement_step(phi_m: float, joints: Sequence[FocusJoint]) -> dict[str, object]:
    """state_ok, approved, and deltas (rad or m) that keep every joint within its limits.

    Joints out of the asked state go back to it. While parts overlap, the others go towards open (doors, drawers and
    lids overlap with their body when they are closed too far), and back to the asked position once they are as open as
    its tolerance allows. A joint that fell moves away from where it settled, within the tolerance. After a
    refusal the step goes the other way, once; then nothing is proposed.
    """
    fell = any(_off(joint, joint.settled) > STATE_TOLERANCE for joint in joints)
    state_ok = not fell and all(_off(joint, joint.position) <= STATE_TOLERANCE for joint in joints)
    approved = state_ok and phi_m <= APPROVE_M
    deltas: dict[str, float] = {}
    for joint in joints:
        span = joint.upper - joint.lower
        if approved or span <= 0.0 or len(joint.tried) > 1:
            continue
        if joint.settled is not None and _off(joint, joint.settled) > STATE_TOLERANCE:
            step = math.copysign(STATE_TOLERANCE * span, joint.position - joint.settled)
        elif _off(joint, joint.position) > STATE_TOLERANCE:
            gap = joint.desired - joint.position
            step = math.copysign(min(abs(gap), WRONG_STATE_STEP * span), gap)
        else:
            step = _opening_step(joint, span, phi_m)
        if joint.tried:
            step = -step
        target = min(max(joint.position + step, joint.lower), joint.upper)
        if target != joint.position:
            deltas[joint.name] = target - joint.position
    return {"state_ok": state_ok, "approved": approved, "deltas": deltas}


def _off(joint: FocusJoint, position: float | None) -> float:
    span = joint.upper - joint.lower
    return abs(position - joint.desired) / span if position is not None and span > 0.0 else 0.0


def _opening_step(joint: FocusJoint, span: float, phi_m: float) -> float:
    share = next(share for above, share in STEPS if phi_m > above or above == 0.0)
    direction = math.copysign(1.0, joint.open - joint.closed) if joint.open != joint.closed else 0.0
    furthest = joint.desired + direction * STATE_TOLERANCE * span
    room = (furthest - joint.position) * direction
    if direction == 0.0 or room <= 1e-6 * span or joint.position == joint.open:
        return joint.desired - joint.position
    return direction * min(share * span, room)
