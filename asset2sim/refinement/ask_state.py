"""Ask a model for another state: nearer to the requested one, or one from which joints that must hold do hold."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from asset2sim.assets.folder import Folder
from asset2sim.checks.interaction_verdict import hold_bound
from asset2sim.checks.rest import measure
from asset2sim.engines.child import in_child
from asset2sim.engines.contacts import by_pair
from asset2sim.engines.pybullet_object import contacts_at
from asset2sim.models.refinement_prompt import RefusedProposal, StateProblem
from asset2sim.refinement.ask_model import Scene, next_pose
from asset2sim.refinement.bands import Pose, distance, joints_outside_state
from asset2sim.refinement.collision.part_links import CutAttempt, cut_attempt
from asset2sim.refinement.context import RefinementContext
from schemas.finding import TraceStep
from schemas.interaction import EngineReport
from schemas.measurement import Measurement
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
    the bound of the hold check.

    Joints that may swing freely do not count.
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
        seen = hold_bound(joint, limits)
        if away > max(seen, settings.search.state_tolerance * (joint.upper - joint.lower)):
            names.append(joint.name)
    return tuple(names)


def rest_measurement(reports: Sequence[EngineReport]) -> Measurement | None:
    """Measurement at rest in ``ENGINE``, None where it has none."""
    return next((report.measurement for report in reports if report.engine is ENGINE), None)


def ask_lasting_state(
    scene: Scene, overlay: PhysicsOverlay, measured: Measurement, names: tuple[str, ...]
) -> LastingState:
    """First pose proposed by the model from which every joint comes to rest in the requested state, with Φ at most its
    target or no higher than before.

    ``overlay`` is the one written in ``scene.urdf``, ``measured`` its measurement at rest, and ``names`` the joints
    that did not hold.
    """
    settings, present = scene.settings, overlay.initial_positions
    allowed = max(settings.search.target_phi_m, measured.penetration_m)
    shown = {**present, **resting(measured, present)}
    steps: list[TraceStep] = []
    tried: list[RefusedProposal] = []
    for _ in range(settings.search.max_model_calls):
        situation = StateProblem(
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
        found = measure_rest_from(scene.urdf, overlay, pose, settings)
        if found is None:
            steps.append(step(measured, measured, present, pose, False, "the engine does not get through it"))
            break
        gone = joints_not_holding(scene.overlay, found, settings)
        accepted = not gone and found.penetration_m <= allowed
        why = (
            "it comes to rest in the requested state" if accepted else f"Φ would be {1e3 * found.penetration_m:.3g} mm"
        )
        if gone:
            why = f"joint '{gone[0]}' does not stay in the requested state"
        steps.append(step(measured, found, present, pose, accepted, why))
        if accepted:
            return LastingState(pose, tuple(steps))
        tried.append(RefusedProposal(pose, found.penetration_m, resting(found, names)))
    return LastingState(None, tuple(steps))


def resting(measured: Measurement, names: Mapping[str, object] | Sequence[str]) -> Pose:
    """Rest positions of these joints, rad or m."""
    return {motion.name: motion.final_position for motion in measured.joints if motion.name in names}


def measure_rest_from(urdf: Path, overlay: PhysicsOverlay, pose: Pose, settings: Settings) -> Measurement | None:
    """Measurement at rest from another pose, in a child process; None where the engine crashes or times out."""
    own = settings.engine

    def rest() -> Measurement:
        return measure(ENGINE, urdf, pose, overlay.contact_friction, own)

    return in_child(ENGINE, rest, time_limit_s=own.time_limit_s).value


def step(before: Measurement, after: Measurement, present: Pose, pose: Pose, accepted: bool, reason: str) -> TraceStep:
    """Trace step of a model's pose; a refused step moves no joint."""
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


def nearer_to_request(
    scene: Scene, loop: RefinementContext, folder: Folder, best: CutAttempt, desired_phi_m: float
) -> CutAttempt:
    """The attempt, or one at a model's pose that is nearer to the requested state, where Φ is at most its target or no
    higher than before. ``desired_phi_m`` is Φ (m) in the requested state."""
    search = loop.settings.search
    tried: list[RefusedProposal] = []
    for _ in range(search.max_model_calls):
        focus = joints_outside_state(loop.overlay, best.positions, search)
        if not focus:
            break
        pairs = by_pair(contacts_at(folder.urdf, best.positions, loop.settings.engine))
        situation = StateProblem(
            "moved", best.positions, best.phi, pairs, desired_phi_m=desired_phi_m, tried=tuple(tried)
        )
        pose = next_pose(scene, situation, focus)
        if pose is None:
            break
        again = cut_attempt(loop, folder, pose)
        before, after = distance(best.positions, scene.reach), distance(pose, scene.reach)
        nearer = after < (1.0 - search.least_gain) * before
        accepted = nearer and again.phi <= max(search.target_phi_m, best.phi)
        loop.log.step(
            TraceStep(
                step=0,
                proposer="model",
                phi_before_m=best.phi,
                phi_after_m=again.phi if accepted else best.phi,
                moved={name: pose[name] for name in pose if pose[name] != best.positions[name]} if accepted else {},
                accepted=accepted,
                evaluations=1,
                reason="nearer to the requested state"
                if accepted
                else f"Φ would be {1e3 * again.phi:.3g} mm"
                if nearer
                else "no nearer to the requested state",
            )
        )
        if accepted:
            best = again
            tried.clear()
        else:
            tried.append(RefusedProposal(pose, again.phi))
    return best
