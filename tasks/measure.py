"""Measure: record numbers in every engine; the verdict is a pure function of them (paper, "Evaluation")."""

from dataclasses import dataclass
from pathlib import Path

from asset2sim.assets.extract import Extraction
from asset2sim.checks.deaths import fatal_parts
from asset2sim.checks.findings import overlap_pairs, report_findings
from asset2sim.checks.verdict import overall_verdict
from asset2sim.checks.verify import cause_for, engines_of, verify
from schemas.errors import AssetError
from schemas.interaction import EngineReport
from schemas.overlay import PhysicsOverlay
from schemas.verdict import Verdict
from tasks.progress import AssetJob, StageResult


@dataclass(frozen=True, kw_only=True)
class Measured(StageResult):
    """The verdict on an asset as it is written."""

    reports: tuple[EngineReport, ...]
    verdict: Verdict


def measure_written(
    job: AssetJob, extraction: Extraction, urdf: Path, overlay: PhysicsOverlay, reports: tuple[EngineReport, ...] | None
) -> Measured:
    """Reports, overlaps and verdict of a URDF; ``reports`` are refinement's own on exactly this URDF, if it ran."""
    cause = cause_for(extraction, overlay)
    if reports is None:
        reports = verify(engines_of(job.settings.engine), urdf, overlay, cause, job.settings)
    try:
        overlaps = overlap_pairs(urdf, overlay.initial_positions, cause, job.settings.engine)
    except AssetError:  # PyBullet refuses the file, which its report says
        overlaps = ()
    start = overlay.initial_positions
    dead = [report.engine for report in reports if report.died and not report.timed_out]
    fatal = [part for engine in dead for part in fatal_parts(engine, urdf, start, job.settings.engine)]
    return Measured(
        reports=reports,
        overlaps=overlaps,
        verdict=overall_verdict(reports, overlay, job.settings),
        findings=(*(part.finding for part in fatal), *report_findings(reports, overlay, job.settings)),
    )
