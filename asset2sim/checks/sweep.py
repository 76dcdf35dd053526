"""The sweep: every joint over its whole range, and what it runs into on the way."""

from collections.abc import Mapping

import numpy as np

from asset2sim.checks.declared_check import DeclaredCheck
from asset2sim.checks.free_stretch import Stretch, Sweeper, overlap_depths
from asset2sim.checks.joint_groups import apart_groups
from asset2sim.checks.mechanism import Mechanism, span_of
from asset2sim.checks.rig import CauseOf, Rig
from asset2sim.engines.world import World
from asset2sim.physics.on_floor import StandingParts
from schemas.interaction import Interaction, Obstacle, Opening, Sweep
from schemas.overlay import JointPhysics
from schemas.settings import EngineSettings, Thresholds
from schemas.verdict import CheckVerdict, Guide
from schemas.vocabulary import FailureMode, OverlapCause

BEYOND = 12
"""Positions between a hull's obstacle and the end of the range at which the meshes are looked at."""
FLOOR_SAMPLES = 97
"""Positions on either side at which a part is looked for below the floor."""
ROOM_SHARE = 0.02
"""Free share of its range ahead from which a joint that no effort moves counts as stuck."""


def measure(rig: Rig) -> dict[str, object]:
    """Every joint swept, and its range ended where its part meets the floor, save of a light object, which a hand lifts
    off it; other checks then know where joints are free of the rest of the object."""
    found, rig.free_stretches = sweep_records(rig.held.sound(), rig.item, rig.settings, rig.limits, rig.cause)
    if rig.standing is None or rig.standing.mass < rig.limits.held_by_hand_kg:
        return {"sweeps": found}
    return {"sweeps": tuple(over_floor(item, rig.standing, rig.limits) for item in found)}


def over_floor(record: Sweep, standing: StandingParts, limits: Thresholds) -> Sweep:
    """The record of a joint, ended on either side where its part reaches into the floor by more than
    ``sweep_overlap_m``, if the object stands without that part."""
    low, high = (record.start if end is None else end for end in (record.free_lower, record.free_upper))
    hinge = next(item for item in standing.tree if item.name == record.joint)
    ends, stops = [low, high], []
    for side, end in enumerate((low, high)) if hinge.type != "continuous" else ():
        ways = np.linspace(record.start, end, FLOOR_SAMPLES)
        depths_m = -standing.heights(record.joint, ways.tolist())
        if depths_m.max() > limits.sweep_overlap_m:
            first = int(np.argmax(depths_m > limits.sweep_overlap_m))
            ends[side] = float(ways[max(first - 1, 0)])
            stops.append(
                Obstacle(
                    position=float(ways[first]),
                    link_a=hinge.child,
                    link_b="floor",
                    depth_m=float(depths_m[first]),
                    cause=OverlapCause.FLOOR,
                )
            )
    if not stops or standing.carries(record.joint) or standing.floor_without(standing.moved(record.joint)) is None:
        return record
    kept = [
        item
        for item in record.obstacles
        if ends[0] <= item.position <= ends[1]
        or (item.position < ends[0] and ends[0] == low)
        or (item.position > ends[1] and ends[1] == high)
    ]
    share = (ends[1] - ends[0]) / (record.upper - record.lower)
    return record.model_copy(
        update={"free_lower": ends[0], "free_upper": ends[1], "free_share": share, "obstacles": (*kept, *stops)}
    )


def sweep_records(
    world: World, item: Mechanism, settings: EngineSettings, limits: Thresholds, cause: CauseOf
) -> tuple[tuple[Sweep, ...], dict[str, tuple[float, float]]]:
    """The record of every joint, and joint → its free stretch with the others at their initial positions.

    A joint is stopped where two links, one of which it moves, overlap by more than ``sweep_overlap_m`` beyond what they
    do initially, under the engine's default filter. Where one is stopped by what other joints move, those are tried at
    either end of their own free stretch: a rack behind a closed door is not jammed.
    """
    world.place(item.start)
    most_m = limits.sweep_overlap_m
    allowed = {pair: depth + most_m for pair, depth in overlap_depths(world).items()}
    sweeper = Sweeper(world, item, settings.sweep_samples, most_m, allowed)
    found: dict[str, Stretch] = {}
    for group in apart_groups(item, settings.sweep_samples):
        found |= sweeper.stretches(group, item.start)
    free = {name: (stretch.low, stretch.high) for name, stretch in found.items()}
    records = []
    for joint in item.asked:
        stretch, others = found[joint.name], dict[str, float]()
        if stretch.ends:
            stretch, others = sweeper.cleared_stretch(joint, stretch, free)
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
    """A joint must move freely over most of its range, and not be stuck. Authored geometry or the floor may stop it
    earlier, not before ``sweep_excused_share``."""
    unit, lost, limit = joint.unit, hull_loss(item), limits.sweep_free_share
    where = "; ".join(
        f"'{o.link_a}' and '{o.link_b}' overlap by {1e3 * o.depth_m:.3g} mm at {o.position:.4g} {unit} "
        f"({o.cause.value})"
        for o in item.obstacles
    )
    excused = any(o.cause is not OverlapCause.HULL for o in item.obstacles)
    others = ", ".join(f"'{name}' at {position:.4g}" for name, position in item.others.items())
    swept = f"joint '{item.joint}' is free over {100 * item.free_share:.0f} % of its range in {engine}"
    swept += (f" with {others}" if others else "") + (f": {where}" if where else "")
    if 1.0 - lost < limit:
        return CheckVerdict(FailureMode.JAM, item.joint, False, 1.0 - lost, limit, swept + "; a hull is in its way")
    if item.free_share < limits.sweep_excused_share:
        reason = f"{swept}; it moves too little to be of use: mend the meshes or the joint's limits"
        return CheckVerdict(FailureMode.JAM, item.joint, False, item.free_share, limits.sweep_excused_share, reason)
    if opening is not None and not excused and is_stuck(item, joint, opening):
        reason = f"joint '{item.joint}' is stuck in {engine}: no effort up to its limit moves it where it has room"
        return CheckVerdict(FailureMode.JAM, item.joint, False, opening.effort_limit, opening.effort_limit, reason)
    if item.free_share < limit:
        floor = any(o.cause is OverlapCause.FLOOR for o in item.obstacles)
        swept += "; the floor stops it" if floor else "; the authored geometry stops it"
    return CheckVerdict(FailureMode.JAM, item.joint, True, item.free_share, limit, swept)


def hull_loss(item: Sweep) -> float:
    """Share of the range that hulls alone take: on each side, up to where authored meshes or the floor would."""
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
        excused = [abs(o.position - free) for o in obstacles if o.cause is not OverlapCause.HULL]
        if first not in excused:
            lost += min([abs(end - free), *excused])
    return lost / (item.upper - item.lower)


def is_stuck(item: Sweep, joint: JointPhysics, opening: Opening | None) -> bool:
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
    holds="90 % is free, or authored geometry or the floor stops it after 30 %: the finding names it",
    bounds=("sweep_overlap_m", "sweep_free_share", "sweep_excused_share", "held_by_hand_kg"),
    measure=measure,
    judge=judge,
    place=50,
    turn=50,
    planted=("collision mesh elsewhere",),
)
