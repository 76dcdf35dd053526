"""Refine one asset (paper, "Refine"): lower Φ, verify, mend; convex pieces where they pass the checks, else hulls."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from asset2sim.assets.extract import Extraction
from asset2sim.assets.folder import Folder, write_folder, write_urdf
from asset2sim.assets.hulls import Hulls, obj_text, primitive_hulls
from asset2sim.checks.deaths import corners_of, fatal_parts
from asset2sim.checks.known_reports import KnownReports, verify_known
from asset2sim.checks.verdict import overall_verdict
from asset2sim.checks.verify import engines_of
from asset2sim.physics.support_polygon import LEANING_RAD
from asset2sim.refinement.ask_model import AskedSoFar
from asset2sim.refinement.collision.shapes import collision_shapes
from asset2sim.refinement.collision.wheels import ROUNDED
from asset2sim.refinement.context import Log, RefinementContext, warning
from asset2sim.refinement.dynamics.mend import Mended, all_failures, mend_failures, with_supplied_terms
from asset2sim.refinement.dynamics.remedies import has_remedies
from asset2sim.refinement.lower_penetration import RefinedState, at_positions, lower_penetration
from asset2sim.refinement.notes import changed_numbers, move_findings
from asset2sim.validation.lying import AS_AUTHORED_RAD
from schemas.finding import Finding, TraceStep
from schemas.interaction import EngineReport
from schemas.overlay import Overlay, PhysicsOverlay
from schemas.request import ModelAsk, ModelCall
from schemas.settings import Settings
from schemas.verdict import Verdict
from schemas.vocabulary import NOT_MEASURED, CollisionMode, Engine, FailureMode, Proposer, Source, Stage

FATAL = "fatal_shape_boxed"
"""Code of the finding for a collision shape of which an engine died."""
DECOMPOSED = "collision_decomposed"
"""Code of the finding for a link decomposed into convex pieces."""
RESHAPED = frozenset(("collision_cut", FATAL, ROUNDED))
"""Codes of findings for a link whose collision shapes were changed after they were made."""

PULLED_OVER = (FailureMode.STANDS, FailureMode.EFFORT, FailureMode.RESET)
"""Failures of what tips over with its parts open."""
OPENINGS = (0.85, 0.7, 0.55, 0.4)
"""Shares of how far parts are open in use at which an object is tried that tips over with them open."""
GOOD_PHI_M = 5e-4
"""Φ above which plain hulls are tried, m: our goal for the paper's nine objects."""


@dataclass(frozen=True)
class RefinementJob:
    """Inputs to refine one asset: ``path`` is the folder to write, ``cache`` the folder of convex pieces."""

    extraction: Extraction
    proposal: Overlay
    overlay: PhysicsOverlay
    source: Source
    path: Path
    cache: Path
    settings: Settings
    guidance: str | None = None
    """The user's words, for questions to a model."""
    known: KnownReports = field(default_factory=KnownReports)
    """Engine reports on the asset so far, for all shapes and states tried."""
    opened: tuple[str, ...] = ()
    """The joints that the user's words ask to be open, and not how far."""


@dataclass(frozen=True)
class ShapedFolder:
    """The folder as written with the overlay, its collision hulls, and a finding for each change of their shape."""

    folder: Folder
    hulls: Hulls
    findings: tuple[Finding, ...]


@dataclass(frozen=True)
class RefinedAttempt:
    """One attempt at an asset: shapes, state and dynamics, with their findings in ``notes``, and the verdict."""

    notes: tuple[Finding, ...]
    state: RefinedState
    mended: Mended
    verdict: Verdict


@dataclass(frozen=True)
class RefinementResult:
    """The overlay that stays written in the folder, each engine's report on it, and how refinement got there; of its
    wall time ``measure_s`` went to engines that verified."""

    overlay: PhysicsOverlay
    folder: Folder
    reports: tuple[EngineReport, ...]
    trace: tuple[TraceStep, ...]
    calls: tuple[ModelCall, ...]
    findings: tuple[Finding, ...]
    measure_s: float = 0.0


