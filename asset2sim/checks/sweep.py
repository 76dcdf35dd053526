"""The sweep: every joint over its whole range, and what it runs into on the way."""

from collections.abc import Mapping

import numpy as np

from asset2sim.checks.check_verdict import unit_of
from asset2sim.checks.declared_check import DeclaredCheck
from asset2sim.checks.free_stretch import Stretch, cleared, depths, stretches
from asset2sim.checks.joint_groups import apart_groups
from asset2sim.checks.mechanism import Mechanism, span_of
from asset2sim.checks.rig import CauseOf, Rig
from asset2sim.engines.world import World
from schemas.failure_guide import Guide
from schemas.interaction import Interaction, Obstacle, Opening, Sweep
from schemas.overlay import JointPhysics
from schemas.settings import EngineSettings, Thresholds
from schemas.verdict import CheckVerdict
from schemas.vocabulary import FailureMode, OverlapCause

BEYOND = 12
"""Positions between a hull's obstacle and the end of the range at which the meshes are looked at."""
ROOM_SHARE = 0.02
"""Free share of its range ahead from which a joint that no effort moves counts as stuck."""


def measure(rig: Rig) -> dict[str, object]:
    """Every joint swept; other checks then know where joints are free."""
    found, rig.free_stretches = sweeps(rig.held.sound(), rig.item, rig.settings, rig.limits, rig.cause)
    return {"sweeps": found}


def sweeps(
    world: World, item: Mechanism, settings: EngineSettings, limits: Thresholds, cause: CauseOf
) -> tuple[tuple[Sweep, ...], dict[str, tuple[float, float]]]:
    """The record of every joint, and joint → its free stretch with the others at their initial positions.

    A joint is stopped where two links, one of which it moves, overlap by more than ``sweep_overlap_m`` beyond what they
    do initially, under the engine's default filter. Where one is stopped by what other joints move, those are tried at
    either end of their own free stretch: a rack behind a closed door is not jammed.
    """
    world.place(item.start)
    allowed = {pair: depth + limits.sweep_overlap_m for pair, depth in depths(world).items()}
    found: dict[str, Stretch] = {}
    for group in apart_groups(item, settings.sweep_samples):
        found |= stretches(world, item, group, item.start, allowed, settings, limits)
    free = {name: (stretch.low, stretch.high) for name, stretch in found.items()}
    records = []
    for joint in item.joints:
        stretch, others = found[joint.name], dict[str, float]()
        if stretch.ends:
            stretch, others = cleared(world, item, joint, stretch, free, allowed, settings, limits)
        records.append(record(item, joint, stretch, others, cause))
    return tuple(records), free


def authored_beyond(
    item: Mechanism,
    joint: JointPhysics,
    stretch: Stretch,
    obstacle: Obstacle,
    others: Mapping[str, float],
    cause: CauseOf,
) -> Obstacle | None:
    """The obstacle at the position further on where its links' authored meshes meet; None where they never do."""
    lower, upper = span_of(joint)
    end = upper if obstacle.position >= stretch.high else lower
    for position in np.linspace(obstacle.position, end, BEYOND + 1)[1:].tolist():
        at = item.start | dict(others) | {joint.name: position}
        if cause(obstacle.link_a, obstacle.link_b, at) is OverlapCause.AUTHORED:
            return obstacle.model_copy(update={"position": position, "cause": OverlapCause.AUTHORED})
    return None


def record(item: Mechanism, joint: JointPhysics, stretch: Stretch, others: dict[str, float], cause: CauseOf) -> Sweep:
    """The record of one joint, with the cause of each overlap that ends its free stretch."""
    lower, upper = span_of(joint)
    obstacles = [
        Obstacle(
            position=position,
            link_a=a,
            link_b=b,
            depth_m=depth,
            cause=cause(a, b, item.start | others | {joint.name: position}),
        )
        for position, overlaps in stretch.ends
        for (a, b), depth in sorted(overlaps.items())
    ]
    obstacles += [
        beyond
        for obstacle in obstacles
        if obstacle.cause is OverlapCause.HULL
        and (beyond := authored_beyond(item, joint, stretch, obstacle, others, cause)) is not None
    ]
    return Sweep(
        joint=joint.name,
        lower=lower,
        upper=upper,
        free_share=(stretch.high - stretch.low) / (upper - lower) if upper > lower else 1.0,
        start=joint.initial_position,
        free_lower=stretch.low,
        free_upper=stretch.high,
        others=others,
        obstacles=tuple(obstacles),
    )


def judge(seen: Interaction, joints: Mapping[str, JointPhysics], limits: Thresholds) -> list[CheckVerdict]:
    """One verdict a joint. One that its effort limit cannot move counts as jammed, not as one that takes too much."""
    openings = {item.joint: item for item in seen.openings}
    return [
        sweep_verdict(item, joints[item.joint], openings.get(item.joint), seen.engine.value, limits)
        for item in seen.sweeps
    ]


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


CHECK = DeclaredCheck(
    name="sweep",
    modes={
        FailureMode.JAM: Guide(
            "A joint cannot move over 90 % of its range: something stops it that is not in the meshes, or is",
            "the finding names the pair; `--collision decompose`, or limits in the URDF that end where the part stops",
        )
    },
    done="every joint over its whole range, the others out of its way",
    holds="90 % is free, or authored geometry stops it: the finding names it",
    bounds=("sweep_overlap_m", "sweep_free_share"),
    measure=measure,
    judge=judge,
    place=50,
    turn=50,
    planted=("collision mesh elsewhere",),
)
