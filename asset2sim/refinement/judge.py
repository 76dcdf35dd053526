"""Verify one refined asset in every engine, mend its dynamics where a check fails, and report all findings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from asset2sim.assets.authored_overlap import AuthoredShapes, overlap_cause
from asset2sim.assets.extract import Extraction
from asset2sim.assets.folder import Folder, write_urdf
from asset2sim.checks.overlaps import overlap_pairs
from asset2sim.checks.sweep import CauseOf
from asset2sim.checks.verdict import Verdict, disagreements, failures_of, overall_verdict
from asset2sim.checks.verify import Known, engines_of, verify, verify_cached
from asset2sim.physics.kinematics import link_to_root, tree_of
from asset2sim.refinement.collision.part_links import written_joints
from asset2sim.refinement.dynamics.mend import mend
from schemas.errors import AssetError
from schemas.finding import Finding, TraceStep
from schemas.interaction import EngineReport, OverlapPair
from schemas.overlay import PhysicsOverlay
from schemas.settings import Settings
from schemas.vocabulary import Engine, FailureMode, OverlapCause, Severity, Stage


@dataclass(frozen=True)
class Verified:
    """The overlay as it stays written, each engine's report on it, and the verdict over all of them."""

    overlay: PhysicsOverlay
    reports: tuple[EngineReport, ...]
    overlaps: tuple[OverlapPair, ...]
    verdict: Verdict
    trace: tuple[TraceStep, ...]
    findings: tuple[Finding, ...]


def verify_and_mend(
    extraction: Extraction,
    overlay: PhysicsOverlay,
    folder: Folder,
    settings: Settings,
    known: Known,
    doubts: Sequence[FailureMode] = (),
) -> Verified:
    """Verify the written asset in every engine and mend its dynamics where a check fails; ``known`` holds past reports.

    ``doubts`` are failures that no change of dynamics mends and that other shapes showed: where one is seen here too,
    no other check runs, and it is the verdict.
    """
    cause = cause_for(extraction, overlay)
    engines = engines_of(settings.engine)

    def again(
        changed: PhysicsOverlay, wanted: Sequence[Engine], only: FailureMode | None = None
    ) -> tuple[EngineReport, ...]:
        write_urdf(extraction, changed, folder, settings.physics)
        return verify_cached(known, wanted, folder, changed, cause, settings, only)

    for doubt in doubts:
        reports = again(overlay, engines, doubt)
        verdict = overall_verdict(reports, overlay, settings.thresholds)
        if verdict.mode is doubt:
            return Verified(overlay, reports, (), verdict, (), ())
    mended = mend(extraction.features, overlay, again(overlay, engines), settings, again)
    overlaps = overlap_pairs(folder.urdf, mended.overlay.initial_positions, cause, settings.engine)
    verdict = overall_verdict(mended.reports, mended.overlay, settings.thresholds)
    findings = [*mended.findings, *report_findings(mended.reports, mended.overlay, settings)]
    return Verified(mended.overlay, mended.reports, overlaps, verdict, mended.trace, tuple(findings))


def verify_as_written(extraction: Extraction, urdf: Path, overlay: PhysicsOverlay, settings: Settings) -> Verified:
    """Verify a URDF as it is in every engine; nothing is mended."""
    cause = cause_for(extraction, overlay)
    reports = verify(engines_of(settings.engine), urdf, overlay, cause, settings)
    verdict = overall_verdict(reports, overlay, settings.thresholds)
    try:
        overlaps = overlap_pairs(urdf, overlay.initial_positions, cause, settings.engine)
    except AssetError:  # PyBullet refuses the file, which its report says
        overlaps = ()
    return Verified(overlay, reports, overlaps, verdict, (), tuple(report_findings(reports, overlay, settings)))


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


def cause_for(extraction: Extraction, overlay: PhysicsOverlay) -> CauseOf:
    """Function that tells whether two links' authored meshes overlap at given joint positions, or only their hulls."""
    features, shapes = extraction.features, AuthoredShapes(extraction, overlay.scale)
    tree = tree_of(written_joints(features, overlay), overlay.scale)

    def cause(a: str, b: str, positions: Mapping[str, float]) -> OverlapCause:
        poses = link_to_root(tree, features.root, positions)
        return overlap_cause(shapes, a, b, np.linalg.inv(poses[b]) @ poses[a])

    return cause
