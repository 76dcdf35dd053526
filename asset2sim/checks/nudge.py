"""The nudge: a joint is set in motion and left alone; it must come to rest, and nothing may explode."""

from collections import Counter
from collections.abc import Mapping, Sequence

from asset2sim.checks.declared_check import DeclaredCheck
from asset2sim.checks.joint_groups import run_in_groups
from asset2sim.checks.mechanism import Mechanism, moved_inertia, poses_at, pull_on, span_of
from asset2sim.checks.rig import Rig
from asset2sim.checks.watch import capped_reading, watch
from asset2sim.engines.world import World
from schemas.interaction import Interaction, Nudge
from schemas.overlay import JointPhysics
from schemas.settings import EngineSettings, Thresholds
from schemas.verdict import CheckVerdict, Guide
from schemas.vocabulary import FailureMode

CROSSING_S = 0.25
"""Least time in which a nudged joint would cross its whole range, s: a key of 3 mm is not kicked at 0.2 m/s."""
DECAYS = 3.0
"""Least time that a nudged joint is given, in time constants of its own damping: e⁻³ is a twentieth."""


def measure(rig: Rig) -> dict[str, object]:
    """Every joint nudged."""
    return {"nudges": nudge_records(rig.held.sound(), rig.item, rig.settings, rig.limits)}


def nudge_records(world: World, item: Mechanism, settings: EngineSettings, limits: Thresholds) -> tuple[Nudge, ...]:
    """Nudge every joint from its initial position, the root held, independent joints together.

    Left alone for ``nudge_s``, longer (up to ``release_s``) where the joint's own damping takes longer by design, or
    gravity or a spring moves it anyway.
    """
    known = {joint.name: joint for joint in item.asked}
    poses = poses_at(item, item.start)
    given: dict[str, float] = {}
    for joint in item.asked:
        pull = float(pull_on(item, joint.name, item.start, poses).at(joint.initial_position))
        given[joint.name] = rest_limit_s(joint, moved_inertia(item, joint.name, poses), pull, settings)

    def run(names: Sequence[str]) -> dict[str, Nudge]:
        return nudged_together(world, item, [known[name] for name in names], given, settings)

    def good(record: Nudge) -> bool:
        slow = record.final_speed <= limits.nudge_remaining * abs(record.speed)
        return record.finite and slow and record.peak_speed_m_s <= limits.peak_speed_m_s

    found = run_in_groups(item, known, run, good)
    return tuple(found[name] for name in known if name in found)


def nudge_speed(joint: JointPhysics, settings: EngineSettings) -> float:
    """The speed that a nudge gives, rad/s or m/s: towards where the joint has more room."""
    lower, upper = span_of(joint)
    fastest = settings.nudge_m_s if joint.type == "prismatic" else settings.nudge_rad_s
    speed = min(fastest, (upper - lower) / CROSSING_S)
    return speed if upper - joint.initial_position >= joint.initial_position - lower else -speed


def rest_limit_s(joint: JointPhysics, inertia: float, pull: float, settings: EngineSettings) -> float:
    """Time in which a nudged joint must come to rest, s: longer for light damping, as a fan may coast for seconds, and
    for a part that gravity's ``pull`` (N·m or N) or its spring moves, which may swing first."""
    if joint.friction < abs(pull + joint.exerted(joint.initial_position)) or joint.damping <= 0.0:
        return settings.release_s
    return min(max(settings.nudge_s, DECAYS * inertia / joint.damping), settings.release_s)


def nudged_together(
    world: World, item: Mechanism, joints: Sequence[JointPhysics], given: dict[str, float], settings: EngineSettings
) -> dict[str, Nudge]:
    """Joint → its record, of joints nudged together; a link's peak counts for the joint that moves it. Those of a chain
    share the speed of one, so that its end goes no faster."""
    world.place(item.start)
    sharing = max(Counter(link for joint in joints for link in item.moved[joint.name]).values(), default=1)
    speeds = {joint.name: nudge_speed(joint, settings) / sharing for joint in joints}
    world.kick(speeds)
    seconds = max((given[joint.name] for joint in joints), default=0.0)
    seen = watch(world, seconds, settings)
    final = dict(zip(world.joint_names, seen.joint_finals, strict=True))
    peaks = dict(zip(world.link_names, seen.peaks.tolist(), strict=True))
    return {
        joint.name: Nudge(
            joint=joint.name,
            speed=speeds[joint.name],
            final_speed=capped_reading(float(final[joint.name])),
            peak_speed_m_s=capped_reading(max((peaks[link] for link in item.moved[joint.name]), default=0.0)),
            seconds=seen.seconds,
            finite=seen.finite,
        )
        for joint in joints
    }


def judge(seen: Interaction, joints: Mapping[str, JointPhysics], limits: Thresholds) -> list[CheckVerdict]:
    """One verdict a joint."""
    return [nudge_verdict(item, joints[item.joint], seen.engine.value, limits) for item in seen.nudges]


def nudge_verdict(item: Nudge, joint: JointPhysics, engine: str, limits: Thresholds) -> CheckVerdict:
    """A nudged joint must lose its speed, and nothing that it moves may explode."""
    unit = joint.unit
    nudged = f"joint '{item.joint}' nudged to {item.speed:.3g} {unit}/s in {engine}"
    if not item.finite or item.peak_speed_m_s > limits.peak_speed_m_s:
        reason = f"{nudged}: what it moves explodes, to {item.peak_speed_m_s:.3g} m/s"
        return CheckVerdict(FailureMode.NUDGE, item.joint, False, item.peak_speed_m_s, limits.peak_speed_m_s, reason)
    share = item.final_speed / abs(item.speed) if item.speed else 0.0
    reason = f"{nudged} moves at {item.final_speed:.3g} {unit}/s after {item.seconds:.3g} s"
    passed = share <= limits.nudge_remaining
    return CheckVerdict(FailureMode.NUDGE, item.joint, passed, share, limits.nudge_remaining, reason)


CHECK = DeclaredCheck(
    name="nudge",
    modes={
        FailureMode.NUDGE: Guide(
            "A joint that is set in motion speeds up or does not settle",
            "damping below what its inertia needs: the finding has both; give a settling time in the guidance",
        )
    },
    done="every joint set in motion",
    holds="it decays, nothing explodes",
    bounds=("nudge_remaining", "peak_speed_m_s"),
    measure=measure,
    judge=judge,
    place=40,
    turn=90,
    planted=("damping negative",),
)
