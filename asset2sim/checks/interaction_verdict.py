"""The verdicts on the interaction checks: pure functions of the records, the overlay and the thresholds."""

import math
from collections.abc import Iterable
from typing import TypeVar

from asset2sim.checks.check_verdict import CheckVerdict, unit_of
from asset2sim.checks.effort_verdict import effort_verdict
from schemas.interaction import (
    Drop,
    Effort,
    Hold,
    Interaction,
    Nudge,
    Opening,
    Release,
    Reset,
    SettledJoint,
    Stand,
    Sweep,
)
from schemas.overlay import JointPhysics, PhysicsOverlay
from schemas.settings import Thresholds
from schemas.vocabulary import FailureMode, OverlapCause

ROOM_SHARE = 0.02
"""Free share of its range ahead from which a joint that no effort moves counts as stuck."""


def interaction_verdicts(
    interaction: Interaction, overlay: PhysicsOverlay, thresholds: Thresholds
) -> tuple[CheckVerdict, ...]:
    """One verdict per check and subject, in the order stands, state, drop, nudge, jam, hold, release, reset, effort. A
    joint that its effort limit cannot move counts as jammed, not as one that takes too much."""
    joints = {joint.name: joint for joint in overlay.joints}
    engine = interaction.engine.value
    openings = {item.joint: item for item in interaction.openings}
    verdicts = [] if interaction.stand is None else [stand_verdict(interaction.stand, engine, thresholds)]
    verdicts += [state_verdict(item, joints[item.joint], engine, thresholds) for item in interaction.settled]
    verdicts += [drop_verdict(item, engine, thresholds) for item in interaction.drops]
    verdicts += [nudge_verdict(item, joints[item.joint], engine, thresholds) for item in interaction.nudges]
    verdicts += [
        sweep_verdict(item, joints[item.joint], openings.get(item.joint), engine, thresholds)
        for item in interaction.sweeps
    ]
    verdicts += [
        hold_verdict(items, joints[items[0].joint], engine, thresholds) for items in by_joint(interaction.holds)
    ]
    verdicts += [release_verdict(item, joints[item.joint], engine, thresholds) for item in interaction.releases]
    verdicts += [reset_verdict(item, index, interaction, thresholds) for index, item in enumerate(interaction.resets)]
    verdicts += [effort_verdict(items, joints[items[0].joint], engine) for items in by_joint(interaction.efforts)]
    return tuple(verdicts)


OfJoint = TypeVar("OfJoint", Hold, Effort)


def by_joint(records: Iterable[OfJoint]) -> list[list[OfJoint]]:
    """The records grouped by joint: one is held at several positions, and moved both ways."""
    grouped: dict[str, list[OfJoint]] = {}
    for item in records:
        grouped.setdefault(item.joint, []).append(item)
    return list(grouped.values())


def hold_bound(joint: JointPhysics, limits: Thresholds) -> float:
    """How far a joint that must hold may move, rad or m."""
    return limits.hold_m if joint.type == "prismatic" else limits.hold_rad


def stand_verdict(item: Stand, engine: str, limits: Thresholds) -> CheckVerdict:
    """An object must stay as it is set down: upright, where it is, without a jump."""
    placed = f"set down in its initial state in {engine} it"
    checks = (
        (item.tilt_rad, limits.stands_rad, f"{placed} tilts by {math.degrees(item.tilt_rad):.3g}°"),
        (item.travel_m, limits.stands_m, f"{placed} travels {100.0 * item.travel_m:.3g} cm"),
        (item.peak_speed_m_s, limits.stands_m_s, f"{placed} moves at {item.peak_speed_m_s:.3g} m/s"),
    )
    margin = f"its margin to tip over is {math.degrees(item.margin_rad):.3g}° ({item.tip_energy_j:.3g} J)"
    for value, limit, text in checks:
        if value > limit or not item.finite:
            advice = "; lean it on something, fix it, or ask for a state in which it stands"
            return CheckVerdict(FailureMode.STANDS, "object", False, value, limit, f"{text}; {margin}{advice}")
    value, limit, text = checks[0]
    return CheckVerdict(FailureMode.STANDS, "object", True, value, limit, f"{text}; {margin}")


def state_verdict(item: SettledJoint, joint: JointPhysics, engine: str, limits: Thresholds) -> CheckVerdict:
    """A joint of which a position is asked must settle near it."""
    unit, limit = unit_of(joint), limits.state_share
    reason = (
        f"joint '{item.joint}', asked to stand at {item.asked:.4g} {unit}, settles at {item.settled:.4g} in {engine}"
    )
    if item.share <= limit:
        return CheckVerdict(FailureMode.STATE, item.joint, True, item.share, limit, reason)
    reason += f", {item.share:.3g} of its range away; ask for a state in which it rests, or for a joint that holds"
    return CheckVerdict(FailureMode.STATE, item.joint, False, item.share, limit, reason)


