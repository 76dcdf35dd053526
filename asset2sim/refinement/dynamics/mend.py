"""Mend failing checks: change the parameters that a check maps to, and keep only what measures better; supply terms by
rules where a check fails with those that the asset's file states."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

from asset2sim.checks.declared_check import Case, Remedy
from asset2sim.checks.verdict import deciding_reports, failures_of
from asset2sim.refinement.context import RefinementContext, info
from asset2sim.refinement.dynamics.remedies import has_remedies, remedies_for
from asset2sim.refinement.notes import changed_numbers
from schemas.base import Vector3
from schemas.features import Features
from schemas.finding import Finding, TraceStep
from schemas.interaction import EngineReport
from schemas.overlay import PhysicsOverlay
from schemas.settings import Settings
from schemas.verdict import Failure
from schemas.vocabulary import NOT_MEASURED, Engine, FailureMode, Source

SOURCED = ("damping", "friction", "stiffness")
TERMS = (*SOURCED, *(f"{term}_source" for term in SOURCED), "spring_reference", "armature", "bias",
         "holds", "initial_position", "position_source", "asked_position")  # fmt: skip
"""Fields of a joint that its file's dynamics decide: where it starts, too, since a spring brings it there."""


def with_supplied_terms(
    loop: RefinementContext, overlay: PhysicsOverlay, failed: Sequence[Failure]
) -> PhysicsOverlay | None:
    """The overlay with terms by rules where a file's are kept: of the joints that fail, or of all where
    no failure names one; None where none is kept."""
    names = {failure.subject for failure in failed} & {joint.name for joint in overlay.joints}
    kept = {
        joint.name
        for joint in overlay.joints
        if (not names or joint.name in names)
        and any(getattr(joint, f"{term}_source") is Source.AUTHORED for term in SOURCED)
    }
    if not overlay.authored or not kept:
        return None
    placed = {
        joint.name: joint.initial_position
        for joint in overlay.joints
        if joint.name not in kept or joint.position_source is Source.SEARCH
    }
    made = loop.validated_at(overlay, placed, keep_terms=False)
    ours = {joint.name: {name: getattr(joint, name) for name in TERMS} for joint in made.joints}
    joints = (joint.model_copy(update=ours[joint.name]) if joint.name in kept else joint for joint in overlay.joints)
    return overlay.model_copy(update={"joints": tuple(joints)})


MOVING_AMPLITUDE = 1e-4
"""Amplitude during the rest check from which a joint counts as moving untouched, rad or m."""
LEAST_GAIN = 0.05
"""Least improvement of a check that still fails for its step to be kept, as a share of its excess over the bound."""

Reports = tuple[EngineReport, ...]
Verify = Callable[[PhysicsOverlay, Sequence[Engine], FailureMode | None], Reports]
"""Writes the overlay and verifies the asset in these engines, with all checks or only the one for a failure mode."""


@dataclass(frozen=True)
class Mended:
    """Overlay that measured best, its reports, the trace, and findings for what changed."""

    overlay: PhysicsOverlay
    reports: Reports
    trace: tuple[TraceStep, ...]
    findings: tuple[Finding, ...]


@dataclass
class Try:
    """Inputs of mending one asset, and its state: what ``failed`` before the present target, the trace of all tries,
    and the overlay that is written."""

    features: Features
    settings: Settings
    verify: Verify
    failed: tuple[Failure, ...]
    written: PhysicsOverlay
    trace: list[TraceStep] = field(default_factory=list)

    def seen(self, overlay: PhysicsOverlay, engine: Engine, only: FailureMode | None) -> EngineReport:
        """One engine's report on an overlay that is written for it."""
        self.written = overlay
        (report,) = self.verify(overlay, [engine], only)
        return report


