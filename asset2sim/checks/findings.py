"""Findings on what engines reported: what they printed, checks that failed, what stops a joint, disagreements."""

from collections.abc import Sequence

from asset2sim.checks.verdict import disagreements, failures_of
from schemas.finding import Finding
from schemas.interaction import EngineReport
from schemas.overlay import PhysicsOverlay
from schemas.settings import Settings
from schemas.vocabulary import Severity, Stage


def report_findings(reports: Sequence[EngineReport], overlay: PhysicsOverlay, settings: Settings) -> list[Finding]:
    """Findings on what the engines printed, failed checks, what stops a joint, and where engines disagree."""
    limits = settings.thresholds
    findings: list[Finding] = []
    names = {joint.name for joint in overlay.joints}
    for report in reports:
        measured = report.measurement
        findings += [
            Finding(
                stage=Stage.MEASURE,
                severity=Severity.WARNING,
                code="engine_console",
                message=f"{report.engine.value} printed: {line}",
            )
            for line in (measured.console if measured is not None else ())
        ]
        findings += [
            Finding(
                stage=Stage.MEASURE,
                severity=Severity.ERROR,
                code=failure.mode.value,
                message=failure.reason,
                joint=failure.subject if failure.subject in names else None,
                value=failure.value,
                limit=failure.limit,
            )
            for failure in failures_of(report, overlay, limits)
        ]
    return findings + obstacles(reports, settings) + disagreements(reports, overlay, limits)


def obstacles(reports: Sequence[EngineReport], settings: Settings) -> list[Finding]:
    """A finding for every joint that overlaps stop before the end of its range, once for all engines."""
    share = settings.thresholds.sweep_free_share
    told: set[str] = set()
    findings: list[Finding] = []
    for report in reports:
        for sweep in report.interaction.sweeps if report.interaction is not None else ():
            if sweep.free_share >= share or sweep.joint in told or not sweep.obstacles:
                continue
            told.add(sweep.joint)
            worst = max(sweep.obstacles, key=lambda item: item.depth_m)
            findings.append(
                Finding(
                    stage=Stage.MEASURE,
                    severity=Severity.WARNING,
                    code="sweep_stopped",
                    message=f"joint '{sweep.joint}' moves freely over {sweep.free_share:.0%} of its range: at "
                    f"{worst.position:.3g} '{worst.link_a}' and '{worst.link_b}' overlap by {1e3 * worst.depth_m:.3g} "
                    f"mm ({'as authored' if worst.cause.value == 'authored' else 'their hulls do'})",
                    joint=sweep.joint,
                    value=sweep.free_share,
                    limit=share,
                )
            )
    return findings