def drop_verdict(item: Drop, engine: str, limits: Thresholds) -> CheckVerdict:
    """A dropped object must not explode, must come to rest and must not end in the plane."""
    subject = f"{1.0 / item.timestep_s:.0f} Hz"
    dropped = f"dropped from {100 * item.height_m:.3g} cm in {engine} at {subject}"
    peak = (item.peak_speed_m_s, limits.peak_speed_m_s)
    final = (item.final_speed_m_s, limits.final_speed_m_s)
    if not item.finite or peak[0] > peak[1]:
        reason = f"{dropped} it explodes: a link reaches {peak[0]:.3g} m/s"
        return CheckVerdict(FailureMode.DROP, subject, False, *peak, reason)
    if final[0] > final[1]:
        reason = f"{dropped} a link still moves at {final[0]:.3g} m/s after {item.seconds:.3g} s"
        return CheckVerdict(FailureMode.DROP, subject, False, *final, reason)
    if item.sink_m > limits.sink_m:
        reason = f"{dropped} it ends {1e3 * item.sink_m:.3g} mm deep in the plane"
        return CheckVerdict(FailureMode.DROP, subject, False, item.sink_m, limits.sink_m, reason)
    reason = f"{dropped} it reaches {peak[0]:.3g} m/s and is at rest after {item.seconds:.3g} s"
    return CheckVerdict(FailureMode.DROP, subject, True, *peak, reason)


def nudge_verdict(item: Nudge, joint: JointPhysics, engine: str, limits: Thresholds) -> CheckVerdict:
    """A nudged joint must lose its speed, and nothing that it moves may explode."""
    unit = unit_of(joint)
    nudged = f"joint '{item.joint}' nudged to {item.speed:.3g} {unit}/s in {engine}"
    if not item.finite or item.peak_speed_m_s > limits.peak_speed_m_s:
        reason = f"{nudged}: what it moves explodes, to {item.peak_speed_m_s:.3g} m/s"
        return CheckVerdict(FailureMode.NUDGE, item.joint, False, item.peak_speed_m_s, limits.peak_speed_m_s, reason)
    share = item.final_speed / abs(item.speed) if item.speed else 0.0
    reason = f"{nudged} moves at {item.final_speed:.3g} {unit}/s after {item.seconds:.3g} s"
    passed = share <= limits.nudge_remaining
    return CheckVerdict(FailureMode.NUDGE, item.joint, passed, share, limits.nudge_remaining, reason)


def sweep_verdict(
    item: Sweep, joint: JointPhysics, opening: Opening | None, engine: str, limits: Thresholds
) -> CheckVerdict:
    """A joint must move freely over most of its range, save where authored geometry stops it, and not be stuck."""
    unit, lost, limit = unit_of(joint), hull_loss(item), limits.sweep_free_share
    where = "; ".join(
        f"'{o.link_a}' and '{o.link_b}' overlap by {1e3 * o.depth_m:.3g} mm at {o.position:.4g} {unit} "
        f"({o.cause.value})"
        for o in item.obstacles
    )
    authored = any(o.cause is OverlapCause.AUTHORED for o in item.obstacles)
    others = ", ".join(f"'{name}' at {position:.4g}" for name, position in item.others.items())
    swept = f"joint '{item.joint}' is free over {100 * item.free_share:.0f} % of its range in {engine}"
    swept += (f" with {others}" if others else "") + (f": {where}" if where else "")
    if 1.0 - lost < limit:
        return CheckVerdict(FailureMode.JAM, item.joint, False, 1.0 - lost, limit, swept + "; a hull is in its way")
    if opening is not None and not authored and stuck(item, joint, opening):
        reason = f"joint '{item.joint}' is stuck in {engine}: no effort up to its limit moves it where it has room"
        return CheckVerdict(FailureMode.JAM, item.joint, False, opening.effort_limit, opening.effort_limit, reason)
    if item.free_share < limit:
        swept += "; the authored geometry stops it"
    return CheckVerdict(FailureMode.JAM, item.joint, True, item.free_share, limit, swept)


def hull_loss(item: Sweep) -> float:
    """Share of the range lost to hulls alone: on each side, up to where the authored meshes would stop the joint."""
    if item.free_lower is None or item.free_upper is None or item.upper <= item.lower:
        return 1.0 - item.free_share if any(o.cause is OverlapCause.HULL for o in item.obstacles) else 0.0
    lost = 0.0
    for free, end, obstacles in (
        (item.free_lower, item.lower, [o for o in item.obstacles if o.position <= item.free_lower]),
        (item.free_upper, item.upper, [o for o in item.obstacles if o.position >= item.free_upper]),
    ):
        if not obstacles:
            continue
        first = min(abs(o.position - free) for o in obstacles)
        authored = [abs(o.position - free) for o in obstacles if o.cause is OverlapCause.AUTHORED]
        if first not in authored:
            lost += min([abs(end - free), *authored])
    return lost / (item.upper - item.lower)