def mend_failures(
    features: Features, overlay: PhysicsOverlay, reports: Reports, settings: Settings, verify: Verify
) -> Mended:
    """Mend failing checks one after the other until none is left, no remedy helps, or the rounds are spent.

    What is kept passes the check and fails no other that passed before, in any engine; it is the one left written.
    Where a failure has no remedy in the dynamics (a jam, penetration, a dead engine), nothing is tried: the caller then
    tries other collision shapes.
    """
    findings: list[Finding] = []
    given_up: set[tuple[Engine, FailureMode, str]] = set()
    done = Try(features, settings, verify, all_failures(overlay, reports, settings), overlay)
    if any(not has_remedies(item.mode) for item in done.failed):
        return Mended(overlay, reports, (), ())
    while len(done.trace) < settings.search.mend_rounds:
        target = next((item for item in done.failed if item.key not in given_up and has_remedies(item.mode)), None)
        if target is None:
            break
        found = mended_target(done, target, overlay, reports)
        if found is None:
            given_up.add(target.key)
            continue
        why = f"{target.mode.value} failed in {target.engine.value} ({target.reason})"
        findings.extend(changed_numbers(overlay, found[0], why))
        overlay, reports = found
        done.failed = all_failures(overlay, reports, settings)
    if len(done.trace) >= max(settings.search.mend_rounds, 1) and done.failed:
        text = f"{len(done.trace)} changes were tried for what fails, and no more (search.mend_rounds)"
        findings.append(info(code="mend_rounds_spent", message=text, value=len(done.trace)))
    if done.written is not overlay:
        reports = verify(overlay, [report.engine for report in reports], None)
    return Mended(overlay, reports, tuple(done.trace), tuple(findings))


def mended_target(
    done: Try, target: Failure, overlay: PhysicsOverlay, reports: Reports
) -> tuple[PhysicsOverlay, Reports] | None:
    """The first overlay by the remedies for a failing check at which all checks pass that passed before, and that one
    too, with its reports; None where they are spent.

    The failing check runs alone, in the engines in which it fails. Where a remedy improves it but it fails still, there
    or for another joint or start, its remedies go on from that; all checks run, engine after engine, once it passes.
    """
    concerned = dict.fromkeys((target.engine, *(item.engine for item in done.failed if item.mode is target.mode)))
    for remedy, candidate in candidate_overlays(done.features, overlay, reports, target, done.settings):
        if len(done.trace) >= done.settings.search.mend_rounds:
            return None
        now, alone = failures_alone(done, candidate, target.mode, tuple(concerned))
        better = not breaks(done.failed, now) and improves(target, now)
        place = len(done.trace)
        done.trace.append(mend_step(target, remedy, reports, now, False))
        found = None
        left = next((item for item in now if item.mode is target.mode), None)
        if better and left is None:
            found = verified(done, candidate, reports, target.engine)
        elif better and left is not None:
            found = mended_target(done, left, candidate, kept_at_rest(reports, alone))
        if found is not None:
            done.trace[place] = mend_step(target, remedy, reports, now, True)
            return found
    return None


def failures_alone(
    done: Try, candidate: PhysicsOverlay, mode: FailureMode, engines: Sequence[Engine]
) -> tuple[tuple[Failure, ...], Reports]:
    """The failures of a candidate where only the check for a failure mode runs, and the reports: in these engines, one
    after the other until it fails."""
    only = mode if done.settings.engine.interact else None
    now: tuple[Failure, ...] = ()
    reports: Reports = ()
    for engine in engines:
        reports = (*reports, done.seen(candidate, engine, only))
        now = all_failures(candidate, reports, done.settings)
        if any(item.mode is mode for item in now):
            break
    return now, reports


def verified(
    done: Try, candidate: PhysicsOverlay, reports: Reports, first: Engine
) -> tuple[PhysicsOverlay, Reports] | None:
    """A candidate with the reports of all checks in every engine; None as soon as one fails that passed before."""
    for engine in sorted((report.engine for report in reports), key=lambda engine: engine is not first):
        reports = merged_reports(reports, (done.seen(candidate, engine, None),))
        seen = next(report for report in reports if report.engine is engine)
        if breaks(done.failed, all_failures(candidate, (seen,), done.settings)):
            return None
    return candidate, reports


