"""Refine and verify one asset: convex pieces where they pass the checks, else plain hulls."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from pathlib import Path

from asset2sim.assets.extract import Extraction
from asset2sim.assets.folder import write_folder
from asset2sim.checks.verify import Known
from asset2sim.refinement.ask_model import Questions, Scene
from asset2sim.refinement.collision.shapes import collision_shapes
from asset2sim.refinement.dynamics.mend import all_failures
from asset2sim.refinement.dynamics.remedies import REMEDIES
from asset2sim.refinement.judge import Verified, verify_and_mend
from asset2sim.refinement.notes import moves
from asset2sim.refinement.rest_state import ask_lasting_state, fallen, rest_measurement
from asset2sim.refinement.state.bands import Pose, reaches
from asset2sim.refinement.state.in_engine import Refined, at_positions, refine_in_engine
from schemas.finding import Finding, TraceStep
from schemas.overlay import Overlay, PhysicsOverlay
from schemas.request import ModelAsk
from schemas.settings import Settings
from schemas.vocabulary import CollisionMode, FailureMode, Severity, Source, Stage

DECOMPOSED = "collision_decomposed"
"""Code of the finding for a link decomposed into convex pieces."""

GOOD_PHI_M = 5e-4
"""Φ above which plain hulls are tried, m: our goal for the paper's nine objects."""

Timed = Callable[[Stage], AbstractContextManager[None]]
"""Context manager that adds its wall time to a stage."""


@dataclass(frozen=True)
class Job:
    """Inputs to refine and verify one asset: ``path`` is the folder to write, ``cache`` the folder of convex pieces."""

    extraction: Extraction
    proposal: Overlay
    overlay: PhysicsOverlay
    source: Source
    path: Path
    cache: Path
    settings: Settings
    ask: ModelAsk
    timed: Timed
    known: Known = field(default_factory=dict)
    """Engine reports on the asset so far, for all shapes and states tried."""


@dataclass(frozen=True)
class RefinedFolder:
    """URDF of the refined folder, with the results of refinement and verification."""

    urdf: Path
    refined: Refined
    judged: Verified
    findings: tuple[Finding, ...]


def refine_and_verify(job: Job) -> RefinedFolder:
    """Write, refine, verify and mend one asset; the result lists all model calls of all attempts."""
    questions = Questions(job.ask, job.settings.search.max_model_calls)
    chosen, shaped = attempt_pieces_then_hulls(job, questions)
    shaped = lasting(chosen, shaped, questions)
    refined = replace(
        shaped.refined, calls=tuple(questions.calls), findings=(*shaped.refined.findings, *questions.findings)
    )
    return replace(shaped, refined=refined)


def attempt_pieces_then_hulls(job: Job, questions: Questions) -> tuple[Job, RefinedFolder]:
    """The attempt with convex pieces; that with plain hulls, and a finding, where hulls alone pass or have lower Φ.

    Pieces keep hollows open but can block parts that move between them; hulls fill hollows and block nothing. A model
    is asked only where neither passes without one.
    """
    shaped, wanted = attempt_without_model(job)
    cut = any(finding.code == DECOMPOSED for finding in shaped.findings)
    phi = largest_phi(shaped)
    if not cut or (shaped.judged.verdict.passed and phi <= GOOD_PHI_M):
        return job, attempt(job, questions) if wanted and questions.left > 0 else shaped
    plain = in_mode(job, CollisionMode.REPAIR)
    hulls, _ = attempt_without_model(plain, unmendable(shaped, job.settings))
    if hulls.judged.verdict.passed and not (shaped.judged.verdict.passed and phi <= largest_phi(hulls)):
        note = Finding(
            stage=Stage.MEASURE,
            severity=Severity.WARNING,
            code="collision_fallback",
            message="collision shapes are plain hulls, which fill hollows: with convex pieces "
            + (f"Φ is {1e3 * phi:.3g} mm" if shaped.judged.verdict.passed else shaped.judged.verdict.reason),
        )
        return plain, replace(hulls, findings=(*hulls.findings, note))
    return job, attempt(job, questions)


def unmendable(shaped: RefinedFolder, settings: Settings) -> tuple[FailureMode, ...]:
    """Failures that no change of dynamics can mend, such as a jam: other collision shapes must avoid them."""
    failed = all_failures(shaped.judged.overlay, shaped.judged.reports, settings)
    modes = dict.fromkeys(failure.mode for failure in failed if failure.mode not in REMEDIES)
    return tuple(mode for mode in modes if mode not in (FailureMode.ENGINE_CRASH, FailureMode.TIMEOUT))