def shape_folder(job: RefinementJob) -> ShapedFolder:
    """Write the folder with the overlay and collision shapes of the settings' mode."""
    collision, physics = job.settings.collision, job.settings.physics
    hulls, told = collision_shapes(job.extraction, job.overlay.scale, collision, job.cache)
    cut_primitives = collision.cut_primitives and collision.mode is not CollisionMode.KEEP
    folder = write_folder(
        job.extraction, job.overlay, hulls, job.path, physics, collision.mode, cut_primitives=cut_primitives
    )
    return ShapedFolder(folder, hulls, told)


def refine(job: RefinementJob, shaped: ShapedFolder, ask: ModelAsk) -> RefinementResult:
    """Refine an asset written by ``shape_folder``; the result lists all model calls of all attempts."""
    search = job.settings.search
    questions = AskedSoFar(ask, search.max_iterations if by_model(job) else search.max_model_calls)
    chosen, best = with_cut_primitives(*attempt_pieces_then_hulls(job, shaped, questions), questions)
    best = opened_less(chosen, without_fatal_shapes(chosen, best), questions)
    told = (*best.notes, *best.state.findings, *questions.findings, *best.mended.findings)
    job.known.keep()
    return RefinementResult(
        with_shapes_by_rule(best.mended.overlay, told),
        best.state.folder,
        best.mended.reports,
        (*best.state.trace, *best.mended.trace),
        tuple(questions.calls),
        told,
        job.known.seconds,
    )


def with_shapes_by_rule(overlay: PhysicsOverlay, told: Sequence[Finding]) -> PhysicsOverlay:
    """The overlay in which the collision shapes that were changed, as these findings say, are no longer its file's."""
    changed = {finding.link for finding in told if finding.code in RESHAPED}
    update = {"shapes_source": Source.RULE}
    links = (link.model_copy(update=update) if link.name in changed else link for link in overlay.links)
    return overlay.model_copy(update={"links": tuple(links)})


def attempt_pieces_then_hulls(
    job: RefinementJob, shaped: ShapedFolder, questions: AskedSoFar
) -> tuple[RefinementJob, RefinedAttempt]:
    """The attempt with convex pieces; that with plain hulls, and a finding, where hulls alone pass or have lower Φ.

    Pieces keep hollows open but can block parts that move between them; hulls fill hollows and block nothing. A model
    is asked only where neither passes without one; without pieces there is no choice, and the first attempt may ask.
    Where the model proposes every step, all attempts ask, and one that is repeated gets the same answers.
    """
    if all(finding.code != DECOMPOSED for finding in shaped.findings):
        return job, attempt(job, shaped, questions)
    pieces, open_question = first_attempt(job, shaped, questions)
    phi = largest_phi(pieces)
    if pieces.verdict.passed and phi <= GOOD_PHI_M:
        return job, attempt_again(job, questions) if open_question and questions.left > 0 else pieces
    collision = job.settings.collision.model_copy(update={"mode": CollisionMode.REPAIR})
    plain = replace(job, settings=job.settings.model_copy(update={"collision": collision}))
    hulls, _ = first_attempt(plain, shape_folder(plain), questions, unmendable(pieces, job.settings))
    if hulls.verdict.passed and not (pieces.verdict.passed and phi <= largest_phi(hulls)):
        why = f"Φ is {1e3 * phi:.3g} mm" if pieces.verdict.passed else pieces.verdict.reason
        text = f"collision shapes are plain hulls, which fill hollows: with convex pieces {why}"
        note = warning(stage=Stage.MEASURE, code="collision_fallback", message=text)
        return plain, replace(hulls, notes=(*hulls.notes, note))
    return job, attempt_again(job, questions)


def with_cut_primitives(
    job: RefinementJob, tried: RefinedAttempt, questions: AskedSoFar
) -> tuple[RefinementJob, RefinedAttempt]:
    """The attempt, or, where it fails or starts elsewhere than asked though nothing but boxes and cylinders of the file
    may be in the way, one in which these are hulls, and cut, and which does neither."""
    collision = job.settings.collision
    drawn = not collision.cut_primitives and collision.mode is not CollisionMode.KEEP
    boxes = primitive_hulls(job.extraction, 1.0) if drawn and not is_as_asked(tried) else {}
    if not boxes:
        return job, tried
    collision = collision.model_copy(update={"cut_primitives": True})
    other = replace(job, settings=job.settings.model_copy(update={"collision": collision}))
    with TemporaryDirectory() as aside:
        shaped = shape_folder(replace(other, path=Path(aside)))
        state = lower_penetration(context_of(other, shaped.hulls), shaped.folder, AskedSoFar(questions.ask, 0))
    if not state.folder.cuts.keys() & boxes.keys():
        return job, tried
    again = attempt_again(other, questions)
    # Where it is no better the folder must be as it was; what engines said of it is known.
    return (other, again) if is_as_asked(again) else (job, replace(attempt_again(job, questions), notes=tried.notes))


