"""Mend failing checks: change the parameters that a check maps to, and keep only what measures better."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from asset2sim.checks.remedy import Case, Remedy
from asset2sim.checks.verdict import deciding, failures_of
from asset2sim.refinement.dynamics.remedies import mendable, remedies_for
from asset2sim.refinement.notes import changes
from schemas.base import Vector3
from schemas.features import Features
from schemas.finding import Finding, TraceStep
from schemas.interaction import EngineReport
from schemas.overlay import PhysicsOverlay
from schemas.settings import Settings
from schemas.verdict import Failure
from schemas.vocabulary import NOT_MEASURED, Engine, FailureMode

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


def mend(features: Features, overlay: PhysicsOverlay, reports: Reports, settings: Settings, verify: Verify) -> Mended:
    """Mend failing checks one after the other until none is left, no remedy helps, or the rounds are spent.

    A step is kept only where the failing check improves and no passing check fails, in any engine. The overlay kept is
    the one left written. Where a failure has no remedy in the dynamics (a jam, penetration, a dead engine), nothing is
    tried: the caller then tries other collision shapes.
    """
    trace: list[TraceStep] = []
    findings: list[Finding] = []
    engines = [report.engine for report in reports]
    given_up: set[tuple[Engine, FailureMode, str]] = set()
    budget, written = settings.search.mend_rounds, overlay
    if any(not mendable(item.mode) for item in all_failures(overlay, reports, settings)):
        return Mended(overlay, reports, (), ())
    while budget > 0:
        failed = all_failures(overlay, reports, settings)
        target = next((item for item in failed if item.key not in given_up and mendable(item.mode)), None)
        if target is None:
            break
        kept = False
        for remedy, candidate in candidates(features, overlay, reports, target, settings):
            if budget <= 0:
                break
            budget -= 1
            seen, better = verify_candidate(target, failed, candidate, settings, verify)
            written = candidate
            if better:
                seen = verify_elsewhere(seen, failed, candidate, engines, settings, verify)
            found = merged(reports, seen)
            now = all_failures(candidate, found, settings)
            kept = better and not breaks(failed, now)
            trace.append(mend_step(target, remedy, reports, now, kept))
            if kept:
                why = f"{target.mode.value} failed in {target.engine.value} ({target.reason})"
                findings.extend(changes(overlay, candidate, why))
                overlay, reports = candidate, found
                break
        if not kept:
            given_up.add(target.key)
    if written is not overlay:
        reports = verify(overlay, engines, None)
    return Mended(overlay, reports, tuple(trace), tuple(findings))


def verify_candidate(
    target: Failure, failed: Sequence[Failure], candidate: PhysicsOverlay, settings: Settings, verify: Verify
) -> tuple[Reports, bool]:
    """The failing engine's report on a candidate, and whether the failing check improves.

    The failing check runs first and alone; the others, here and in other engines, run only if it improves and shows no
    failure (another start that fails, say) that is not among ``failed``.
    """
    seen: Reports = ()
    for only in (target.mode, None) if settings.engine.interact else (None,):
        seen = verify(candidate, [target.engine], only)
        now = failures_of(seen[0], candidate, settings.thresholds)
        if breaks(failed, now) or not improves(target, now):
            return seen, False
    return seen, True


def verify_elsewhere(
    seen: Reports,
    failed: Sequence[Failure],
    candidate: PhysicsOverlay,
    engines: Sequence[Engine],
    settings: Settings,
    verify: Verify,
) -> Reports:
    """The failing engine's report on a candidate and those of the other ``engines``, one after the other until a check
    fails that is not among ``failed``: the candidate is then refused, whatever the rest would say."""
    for engine in engines:
        if breaks(failed, all_failures(candidate, seen, settings)):
            break
        if engine is not seen[0].engine:
            seen = (*seen, *verify(candidate, [engine], None))
    return seen


def all_failures(overlay: PhysicsOverlay, reports: Reports, settings: Settings) -> tuple[Failure, ...]:
    """Every failing check in every engine that decides."""
    decide = deciding(reports, settings.engine)
    return tuple(failure for report in decide for failure in failures_of(report, overlay, settings.thresholds))


def candidates(
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


def merged(reports: Reports, newer: Sequence[EngineReport]) -> Reports:
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
