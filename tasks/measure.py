"""Measure: record numbers in every engine; the verdict is a pure function of them (paper, "Evaluation")."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from asset2sim.assets.extract import Extraction
from asset2sim.assets.urdf.document import parsed_root
from asset2sim.checks.deaths import fatal_parts
from asset2sim.checks.rig import CauseOf
from asset2sim.checks.verdict import deciding_reports, disagreements, error, failures_of, overall_verdict, warning
from asset2sim.checks.verify import cause_for, engines_of, verify
from asset2sim.engines.contacts import by_pair
from asset2sim.engines.static_object import contact_points, static_object
from schemas.errors import AssetError
from schemas.finding import Finding
from schemas.interaction import EngineReport, OverlapPair
from schemas.overlay import PhysicsOverlay
from schemas.settings import EngineSettings, Settings
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


def overlap_pairs(
    urdf: Path, positions: Mapping[str, float], cause: CauseOf, settings: EngineSettings
) -> tuple[OverlapPair, ...]:
    """Every pair of links that overlaps at these joint positions (rad, m), the worst first, each with its cause.

    A link and its parent are left out where the joint between them is fixed: they are one body. Raises AssetError
    (engine_refused) where the engine whose hulls and contact points these are refuses the file.
    """
    with static_object(urdf, settings, parents=True) as item:
        pairs = by_pair(contact_points(item, positions))
    related = {}
    for joint in parsed_root(urdf).iterfind("joint"):
        ends = frozenset(str(end.get("link")) for end in (*joint.iterfind("parent"), *joint.iterfind("child")))
        related[ends] = joint.get("type") != "fixed"
    return tuple(
        OverlapPair(
            pair=pair,
            related=frozenset((pair.link_a, pair.link_b)) in related,
            cause=cause(pair.link_a, pair.link_b, positions),
        )
        for pair in pairs
        if related.get(frozenset((pair.link_a, pair.link_b)), True)
    )


def report_findings(reports: Sequence[EngineReport], overlay: PhysicsOverlay, settings: Settings) -> list[Finding]:
    """Findings on what the engines printed, failed checks, what stops a joint, and where engines disagree."""
    limits = settings.thresholds
    findings: list[Finding] = []
    names = {joint.name for joint in overlay.joints}
    decide = deciding_reports(reports, settings.engine)
    for report in reports:
        printed = report.measurement.console if report.measurement is not None else ()
        engine = report.engine.value
        findings += [warning(code="engine_console", message=f"{engine} printed: {line}") for line in printed]
        for fault in failures_of(report, overlay, limits):
            joint = fault.subject if fault.subject in names else None
            found = (error if report in decide else warning)(
                code=fault.mode.value, message=fault.reason, joint=joint, value=fault.value, limit=fault.limit
            )
            findings.append(found)
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
            how = {"authored": "as authored", "floor": "as it stands"}.get(worst.cause.value, "their hulls do")
            message = (
                f"joint '{sweep.joint}' moves freely over {sweep.free_share:.0%} of its range: at {worst.position:.3g} "
                f"'{worst.link_a}' and '{worst.link_b}' overlap by {1e3 * worst.depth_m:.3g} mm ({how})"
            )
            value = sweep.free_share
            findings.append(warning(code="sweep_stopped", message=message, joint=sweep.joint, value=value, limit=share))
    return findings