def is_as_asked(tried: RefinedAttempt) -> bool:
    """Whether an attempt passes, with every joint where it is asked to start."""
    searched = [joint for joint in tried.mended.overlay.joints if joint.position_source is Source.SEARCH]
    return tried.verdict.passed and not searched


def unmendable(tried: RefinedAttempt, settings: Settings) -> tuple[FailureMode, ...]:
    """Failures that no change of dynamics can mend, such as a jam: other collision shapes must avoid them."""
    failed = all_failures(tried.mended.overlay, tried.mended.reports, settings)
    modes = dict.fromkeys(failure.mode for failure in failed if not has_remedies(failure.mode))
    return tuple(mode for mode in modes if mode not in NOT_MEASURED)


def opened_less(job: RefinementJob, tried: RefinedAttempt, questions: AskedSoFar) -> RefinedAttempt:
    """The attempt, or, where it tips over with its parts open and nobody says how far, one with all of them less open,
    as far as it stands, without leaning on them, and a hand can close them."""
    requested, joints = job.overlay.initial_positions, {joint.name: joint for joint in job.overlay.joints}
    opened = [name for name in job.opened if name in joints and joints[name].closed != requested[name]]
    leans = is_leaning(tried)
    if not opened or not (leans or tried.verdict.mode in PULLED_OVER):
        return tried
    for share in OPENINGS:
        closed = {name: joints[name].closed for name in opened}
        moved = {name: at + share * (requested[name] - at) for name, at in closed.items()}
        placed = at_positions(context_of(job, {}), {**requested, **moved}, moved)
        again = attempt_again(replace(job, overlay=asked_there(placed, moved)), questions)
        if again.verdict.passed and not is_leaning(again):
            said = "it leans on what is open" if leans else tried.verdict.reason
            why = f"as far as it stands: all the way open, {said}"
            return replace(again, notes=(*again.notes, *move_findings(requested, moved, why)))
    # The folder must be as it was; what engines said of it is known.
    return replace(attempt_again(job, questions), notes=tried.notes)


def is_leaning(tried: RefinedAttempt) -> bool:
    """Whether the object is written leaning, as it came to rest, and not lying."""
    return LEANING_RAD < math.hypot(*tried.mended.overlay.turned_rad) <= AS_AUTHORED_RAD


def asked_there(overlay: PhysicsOverlay, positions: Mapping[str, float]) -> PhysicsOverlay:
    """The overlay with these positions (rad or m) as what is asked of their joints."""
    update = {name: {"asked_position": at} for name, at in positions.items()}
    joints = (joint.model_copy(update=update.get(joint.name, {})) for joint in overlay.joints)
    return overlay.model_copy(update={"joints": tuple(joints)})


def without_fatal_shapes(job: RefinementJob, tried: RefinedAttempt) -> RefinedAttempt:
    """The attempt, or, where an engine died of collision shapes, one whose shapes are their boxes in their place."""
    folder, overlay, notes = tried.state.folder, tried.mended.overlay, tried.notes
    dead = next((report.engine for report in tried.mended.reports if report.died and not report.timed_out), None)
    if dead is None:
        return tried
    parts = fatal_parts(dead, folder.urdf, overlay.initial_positions, job.settings.engine)
    shapes = [part for part in parts if part.kind == "shape" and part.file in folder.collision.get(part.name, ())]
    if not shapes:
        return tried
    for part in shapes:
        text = obj_text(corners_of(part))
        assert text is not None, "a box with thickness has volume"
        (folder.path / part.file).write_text(text, encoding="ascii")
        message = f"link '{part.name}': {dead} dies of {part.file} ({part.facts}); it collides as its box"
        notes = (*notes, warning(code=FATAL, link=part.name, message=message))
    folder = replace(folder, boxed=tuple(part.file for part in shapes))
    tried = replace(tried, state=replace(tried.state, folder=folder))
    mended, verdict = verify_and_mend(job, overlay, folder, ())
    return replace(tried, notes=notes, mended=mended, verdict=verdict)


