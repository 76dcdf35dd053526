"""The hold check: whether a joint that must stay where it is placed does so, against gravity."""

from collections.abc import Mapping, Sequence

import numpy as np

from asset2sim.checks.declared_check import DeclaredCheck
from asset2sim.checks.joint_groups import by_joint, run_in_groups
from asset2sim.checks.mechanism import Mechanism, poses_at, pull_on, span_of
from asset2sim.checks.rig import Rig
from asset2sim.checks.watch import capped_reading, watch
from asset2sim.engines.contacts import by_pair
from asset2sim.engines.world import World
from schemas.interaction import Hold, Interaction
from schemas.overlay import JointPhysics
from schemas.settings import EngineSettings, Thresholds
from schemas.verdict import CheckVerdict, Guide
from schemas.vocabulary import FailureMode

TOUCHING_M = 1e-4
"""Overlap from which a part is held by what it touches and not by its joint, m."""
CREEP_SHARE = 0.02
"""Share of the bound that joints may yet move, at their present speeds, for a hold to end early."""
NEVER_EARLIER_S = 0.25
"""A hold does not end before this, s: what starts at rest needs time to be seen moving."""
SURE = 1.05
"""Friction over gravity's pull from which a joint is expected to hold: below, the engines' rounding decides."""


def measure(rig: Rig) -> dict[str, object]:
    """Every joint that must hold."""
    return {"holds": hold_records(rig.held.sound(), rig.item, rig.settings, rig.limits)}


def hold_records(world: World, item: Mechanism, settings: EngineSettings, limits: Thresholds) -> tuple[Hold, ...]:
    """Every joint that must hold, at its initial position and, if friction should hold it, in mid-range; root held.

    At the initial position all in one run: nothing moves, so nothing is coupled. In mid-range independent joints
    together, without those that overlap something there: the sweep reports them.
    """
    holding = [joint for joint in item.joints if joint.holds]
    if not holding:
        return ()
    found = held_at(world, item.start, holding, settings, limits).values()
    middles = middle_positions(item, [joint for joint in item.asked if joint.holds])
    known = {joint.name: joint for joint in holding}

    def run(names: Sequence[str]) -> dict[str, Hold]:
        clear, before = list(names), list[str]()
        while clear != before:  # what goes back to its start may be in the way of the rest, as a door is of a rack
            positions, before = item.start | {name: middles[name] for name in clear}, clear
            world.place(positions)
            clear = unobstructed(world, item, clear)
        return held_at(world, positions, [known[name] for name in clear], settings, limits)

    def good(record: Hold) -> bool:
        return record.moved <= hold_bound(known[record.joint], limits)

    seen = run_in_groups(item, middles, run, good)
    return (*found, *(seen[name] for name in middles if name in seen))


def middle_positions(item: Mechanism, holding: Sequence[JointPhysics]) -> dict[str, float]:
    """Joint → the middle of its range, for joints with limits and more friction than gravity and a spring pull."""
    poses, middles = poses_at(item, item.start), {}
    for joint in holding:
        if joint.lower is None or joint.upper is None:
            continue
        lower, upper = span_of(joint)
        middle = (lower + upper) / 2.0
        pull = float(pull_on(item, joint.name, item.start, poses).at(middle)) + joint.exerted(middle)
        if joint.friction > SURE * abs(pull):
            middles[joint.name] = middle
    return middles


def unobstructed(world: World, item: Mechanism, names: Sequence[str]) -> list[str]:
    """Of these joints, those whose parts overlap nothing at the world's present pose: what touches is pushed out."""
    touched = {
        link for pair in by_pair(world.contacts()) if pair.depth_m > TOUCHING_M for link in (pair.link_a, pair.link_b)
    }
    return [name for name in names if touched.isdisjoint(item.moved[name])]


def held_at(
    world: World,
    positions: Mapping[str, float],
    joints: Sequence[JointPhysics],
    settings: EngineSettings,
    limits: Thresholds,
) -> dict[str, Hold]:
    """Joint → its record; the joints are left at ``positions`` in one run, which ends early once none can go far."""
    if not joints:
        return {}
    world.place(positions)
    order = {name: index for index, name in enumerate(world.joint_names)}
    indices = [order[joint.name] for joint in joints]
    bounds = np.array([hold_bound(joint, limits) for joint in joints])

    start = np.array([positions[joint.name] for joint in joints])
    furthest = np.zeros(len(joints))

    def settled(time: float) -> bool:
        np.maximum(furthest, np.abs(world.positions()[indices] - start), out=furthest)
        ahead = np.abs(world.velocities()[indices]) * (settings.hold_s - time)
        return time >= NEVER_EARLIER_S and bool(np.all(ahead <= CREEP_SHARE * bounds))

    watch(world, settings.hold_s, settings, settled)
    now = np.abs(world.positions()[indices] - start)
    names, seconds = [joint.name for joint in joints], settings.hold_s
    moved = [capped_reading(float(max(far, last))) for far, last in zip(furthest, now, strict=True)]
    return {
        name: Hold(joint=name, position=positions[name], moved=most, seconds=seconds)
        for name, most in zip(names, moved, strict=True)
    }


def judge(seen: Interaction, joints: Mapping[str, JointPhysics], limits: Thresholds) -> list[CheckVerdict]:
    """One verdict a joint, over all positions at which it was held."""
    return [hold_verdict(items, joints[name], seen.engine.value, limits) for name, items in by_joint(seen.holds)]


def hold_bound(joint: JointPhysics, limits: Thresholds) -> float:
    """How far a joint that must hold may move, rad or m."""
    return limits.hold_m if joint.type == "prismatic" else limits.hold_rad


def hold_verdict(items: list[Hold], joint: JointPhysics, engine: str, limits: Thresholds) -> CheckVerdict:
    """A joint that must hold must stay where it is placed, at every position tried; the verdict is on the worst."""
    item = max(items, key=lambda hold: hold.moved)
    unit, limit = joint.unit, hold_bound(joint, limits)
    reason = (
        f"joint '{item.joint}' must stay at {item.position:.4g} {unit} and moves {item.moved:.3g} {unit} in "
        f"{item.seconds:.3g} s in {engine}"
    )
    return CheckVerdict(FailureMode.HOLD, item.joint, item.moved <= limit, item.moved, limit, reason)


CHECK = DeclaredCheck(
    name="hold",
    modes={
        FailureMode.HOLD: Guide(
            "A part that should stay where it is placed does not",
            "heavier than its friction bears within a hand's strength: a lighter material, or say that it falls shut",
        )
    },
    done="joints that stay where they are placed",
    holds="they do",
    bounds=("hold_rad", "hold_m"),
    measure=measure,
    judge=judge,
    place=60,
    turn=60,
    planted=("friction negative",),
)
