"""A state that does not last: joints that must stay where they were put, and come to rest elsewhere untouched."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from asset2sim.checks.rest import measure
from asset2sim.engines.child import in_child
from asset2sim.models.refinement_prompt import Situation, Tried
from asset2sim.refinement.ask_model import Scene, next_pose
from asset2sim.refinement.state.bands import Pose
from schemas.finding import TraceStep
from schemas.interaction import EngineReport
from schemas.measurement import Measurement
from schemas.overlay import PhysicsOverlay
from schemas.settings import Settings
from schemas.vocabulary import Engine, Source

ENGINE = Engine.PYBULLET
"""Where states are refined, and so where it is seen whether one lasts."""


@dataclass(frozen=True)
class Restated:
    """A pose that a model proposed and that settles nearer to the requested state, if there is one; and every step."""

    pose: Pose | None
    steps: tuple[TraceStep, ...]


def fallen(overlay: PhysicsOverlay, measured: Measurement, settings: Settings) -> tuple[str, ...]:
    """The joints for which a state was asked, which must stay where they are put, and which came to rest further from
    it than the state's tolerance, and than such a joint may move at all.

    A part that swings freely is where it should be wherever it swings.
    """
    limits = settings.thresholds
    rest = {motion.name: motion.final_position for motion in measured.joints}
    names = []
    for joint in overlay.joints:
        if not joint.holds or joint.position_source is Source.RULE or joint.name not in rest:
            continue
        if joint.lower is None or joint.upper is None:
            continue
        away = abs(rest[joint.name] - joint.initial_position)
        seen = limits.hold_m if joint.type == "prismatic" else limits.hold_rad
        if away > max(seen, settings.search.state_tolerance * (joint.upper - joint.lower)):
            names.append(joint.name)
    return tuple(names)


def rest_of(reports: Sequence[EngineReport]) -> Measurement | None:
    """What was seen at rest in the engine in which states are refined, if it was."""
    return next((report.measurement for report in reports if report.engine is ENGINE), None)


def restate(scene: Scene, overlay: PhysicsOverlay, measured: Measurement, names: tuple[str, ...]) -> Restated:
    """Ask the model for a state that lasts, and try what it proposes: the first pose from which every joint comes to
    rest in the requested state, with Φ as low as wanted or no higher than it was.

    ``overlay`` is what is written in ``scene.urdf``; ``measured`` what became of it, untouched, and ``names`` the
    joints that did not stay.
    """
    settings, present = scene.settings, overlay.initial_positions
    allowed = max(settings.search.target_phi_m, measured.penetration_m)
    shown = {**present, **resting(measured, present)}
    steps: list[TraceStep] = []
    tried: list[Tried] = []
    for _ in range(settings.search.max_model_calls):
        situation = Situation(
            "fell",
            present,
            measured.penetration_m,
            measured.pairs,
            settled=resting(measured, names),
            tried=tuple(tried),
        )
        pose = next_pose(scene, situation, names, shown)
        if pose is None:
            break
        found = measured_at(scene.urdf, overlay, pose, settings)
        if found is None:
            steps.append(step(measured, measured, present, pose, False, "the engine does not get through it"))
            break
        gone = fallen(scene.overlay, found, settings)
        accepted = not gone and found.penetration_m <= allowed
        why = (
            "it comes to rest in the requested state" if accepted else f"Φ would be {1e3 * found.penetration_m:.3g} mm"
        )
        if gone:
            why = f"joint '{gone[0]}' does not stay in the requested state"
        steps.append(step(measured, found, present, pose, accepted, why))
        if accepted:
            return Restated(pose, tuple(steps))
        tried.append(Tried(pose, found.penetration_m, resting(found, names)))
    return Restated(None, tuple(steps))


def resting(measured: Measurement, names: Mapping[str, object] | Sequence[str]) -> Pose:
    """Where these joints came to rest, rad or m."""
    return {motion.name: motion.final_position for motion in measured.joints if motion.name in names}


def measured_at(urdf: Path, overlay: PhysicsOverlay, pose: Pose, settings: Settings) -> Measurement | None:
    """The paper's test from another pose, in a process of its own; None where the engine does not finish it."""
    own = settings.engine

    def rest() -> Measurement:
        return measure(ENGINE, urdf, pose, overlay.contact_friction, own)

    return in_child(ENGINE, rest, time_limit_s=own.time_limit_s).value


def step(before: Measurement, after: Measurement, present: Pose, pose: Pose, accepted: bool, reason: str) -> TraceStep:
    """A step of the trace; one that is refused moves nothing."""
    return TraceStep(
        step=0,
        proposer="model",
        phi_before_m=before.penetration_m,
        phi_after_m=after.penetration_m if accepted else before.penetration_m,
        moved={name: value for name, value in pose.items() if value != present[name]} if accepted else {},
        accepted=accepted,
        evaluations=1,
        reason=reason,
    )
