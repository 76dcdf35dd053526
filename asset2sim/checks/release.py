"""The release check: whether a joint that gravity or a spring should bring back returns, and stays there."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from asset2sim.checks.declared_check import DeclaredCheck
from asset2sim.checks.joint_groups import run_in_groups
from asset2sim.checks.mechanism import Mechanism, poses_at, pull_on, span_of
from asset2sim.checks.rig import Rig
from asset2sim.checks.watch import capped_reading, watch
from asset2sim.engines.world import World
from asset2sim.physics.mass_matrix import Pull
from schemas.interaction import Interaction, Release, share_left
from schemas.overlay import JointPhysics
from schemas.settings import EngineSettings, Thresholds
from schemas.verdict import CheckVerdict, Guide
from schemas.vocabulary import FailureMode

GRAVITY, SPRING = "gravity", "spring"
START_SHARE = 0.5
"""Where a joint is released, as a share of the way from its target to the far end of its range: half open."""
SAMPLES = 65
"""Positions over its range at which the force on a joint is evaluated to find where it comes to rest."""
SURE = 1.1
"""Gravity's pull over friction from which a lid is expected to fall: below, rounding in the engines decides."""
LEAST_WAY_SHARE = 0.02
"""Least travel of a release, as a share of the range: a shorter one shows nothing."""

Stretches = Mapping[str, tuple[float, float]]
"""Joint → the stretch in which the sweep found it free, rad or m."""


@dataclass(frozen=True)
class ExpectedRelease:
    """One joint to release at ``start``; ``by`` should bring it to between ``target`` and ``far`` (all rad or m)."""

    joint: JointPhysics
    by: str
    start: float
    target: float
    far: float


def measure(rig: Rig) -> dict[str, object]:
    """Every joint that something brings back."""
    return {"releases": release_records(rig.held.sound(), rig.item, rig.free_stretches, rig.settings, rig.limits)}


def release_records(
    world: World, item: Mechanism, free: Stretches, settings: EngineSettings, limits: Thresholds
) -> tuple[Release, ...]:
    """Let go of every joint that gravity or its spring brings back, the root held, independent joints together. Joints
    move within the stretch in which the sweep found them ``free``: an obstacle is the sweep's to report."""
    poses = poses_at(item, item.start)
    tasks: dict[str, ExpectedRelease] = {}
    for joint in item.asked:
        task = release_task(joint, pull_on(item, joint.name, item.start, poses), free.get(joint.name, span_of(joint)))
        if task is not None:
            tasks[joint.name] = task

    def run(names: Sequence[str]) -> dict[str, Release]:
        return released_together(world, item, [tasks[name] for name in names], settings, limits)

    def good(record: Release) -> bool:
        return record.left <= limits.release_share

    found = run_in_groups(item, tasks, run, good)
    return tuple(found[name] for name in tasks)


def release_task(joint: JointPhysics, pull: Pull, free: tuple[float, float]) -> ExpectedRelease | None:
    """Where a joint is released and where it should come to rest; None where nothing brings it back.

    A joint with a spring rests where k (q_ref − q) and gravity's pull balance, short of it by friction, or at the end
    of its free stretch. One without a spring that need not hold rests at the end towards which gravity pulls it harder
    than friction all the way from half open.
    """
    low, high = free
    if high <= low:
        return None
    task: ExpectedRelease | None = None
    if joint.stiffness > 0.0 and not joint.holds:
        task = spring_task(joint, pull, low, high)
    elif not joint.holds and joint.lower is not None and joint.upper is not None:
        task = gravity_task(joint, pull, low, high)
    lower, upper = span_of(joint)
    return task if task is not None and abs(task.start - task.target) > LEAST_WAY_SHARE * (upper - lower) else None


def gravity_task(joint: JointPhysics, pull: Pull, low: float, high: float) -> ExpectedRelease | None:
    """The task of a joint that gravity closes or opens: pulled harder than friction over half of its free stretch."""
    middle = low + START_SHARE * (high - low)
    for end in (low, high):
        way = np.linspace(middle, end, SAMPLES)
        if np.all(np.sign(end - middle) * (pull.at(way) + exerted_effort(joint, way)) > SURE * joint.friction + 1e-12):
            return ExpectedRelease(joint, GRAVITY, middle, end, end)
    return None