def largest_phi(tried: RefinedAttempt) -> float:
    """The largest Φ in any engine, m."""
    seen = (report.measurement for report in tried.mended.reports)
    return max((found.penetration_m for found in seen if found is not None), default=0.0)


def context_of(job: RefinementJob, hulls: Hulls) -> RefinementContext:
    """Context that the steps of one attempt share, with an empty log."""
    return RefinementContext(
        job.extraction, job.proposal, job.overlay, job.source, hulls, job.settings, Log(), job.guidance
    )


def by_model(job: RefinementJob) -> bool:
    """Whether a model proposes every step of the state."""
    return job.settings.search.proposer is Proposer.MODEL


def first_attempt(
    job: RefinementJob, shaped: ShapedFolder, questions: AskedSoFar, doubts: tuple[FailureMode, ...] = ()
) -> tuple[RefinedAttempt, bool]:
    """An attempt without model calls, unless a model proposes every step, and whether a question was left open;
    ``doubts`` are failures to look for first."""
    if by_model(job):
        return attempt(job, shaped, questions, doubts), False
    no_calls = AskedSoFar(questions.ask, 0)
    return attempt(job, shaped, no_calls, doubts), no_calls.wanted


def attempt_again(job: RefinementJob, questions: AskedSoFar) -> RefinedAttempt:
    """An attempt from the start: the folder is written anew."""
    return attempt(job, shape_folder(job), questions)


def attempt(
    job: RefinementJob, shaped: ShapedFolder, questions: AskedSoFar, doubts: tuple[FailureMode, ...] = ()
) -> RefinedAttempt:
    """One attempt on a written folder: state and hulls, then verification and mending."""
    state = lower_penetration(context_of(job, shaped.hulls), shaped.folder, questions)
    mended, verdict = verify_and_mend(job, state.overlay, state.folder, doubts)
    return RefinedAttempt(shaped.findings, state, mended, verdict)


def verify_and_mend(
    job: RefinementJob, overlay: PhysicsOverlay, folder: Folder, doubts: Sequence[FailureMode]
) -> tuple[Mended, Verdict]:
    """Verify the written asset in every engine and mend its dynamics where a check fails.

    The folder is left with the overlay that is returned. ``doubts`` are failures that no change of dynamics mends and
    that other shapes showed: where one is seen here too, no other check runs, and it is the verdict.
    """
    extraction, settings = job.extraction, job.settings
    engines = engines_of(settings.engine)

    def again(
        changed: PhysicsOverlay, wanted: Sequence[Engine], only: FailureMode | None = None
    ) -> tuple[EngineReport, ...]:
        write_urdf(extraction, changed, folder, settings.physics)
        return verify_known(job.known, wanted, folder, changed, extraction, settings, only)

    for doubt in doubts:
        reports = again(overlay, engines, doubt)
        verdict = overall_verdict(reports, overlay, settings)
        if verdict.mode is doubt:
            return Mended(overlay, reports, (), ()), verdict
    mended = mend_failures(extraction.features, overlay, again(overlay, engines), settings, again)
    verdict = overall_verdict(mended.reports, mended.overlay, settings)
    supplied = (
        None
        if verdict.passed
        else with_supplied_terms(context_of(job, {}), overlay, all_failures(overlay, mended.reports, settings))
    )
    if supplied is None:
        return mended, verdict
    other = mend_failures(extraction.features, supplied, again(supplied, engines), settings, again)
    passed = overall_verdict(other.reports, other.overlay, settings)
    if not passed.passed:
        again(mended.overlay, engines)
        return mended, verdict
    told = changed_numbers(overlay, supplied, f"as its file has it, {verdict.mode.value} fails ({verdict.reason})")
    return replace(other, findings=(*told, *other.findings)), passed
