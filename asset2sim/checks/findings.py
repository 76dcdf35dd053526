"""Findings on what engines reported: what they printed, checks that failed, what stops a joint, disagreements."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from asset2sim.assets.urdf.document import parsed_root
from asset2sim.checks.rig import CauseOf
from asset2sim.checks.verdict import deciding_reports, disagreements, error, failures_of, warning
from asset2sim.engines.contacts import by_pair
from asset2sim.engines.static_object import contact_points, static_object
from schemas.finding import Finding
from schemas.interaction import EngineReport, OverlapPair
from schemas.overlay import PhysicsOverlay
from schemas.settings import EngineSettings, Settings


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