def spring_task(joint: JointPhysics, pull: Pull, low: float, high: float) -> ExpectedRelease:
    """The task of a joint with a spring: let go of half way from its rest to the end that is further from it."""
    way = np.linspace(low, high, SAMPLES)
    force = exerted_effort(joint, way) + pull.at(way)
    rest = equilibrium_of(way, force)
    start = rest + START_SHARE * ((low if rest - low > high - rest else high) - rest)
    # Friction stops it short of the balance, on the side that it comes from, or as far beyond if it comes fast.
    drag = np.sign(rest - start) * joint.friction
    return ExpectedRelease(joint, SPRING, start, equilibrium_of(way, force - drag), equilibrium_of(way, force + drag))


def exerted_effort(joint: JointPhysics, way: np.ndarray) -> np.ndarray:
    """(n,) what the joint's spring and mechanism exert at these positions, N·m or N."""
    return np.array([joint.exerted(float(position)) for position in way])


def equilibrium_of(way: np.ndarray, force: np.ndarray) -> float:
    """Where a restoring force passes from positive to negative along ``way``, or the end to which it pushes."""
    crossing = np.flatnonzero((force[:-1] > 0.0) & (force[1:] <= 0.0))
    if len(crossing):
        index = int(crossing[0])
        share = force[index] / (force[index] - force[index + 1])
        return float(way[index] + share * (way[index + 1] - way[index]))
    return float(way[-1] if force.sum() > 0.0 else way[0])


def released_together(
    world: World, item: Mechanism, tasks: Sequence[ExpectedRelease], settings: EngineSettings, limits: Thresholds
) -> dict[str, Release]:
    """Joint → its record, of independent joints let go of together; ends early once nothing moves any more."""
    world.place(item.start | {task.joint.name: task.start for task in tasks})
    order = {name: index for index, name in enumerate(world.joint_names)}
    indices = [order[task.joint.name] for task in tasks]
    since = np.full(len(tasks), np.nan)

    def note(time: float) -> bool:
        now = world.positions()[indices]
        left = [share_left(float(q), task.start, task.target, task.far) for q, task in zip(now, tasks, strict=True)]
        there = np.array(left) <= limits.release_share
        since[~there] = np.nan
        since[there & np.isnan(since)] = time
        return False

    watch(world, settings.release_s, settings, note)
    ends = world.positions()[indices]
    return {
        task.joint.name: Release(
            joint=task.joint.name,
            by=task.by,
            start=task.start,
            target=task.target,
            far=task.far,
            end=capped_reading(float(end)),
            seconds=None if np.isnan(time) else float(time),
        )
        for task, end, time in zip(tasks, ends, since, strict=True)
    }


def judge(seen: Interaction, joints: Mapping[str, JointPhysics], limits: Thresholds) -> list[CheckVerdict]:
    """One verdict a joint that was let go of."""
    return [release_verdict(item, joints[item.joint], seen.engine.value, limits) for item in seen.releases]


def release_verdict(item: Release, joint: JointPhysics, engine: str, limits: Thresholds) -> CheckVerdict:
    """A joint that is let go of must reach its rest, and stay there."""
    unit, left = joint.unit, item.left
    passed = item.seconds is not None and left <= limits.release_share
    done = f"is there after {item.seconds:.3g} s" if item.seconds is not None else "does not get there"
    reason = (
        f"joint '{item.joint}' let go of at {item.start:.4g} {unit} should be brought to {item.target:.4g} {unit} by "
        f"{item.by}: it {done} and ends at {item.end:.4g} {unit} in {engine}"
    )
    return CheckVerdict(FailureMode.RELEASE, item.joint, passed, left, limits.release_share, reason)


CHECK = DeclaredCheck(
    name="release",
    modes={
        FailureMode.RELEASE: Guide(
            "A lid, door or key that gravity or a spring should bring back does not come back, or does not stay",
            "the finding says where it sticks; shapes that rub are cut by `--collision repair`",
        )
    },
    done="lids that gravity closes, springs",
    holds="they come back, and stay",
    bounds=("release_share",),
    measure=measure,
    judge=judge,
    place=70,
    turn=80,
    along=(FailureMode.JAM,),
    planted=("friction that sticks",),
)
