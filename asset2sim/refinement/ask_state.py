"""Ask a model for another state: nearer to the requested one, or one from which joints that must hold do hold."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from asset2sim.assets.folder import Folder
from asset2sim.checks.hold import hold_bound
from asset2sim.checks.rest import measure
from asset2sim.engines.child import in_child
from asset2sim.models.prompts import StateProblem, TriedProposal
from asset2sim.refinement.ask_model import QuestionContext, next_pose
from asset2sim.refinement.collision.part_links import CutAttempt, cut_attempt
from asset2sim.refinement.context import RefinementContext, trace_step
from asset2sim.refinement.locate_overlaps import locate_overlaps
from asset2sim.refinement.position_bands import Pose, distance, joints_outside_state, moved_joints
from schemas.finding import TraceStep
from schemas.interaction import EngineReport, Measurement
from schemas.overlay import PhysicsOverlay
from schemas.settings import Settings
from schemas.vocabulary import Engine, Source

ENGINE = Engine.PYBULLET
"""Engine in which states are refined and checked to last."""


@dataclass(frozen=True)
class LastingState:
    """Model's pose that comes to rest in the requested state, None if there is none, and the trace steps."""

    pose: Pose | None
    steps: tuple[TraceStep, ...]


def joints_not_holding(overlay: PhysicsOverlay, measured: Measurement, settings: Settings) -> tuple[str, ...]:
    """Joints that must hold a requested position and came to rest further from it than both the state's tolerance and
    the bound of the hold check; joints that may swing freely do not count."""
    rest = {motion.name: motion.final_position for motion in measured.joints}
    names = []
    for joint in overlay.joints:
        if not joint.holds or joint.position_source is Source.RULE or joint.name not in rest:
            continue
        if joint.lower is None or joint.upper is None:
            continue
        band = settings.search.state_tolerance * (joint.upper - joint.lower)
        if abs(rest[joint.name] - joint.initial_position) > max(hold_bound(joint, settings.thresholds), band):
            names.append(joint.name)
    return tuple(names)


def rest_measurement(reports: Sequence[EngineReport]) -> Measurement | None:
    """Measurement at rest in ``ENGINE``, None where it has none."""
    return next((report.measurement for report in reports if report.engine is ENGINE), None)


def ask_lasting_state(
    scene: QuestionContext, overlay: PhysicsOverlay, measured: Measurement, names: tuple[str, ...]
) -> LastingState:
    """First pose proposed by the model from which every joint comes to rest in the requested state, with Φ at most its
    target or no higher than before. ``overlay`` is the one written in ``scene.urdf``, ``measured`` its measurement at
    rest, and ``names`` the joints that did not hold."""
    settings, present, phi = scene.settings, overlay.initial_positions, measured.penetration_m
    allowed = max(settings.search.target_phi_m, phi)
    shown = {**present, **rest_positions(measured, present)}
    steps: list[TraceStep] = []
    tried: list[TriedProposal] = []
    for _ in range(settings.search.max_model_calls):
        rest = rest_positions(measured, names)
        situation = StateProblem("fell", present, phi, measured.pairs, settled=rest, tried=tuple(tried))
        pose = next_pose(scene, situation, names, shown)
        if pose is None:
            break
        found = measure_rest_from(scene.urdf, overlay, pose, settings)
        if found is None:
            steps.append(model_step(phi, phi, present, pose, False, "the engine does not get through it"))
            break
        gone = joints_not_holding(scene.overlay, found, settings)
        accepted = not gone and found.penetration_m <= allowed
        why = f"joint '{gone[0]}' does not stay in the requested state" if gone else would_be(found.penetration_m)
        why = "it comes to rest in the requested state" if accepted else why
        steps.append(model_step(phi, found.penetration_m, present, pose, accepted, why))
        if accepted:
            return LastingState(pose, tuple(steps))
        tried.append(TriedProposal(pose, found.penetration_m, rest_positions(found, names)))
    return LastingState(None, tuple(steps))


def rest_positions(measured: Measurement, names: Mapping[str, object] | Sequence[str]) -> Pose:
    """Rest positions of these joints, rad or m."""
    return {motion.name: motion.final_position for motion in measured.joints if motion.name in names}


def measure_rest_from(urdf: Path, overlay: PhysicsOverlay, pose: Pose, settings: Settings) -> Measurement | None:
    """Measurement at rest from another pose, in a child process; None where the engine crashes or times out."""
    rest = partial(measure, ENGINE, urdf, pose, overlay.contact_friction, settings.engine, held=overlay.support.fixed)
    return in_child(ENGINE, rest, time_limit_s=settings.engine.time_limit_s).value


def model_step(before_m: float, after_m: float, present: Pose, pose: Pose, accepted: bool, reason: str) -> TraceStep:
    """Trace step of a model's pose; a refused step moves no joint and leaves Φ (m) as it was."""
    moved = moved_joints(pose, present) if accepted else {}
    return trace_step("model", before_m, after_m if accepted else before_m, accepted, reason, moved)


def would_be(phi: float) -> str:
    """Reason to refuse a pose at which Φ (m) is too high."""
    return f"Φ would be {1e3 * phi:.3g} mm"


def nearer_to_request(
    scene: QuestionContext, loop: RefinementContext, folder: Folder, best: CutAttempt, desired_phi_m: float
) -> CutAttempt:
    """The attempt, or one at a model's pose that is nearer to the requested state, where Φ is at most its target or no
    higher than before. ``desired_phi_m`` is Φ (m) in the requested state."""
    search = loop.settings.search
    tried: list[TriedProposal] = []
    for _ in range(search.max_model_calls):
        focus = joints_outside_state(loop.overlay, best.positions, search)
        if not focus:
            break
        here, phi = best.positions, best.phi
        there = locate_overlaps(scene.features, scene.overlay, folder.urdf, here, loop.settings.engine)
        situation = StateProblem(
            "moved", here, phi, there.pairs, desired_phi_m=desired_phi_m, tried=tuple(tried), places=there.places
        )
        pose = next_pose(scene, situation, focus)
        if pose is None:
            break
        again = cut_attempt(loop, folder, pose)
        nearer = distance(pose, scene.reach) < (1.0 - search.least_gain) * distance(here, scene.reach)
        accepted = nearer and again.phi <= max(search.target_phi_m, phi)
        why = "nearer to the requested state" if accepted else "no nearer to the requested state"
        why = would_be(again.phi) if nearer and not accepted else why
        loop.log.step(model_step(phi, again.phi, here, pose, accepted, why))
        if accepted:
            best = again
            tried.clear()
        else:
            tried.append(TriedProposal(pose, again.phi))
    return best