def attempt_without_model(job: Job, doubts: tuple[FailureMode, ...] = ()) -> tuple[RefinedFolder, bool]:
    """An attempt without model calls, and whether one was wanted; ``doubts`` are failures to look for first."""
    nobody = Questions(job.ask, 0)
    return attempt(job, nobody, doubts), nobody.wanted


def lasting(job: Job, shaped: RefinedFolder, questions: Questions) -> RefinedFolder:
    """The attempt, or, where joints do not hold their initial positions, one from a model's state that lasts, if its
    verdict is no worse."""
    measured = rest_measurement(shaped.judged.reports)
    names = fallen(job.overlay, measured, job.settings) if measured is not None else ()
    if measured is None or not names:
        return shaped
    with job.timed(Stage.REFINE):
        reach = reaches(job.overlay, job.settings.search)
        scene = Scene(job.extraction.features, job.overlay, job.settings, shaped.urdf, reach, questions)
        found = ask_lasting_state(scene, shaped.judged.overlay, measured, names)
    if found.pose is None:
        return with_steps(shaped, found.steps)
    again = attempt(job_at_pose(job, found.pose), questions)
    rest = rest_measurement(again.judged.reports)
    lasts = rest is not None and not fallen(job.overlay, rest, job.settings)
    if lasts and again.judged.verdict.passed >= shaped.judged.verdict.passed:
        told = moves(
            job.overlay.initial_positions, moved_by(job, found.pose), "from there it stays as it was asked for"
        )
        return with_steps(replace(again, findings=(*shaped.findings, *told)), found.steps)
    before = replace(attempt(job, questions), findings=shaped.findings)
    return with_steps(before, tuple(refused(step) for step in found.steps))


def job_at_pose(job: Job, pose: Pose) -> Job:
    """The job with another requested state."""
    overlay = at_positions(
        job.extraction, job.proposal, job.overlay, pose, moved_by(job, pose), job.source, job.settings
    )
    return replace(job, overlay=overlay)


def moved_by(job: Job, pose: Pose) -> Pose:
    """Joints of a pose that differ from the requested state → position."""
    requested = job.overlay.initial_positions
    return {name: value for name, value in pose.items() if value != requested[name]}


def with_steps(shaped: RefinedFolder, steps: tuple[TraceStep, ...]) -> RefinedFolder:
    """The result with these steps appended to the trace."""
    return replace(shaped, refined=replace(shaped.refined, trace=(*shaped.refined.trace, *steps)))


def refused(step: TraceStep) -> TraceStep:
    """The step marked as refused: after all checks it was no better."""
    if not step.accepted:
        return step
    taken_back = {"accepted": False, "moved": {}, "phi_after_m": step.phi_before_m}
    return step.model_copy(update={**taken_back, "reason": "judged in full, it is no better"})


def largest_phi(shaped: RefinedFolder) -> float:
    """The largest Φ in any engine, m."""
    seen = (report.measurement for report in shaped.judged.reports)
    return max((found.penetration_m for found in seen if found is not None), default=0.0)


def in_mode(job: Job, mode: CollisionMode) -> Job:
    """The job with another collision mode."""
    collision = job.settings.collision.model_copy(update={"mode": mode})
    return replace(job, settings=job.settings.model_copy(update={"collision": collision}))


def attempt(job: Job, questions: Questions, doubts: tuple[FailureMode, ...] = ()) -> RefinedFolder:
    """One attempt: collision shapes, folder, state search, verification, mending."""
    with job.timed(Stage.APPLY):
        mode = job.settings.collision.mode
        hulls, told = collision_shapes(job.extraction, job.overlay.scale, job.settings.collision, job.cache)
        folder = write_folder(job.extraction, job.overlay, hulls, job.path, job.settings.physics, mode)
    with job.timed(Stage.REFINE):
        refined = refine_in_engine(
            job.extraction, job.proposal, job.overlay, job.source, hulls, folder, job.settings, questions
        )
    with job.timed(Stage.MEASURE):
        judged = verify_and_mend(job.extraction, refined.overlay, refined.folder, job.settings, job.known, doubts)
    return RefinedFolder(refined.folder.urdf, refined, judged, told)