def stuck(item: Sweep, joint: JointPhysics, opening: Opening | None) -> bool:
    """Whether no effort moves a joint in a direction in which the sweep found it free. Never so where other joints must
    first make room, or where the joint has no free range on that side."""
    if opening is None or not opening.stuck or item.others:
        return False
    low = item.lower if item.free_lower is None else item.free_lower
    high = item.upper if item.free_upper is None else item.free_upper
    rooms = (high - item.start, item.start - low)
    opens, closes = rooms if joint.open >= joint.closed else rooms[::-1]
    least = ROOM_SHARE * (item.upper - item.lower)
    return (opening.opening is None and opens > least) or (opening.closing is None and closes > least)


def hold_verdict(items: list[Hold], joint: JointPhysics, engine: str, limits: Thresholds) -> CheckVerdict:
    """A joint that must hold must stay where it is placed, at every position tried; the verdict is on the worst."""
    item = max(items, key=lambda hold: hold.moved)
    unit, limit = unit_of(joint), hold_bound(joint, limits)
    reason = (
        f"joint '{item.joint}' must stay at {item.position:.4g} {unit} and moves {item.moved:.3g} {unit} in "
        f"{item.seconds:.3g} s in {engine}"
    )
    return CheckVerdict(FailureMode.HOLD, item.joint, item.moved <= limit, item.moved, limit, reason)


def release_verdict(item: Release, joint: JointPhysics, engine: str, limits: Thresholds) -> CheckVerdict:
    """A joint that is let go of must reach its rest, and stay there."""
    unit, left = unit_of(joint), item.left
    passed = item.seconds is not None and left <= limits.release_share
    done = f"is there after {item.seconds:.3g} s" if item.seconds is not None else "does not get there"
    reason = (
        f"joint '{item.joint}' let go of at {item.start:.4g} {unit} should be brought to {item.target:.4g} {unit} by "
        f"{item.by}: it {done} and ends at {item.end:.4g} {unit} in {engine}"
    )
    return CheckVerdict(FailureMode.RELEASE, item.joint, passed, left, limits.release_share, reason)


def reset_verdict(item: Reset, index: int, interaction: Interaction, limits: Thresholds) -> CheckVerdict:
    """A perturbed start must end at rest, upright, with the joints that must hold where they were.

    An object that stands so narrow that the start has the energy to topple it may topple, as the real one would, and a
    joint that a hand can move may slip where its friction cannot brake the fall: then it must only come to rest.
    """
    engine, subject = interaction.engine.value, f"start {index + 1}"
    shift = ", ".join(f"{1e3 * v:.3g}" for v in item.offset_m)
    tilt = ", ".join(f"{v:.3g}" for v in item.tilt_rad)
    began = f"{subject} in {engine}, shifted by ({shift}) mm and turned by ({tilt}) rad"
    if item.joint_share > 0.0:
        began = f"{subject} in {engine}, every joint moved by {item.joint_share:.3g} of its range"
    held = "a joint" if item.joint is None else f"joint '{item.joint}'"
    checks: tuple[tuple[float, float, str], ...] = (
        (item.peak_speed_m_s, limits.peak_speed_m_s, "a link reaches {:.3g} m/s"),
        (item.final_speed_m_s, limits.final_speed_m_s, "a link still moves at {:.3g} m/s at the end"),
        (item.turned_rad, limits.reset_turn_rad, "it ends {:.3g} rad from where it rests undisturbed"),
        (item.joint_motion, limits.reset_joint_share, held + ", which must hold, moves over {:.3g} of its range"),
    )
    # The largest rise of the centre of mass that the start gives, m: its height, and its tilt.
    given = max(0.0, item.offset_m[2]) + math.dist(item.tilt_rad, (0.0, 0.0, 0.0)) * interaction.support_m
    topples = item.turned_rad > limits.reset_turn_rad
    if topples and interaction.tip_rise_m is not None and interaction.tip_rise_m <= given:
        why = f"it topples, which a rise of {1e3 * interaction.tip_rise_m:.3g} mm does and this start gives"
        checks = (*checks[:2], (item.turned_rad, math.pi, f"{{:.3g}} rad: {why} {1e3 * given:.3g} mm"))
    slips = ""
    if item.joint_motion > limits.reset_joint_share and item.slip_given > limits.reset_joint_share:
        slips = f"; {held} slips over {item.joint_motion:.3g} of its range: its friction cannot brake this fall"
        checks = checks[:3]
    for value, limit, text in checks:
        if value > limit or not item.finite:
            return CheckVerdict(FailureMode.RESET, subject, False, value, limit, f"{began}: {text.format(value)}")
    value, limit, text = checks[2]
    return CheckVerdict(
        FailureMode.RESET, subject, True, value, limit, f"{began}: {text.format(value)}, at rest{slips}"
    )
