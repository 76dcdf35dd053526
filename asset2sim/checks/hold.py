"""The hold check: whether a joint that must stay where it is placed does so, against gravity."""

from collections.abc import Mapping, Sequence

import numpy as np

from asset2sim.checks.interaction_verdict import hold_bound
from asset2sim.checks.joint_groups import run_in_groups
from asset2sim.checks.mechanism import Mechanism, poses_at, pull_on, span_of
from asset2sim.checks.watch import capped, watch
from asset2sim.engines.contacts import by_pair
from asset2sim.engines.world import World
from schemas.interaction import Hold
from schemas.overlay import JointPhysics
from schemas.settings import EngineSettings, Thresholds

TOUCHING_M = 1e-4
"""Overlap from which a part is held by what it touches and not by its joint, m."""
CREEP_SHARE = 0.02
"""Share of the bound that joints may yet move, at their present speeds, for a hold to end early."""
NEVER_EARLIER_S = 0.25
"""A hold does not end before this, s: what starts at rest needs time to be seen moving."""
SURE = 1.05
"""Friction over gravity's pull from which a joint is expected to hold: below, the engines' rounding decides."""


def holds(world: World, item: Mechanism, settings: EngineSettings, limits: Thresholds) -> tuple[Hold, ...]:
    """Every joint that must hold, at its initial position and, if friction should hold it, in mid-range; root held.

    At the initial position all in one run: nothing moves, so nothing is coupled. In mid-range independent joints
    together, without those that overlap something there: the sweep reports them.
    """
    holding = [joint for joint in item.joints if joint.holds]
    if not holding:
        return ()
    found = held(world, item.start, holding, settings, limits).values()
    middles = middle_positions(item, holding)
    known = {joint.name: joint for joint in holding}

    def run(names: Sequence[str]) -> dict[str, Hold]:
        world.place(item.start | {name: middles[name] for name in names})
        clear = unobstructed(world, item, names)
        positions = item.start | {name: middles[name] for name in clear}
        return held(world, positions, [known[name] for name in clear], settings, limits)

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
        spring = joint.stiffness * (joint.spring_reference - middle)
        pull = float(pull_on(item, joint.name, item.start, poses).at(middle)) + spring
        if joint.friction > SURE * abs(pull):
            middles[joint.name] = middle
    return middles


def unobstructed(world: World, item: Mechanism, names: Sequence[str]) -> list[str]:
    """Of these joints, those whose parts overlap nothing at the world's present pose: what touches is pushed out."""
    touched = {
        link for pair in by_pair(world.contacts()) if pair.depth_m > TOUCHING_M for link in (pair.link_a, pair.link_b)
    }
    return [name for name in names if not touched & item.moved[name]]


def held(
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
    moved = [capped(float(max(far, last))) for far, last in zip(furthest, now, strict=True)]
    return {
        name: Hold(joint=name, position=positions[name], moved=most, seconds=seconds)
        for name, most in zip(names, moved, strict=True)
    }