def kept_at_rest(reports: Reports, alone: Reports) -> Reports:
    """The reports with those of one check alone in their place, which keep how the object lay at rest before."""
    rested = {report.engine: report.measurement for report in reports}
    return merged_reports(reports, [
        report.model_copy(update={"measurement": report.measurement or rested[report.engine]}) for report in alone
    ])  # fmt: skip


def all_failures(overlay: PhysicsOverlay, reports: Reports, settings: Settings) -> tuple[Failure, ...]:
    """Every failing check in every engine that decides."""
    decide = deciding_reports(reports, settings.engine)
    return tuple(failure for report in decide for failure in failures_of(report, overlay, settings.thresholds))


def candidate_overlays(
    features: Features, overlay: PhysicsOverlay, reports: Reports, target: Failure, settings: Settings
) -> Iterator[tuple[Remedy, PhysicsOverlay]]:
    """Overlays that may mend a failing check, least intrusive first."""
    case = Case(features, settings, concerned_joints(overlay, reports, target, settings), rest_turn(reports, target))
    for remedy in remedies_for(target.mode, target.limit, settings):
        changed = remedy.change(case, overlay)
        if changed is not None:
            yield remedy, changed


def rest_turn(reports: Reports, target: Failure) -> Vector3:
    """How the object turned until it rested in the engine of a failing check, rad."""
    seen = next(report for report in reports if report.engine is target.engine).interaction
    return (0.0, 0.0, 0.0) if seen is None or seen.stand is None else seen.stand.rest_turn_rad


def concerned_joints(overlay: PhysicsOverlay, reports: Reports, target: Failure, settings: Settings) -> tuple[str, ...]:
    """Joints that a failing check concerns: its own, those that slip after a reset, or those that move untouched; an
    empty tuple stands for all joints."""
    if any(joint.name == target.subject for joint in overlay.joints):
        return (target.subject,)
    report = next(report for report in reports if report.engine is target.engine)
    if target.mode is FailureMode.RESET and target.limit == settings.thresholds.reset_joint_share:
        resets = () if report.interaction is None else report.interaction.resets
        slipped = {item.joint for item in resets if item.joint_motion == target.value and item.joint is not None}
        if slipped:
            return tuple(sorted(slipped))
    if report.measurement is None:
        return ()
    return tuple(motion.name for motion in report.measurement.joints if motion.amplitude > MOVING_AMPLITUDE)


def improves(target: Failure, now: Sequence[Failure]) -> bool:
    """Whether the failing check passes now, or its value is closer to its bound."""
    if any(item.mode in NOT_MEASURED for item in now):
        return False
    same = next((item for item in now if item.key == target.key), None)
    if same is None:
        # If another check at rest fails in its place, that failure is new, and ``breaks`` finds it.
        return True
    if target.value is None or same.value is None or target.limit is None:
        return False
    return abs(same.value - target.limit) < (1.0 - LEAST_GAIN) * abs(target.value - target.limit)


def breaks(before: Sequence[Failure], after: Sequence[Failure]) -> bool:
    """Whether a check fails that passed before."""
    known = {failure.key for failure in before}
    return any(failure.key not in known for failure in after)


def merged_reports(reports: Reports, newer: Sequence[EngineReport]) -> Reports:
    """The reports with those of the same engine replaced."""
    replaced = {report.engine: report for report in newer}
    return tuple(replaced.get(report.engine, report) for report in reports)


def mend_step(target: Failure, remedy: Remedy, before: Reports, now: Sequence[Failure], kept: bool) -> TraceStep:
    """Trace step of one candidate. Φ is the value before: dynamics do not change it."""
    phi = next((report.measurement.penetration_m for report in before if report.measurement is not None), 0.0)
    test = f"{target.engine.value} {target.mode.value} {target.subject}".strip()
    after = next((item.value for item in now if item.key == target.key), None)
    return TraceStep(
        step=0, proposer="mend", phi_before_m=phi, phi_after_m=phi, moved={}, accepted=kept, evaluations=1,
        reason=f"{remedy.name}: {target.reason}", test=test, value_before=target.value, value_after=after,
    )  # fmt: skip
