"""Rows of each engine's measurements and interaction checks, and of overlapping links."""

from asset2sim.checks.verdict import check_verdicts, judge_report, oscillating_joints
from schemas.asset import AssetRecord
from schemas.interaction import EngineReport
from schemas.overlay import PhysicsOverlay
from schemas.settings import Thresholds

Row = dict[str, object]


def measurement_rows(key: Row, record: AssetRecord, limits: Thresholds) -> list[Row]:
    """Rows of ``measurements``; ``key`` holds the columns that every row of the asset begins with."""
    return [] if record.overlay is None else [_measured(key, r, record.overlay, limits) for r in record.reports]


def _measured(key: Row, report: EngineReport, overlay: PhysicsOverlay, limits: Thresholds) -> Row:
    seen = report.measurement
    moved = seen if seen is not None and seen.finite else None
    sliders = frozenset(joint.name for joint in overlay.joints if joint.type == "prismatic")
    verdict, tests = judge_report(report, overlay, limits), check_verdicts(report, overlay, limits)
    return key | {
        "engine": report.engine.value,
        "engine_version": report.engine_version,
        "passed": verdict.passed,
        "failure_mode": verdict.mode.value,
        "reason": verdict.reason,
        "penetration_mm": 1000.0 * seen.penetration_m if seen else None,
        "drift_m": moved.drift_m if moved else None,
        "drift_rad": moved.drift_rad if moved else None,
        "peak_speed_m_s": moved.peak_speed_m_s if moved else None,
        "oscillating_joints": len(oscillating_joints(seen, sliders, limits)) if seen else None,
        "finite": seen.finite if seen else None,
        "timestep_s": seen.timestep_s if seen else None,
        "tests": len(tests),
        "tests_failed": sum(not test.passed for test in tests),
        "problem": report.problem,
        "seconds": report.seconds,
    }


def interaction_rows(key: Row, record: AssetRecord, limits: Thresholds) -> list[Row]:
    """Rows of ``interactions``: a row per verdict, and two per joint for the efforts that open and close it."""
    if record.overlay is None:
        return []
    rows: list[Row] = []
    for report in record.reports:
        own = key | {"engine": report.engine.value}
        rows += [
            own
            | {
                "test": test.test.value,
                "subject": test.subject,
                "passed": test.passed,
                "value": test.value,
                "limit": test.limit,
                "reason": test.reason,
            }
            for test in check_verdicts(report, record.overlay, limits)
        ]
        rows += effort_rows(own, report, record.overlay)
    return rows


def effort_rows(key: Row, report: EngineReport, overlay: PhysicsOverlay) -> list[Row]:
    """The least effort that moves each joint, towards open and towards closed."""
    sliders = {joint.name for joint in overlay.joints if joint.type == "prismatic"}
    rows: list[Row] = []
    for item in report.interaction.openings if report.interaction is not None else ():
        unit = "N" if item.joint in sliders else "N·m"
        for test, effort in (("opening", item.opening), ("closing", item.closing)):
            said = "is at that end, or does not move" if effort is None else f"takes {effort:.3g} {unit}"
            rows.append(
                key
                | {
                    "test": test,
                    "subject": item.joint,
                    "passed": None,
                    "value": effort,
                    "limit": None,
                    "reason": f"{test} joint '{item.joint}' {said}",
                }
            )
    return rows


def overlap_rows(key: Row, record: AssetRecord) -> list[Row]:
    """Rows of ``overlaps``."""
    return [
        key
        | {
            "link_a": item.pair.link_a,
            "link_b": item.pair.link_b,
            "related": item.related,
            "cause": item.cause.value,
            "depth_mm": 1000.0 * item.pair.depth_m,
            "penetration_mm": 1000.0 * item.pair.penetration_m,
        }
        for item in record.overlaps
    ]


def alignment_rows(key: Row, record: AssetRecord) -> list[Row]:
    """One row of ``alignment``, none for a record without it; ``key`` holds the columns that every row starts with."""
    found = record.alignment
    if found is None:
        return []
    slider = found.joint_is_slider
    return [
        key
        | {
            "alignment": found.value,
            "scale_score": found.scale.value,
            "scale_reason": found.scale.reason,
            "state_score": found.state.value,
            "state_reason": found.state.reason,
            "judged": found.judged.value if found.judged is not None else None,
            "judged_reason": found.judged.reason if found.judged is not None else None,
            "scale_deviation": found.scale_deviation,
            "reference_states_scale": found.reference_states_scale,
            "joint_deviation_rad": None if slider else found.joint_deviation,
            "joint_deviation_m": found.joint_deviation if slider else None,
        }
    ]
