"""The verdict on an engine's report: pure functions of the record, the overlay and the thresholds."""

from collections.abc import Sequence
from functools import partial

from asset2sim.checks.at_rest import measurement_verdict, oscillating_joints
from asset2sim.checks.declared_check import interaction_verdicts
from schemas.finding import Finding
from schemas.interaction import EngineReport
from schemas.overlay import PhysicsOverlay
from schemas.settings import EngineSettings, Settings, Thresholds
from schemas.verdict import CheckVerdict, Failure, Judged, Verdict
from schemas.vocabulary import FailureMode, Severity, Stage

warning = partial(Finding, stage=Stage.MEASURE, severity=Severity.WARNING)
error = partial(Finding, stage=Stage.MEASURE, severity=Severity.ERROR)


PASSED = Verdict(FailureMode.NONE, "interaction-ready")


def verdicts_of(report: EngineReport, overlay: PhysicsOverlay, limits: Thresholds) -> Judged:
    """The verdicts that are stored with an engine's report, or those on a report that has none yet."""
    if report.judged is not None:
        return report.judged
    checks = () if report.interaction is None else interaction_verdicts(report.interaction, overlay, limits)
    return Judged(checks, _failures(report, checks, overlay, limits))


def check_verdicts(report: EngineReport, overlay: PhysicsOverlay, limits: Thresholds) -> tuple[CheckVerdict, ...]:
    """The verdicts on the interaction checks of one engine."""
    return verdicts_of(report, overlay, limits).checks


def failures_of(report: EngineReport, overlay: PhysicsOverlay, limits: Thresholds) -> tuple[Failure, ...]:
    """All failures in one engine: the paper's checks first, then the interaction checks in their order."""
    return verdicts_of(report, overlay, limits).failures


def _failures(
    report: EngineReport, checks: Sequence[CheckVerdict], overlay: PhysicsOverlay, limits: Thresholds
) -> tuple[Failure, ...]:
    if report.problem is not None:
        return (Failure(report.engine, _mode_of_problem(report), "", report.problem, None, None),)
    failed: list[Failure] = []
    if report.measurement is not None:
        sliders = frozenset(joint.name for joint in overlay.all_joints if joint.type == "prismatic")
        verdict = measurement_verdict(report.measurement, sliders, limits)
        if not verdict.passed:
            subject = next(iter(oscillating_joints(report.measurement, sliders, limits)), "")
            subject = subject if verdict.mode is FailureMode.OSCILLATION else ""
            failed.append(Failure(report.engine, verdict.mode, subject, verdict.reason, verdict.value, verdict.limit))
    failed += [
        Failure(report.engine, test.test, test.subject, test.reason, test.value, test.limit)
        for test in checks
        if not test.passed
    ]
    return tuple(failed)


def _mode_of_problem(report: EngineReport) -> FailureMode:
    if report.timed_out:
        return FailureMode.TIMEOUT
    if report.starved:
        return FailureMode.OUT_OF_MEMORY
    return FailureMode.ENGINE_REFUSED if report.refused and not report.died else FailureMode.ENGINE_CRASH


def report_verdict(report: EngineReport, overlay: PhysicsOverlay, limits: Thresholds) -> Verdict:
    """The verdict on one engine's report: its first failure, or passed."""
    for failure in failures_of(report, overlay, limits):
        return Verdict(failure.mode, failure.reason, failure.value, failure.limit)
    return PASSED


def deciding_reports(reports: Sequence[EngineReport], settings: EngineSettings) -> tuple[EngineReport, ...]:
    """The reports of the engines whose verdicts decide."""
    return tuple(report for report in reports if settings.decide is None or report.engine in settings.decide)


def overall_verdict(reports: Sequence[EngineReport], overlay: PhysicsOverlay, settings: Settings) -> Verdict:
    """The verdict over the engines that decide: the first failure in the order of the reports, or passed. A document
    that an engine refuses goes before what another measured, which then measured what it had made up."""
    decide = deciding_reports(reports, settings.engine)
    verdicts = [report_verdict(report, overlay, settings.thresholds) for report in decide]
    failed = [verdict for verdict in verdicts if not verdict.passed]
    return next((verdict for verdict in failed if verdict.mode is FailureMode.ENGINE_REFUSED), [*failed, PASSED][0])


def disagreements(reports: Sequence[EngineReport], overlay: PhysicsOverlay, limits: Thresholds) -> list[Finding]:
    """A finding for every figure by which one engine passes an asset and another does not, with both numbers."""
    measured = [report.measurement for report in reports if report.measurement is not None]
    findings: list[Finding] = []
    for name, unit, limit in (
        ("penetration_m", "m", limits.penetration_m),
        ("drift_m", "m", limits.drift_m),
        ("drift_rad", "rad", limits.drift_rad),
        ("peak_speed_m_s", "m/s", limits.peak_speed_m_s),
    ):
        values = {seen.engine: float(getattr(seen, name)) for seen in measured}
        if not values or max(values.values()) <= limit or min(values.values()) > limit:
            continue
        said = ", ".join(f"{engine} {value:.3g} {unit}" for engine, value in values.items())
        what = name.rsplit("_", 1)[0]
        message = f"{what} passes in one engine and not in another (at most {limit:g} {unit}): {said}"
        findings.append(warning(code="engines_disagree", message=message, value=max(values.values()), limit=limit))
    return findings + _checks_disagree(reports, overlay, limits)


def _checks_disagree(reports: Sequence[EngineReport], overlay: PhysicsOverlay, limits: Thresholds) -> list[Finding]:
    """A finding for every interaction check that passes in one engine and fails in another."""
    by_test: dict[tuple[FailureMode, str], dict[str, CheckVerdict]] = {}
    for report in reports:
        for test in check_verdicts(report, overlay, limits):
            by_test.setdefault((test.test, test.subject), {})[report.engine.value] = test
    findings: list[Finding] = []
    for (mode, subject), seen in by_test.items():
        if len({test.passed for test in seen.values()}) < 2:
            continue
        numbers = ", ".join(
            f"{engine} {'no value' if test.value is None else format(test.value, '.3g')}"
            f" ({'passes' if test.passed else 'fails'})"
            for engine, test in seen.items()
        )
        message = f"{mode.value} test of {subject}: {numbers}"
        value, limit = next(test.value for test in seen.values() if not test.passed), next(iter(seen.values())).limit
        findings.append(warning(code="engines_disagree", message=message, value=value, limit=limit))
    return findings
