"""Rows of what was measured: per engine, per interaction check, per pair of overlapping links, and of alignment."""

import math
from dataclasses import asdict

from asset2sim.checks.at_rest import oscillating_joints
from asset2sim.checks.verdict import check_verdicts, report_verdict
from schemas.asset import AssetRecord
from schemas.interaction import EngineReport, Measurement, Stand
from schemas.settings import Thresholds
from schemas.table import Row


def fields_of(record: object | None, *same: str, **other: str) -> Row:
    """Columns that are fields of a record: of the ``same`` name, or column → field; null where there is no record."""
    fields = dict.fromkeys(same) | other
    return {column: None if record is None else getattr(record, name or column) for column, name in fields.items()}


def prismatic_joints(record: AssetRecord) -> frozenset[str]:
    """Names of the prismatic joints; empty for a record with neither overlay nor features."""
    joints = record.overlay.all_joints if record.overlay else record.features.joints if record.features else ()
    return frozenset(joint.name for joint in joints if joint.type == "prismatic")


def motion_columns(measured: Measurement | None, prismatic: frozenset[str], limits: Thresholds) -> Row:
    """Columns of the measurement in one engine. Drift and speed are null where the simulation became non-finite."""
    moved = measured if measured is not None and measured.finite else None
    return {
        "penetration_mm": 1000.0 * measured.penetration_m if measured else None,
        "oscillating_joints": len(oscillating_joints(measured, prismatic, limits)) if measured else None,
        **fields_of(measured, "finite", "timestep_s"),
        **fields_of(moved, "drift_m", "drift_rad", "peak_speed_m_s"),
    }


def stand_columns(stood: Stand | None) -> Row:
    """Columns of how the object stands where it is set down; null where it was not measured or not finite."""
    seen = stood if stood is not None and stood.finite else None
    moved = {"stand_tilt_rad": "tilt_rad", "stand_travel_m": "travel_m", "stand_speed_m_s": "peak_speed_m_s"}
    margin_deg = math.degrees(seen.margin_rad) if seen else None
    return fields_of(seen, "tip_energy_j", **moved) | {"tip_margin_deg": margin_deg}


def measurement_rows(key: Row, record: AssetRecord, limits: Thresholds) -> list[Row]:
    """Rows of ``measurements``; ``key`` holds the columns that every row of the asset begins with."""
    if record.overlay is None:
        return []
    rows = []
    for report in record.reports:
        verdict = report_verdict(report, record.overlay, limits)
        checks = check_verdicts(report, record.overlay, limits)
        row = key | fields_of(report, "engine", "engine_version", "problem", "seconds")
        row |= fields_of(verdict, "passed", "reason", failure_mode="mode")
        row |= {"tests": len(checks), "tests_failed": sum(not check.passed for check in checks)}
        row |= motion_columns(report.measurement, prismatic_joints(record), limits)
        rows.append(row | stand_columns(report.interaction.stand if report.interaction else None))
    return rows


def interaction_rows(key: Row, record: AssetRecord, limits: Thresholds) -> list[Row]:
    """Rows of ``interactions``: a row per verdict, and two per joint for the efforts that open and close it."""
    if record.overlay is None:
        return []
    rows: list[Row] = []
    for report in record.reports:
        own = key | {"engine": report.engine.value}
        for check in check_verdicts(report, record.overlay, limits):
            columns = asdict(check)
            rows.append(own | {"limit_value": columns.pop("limit")} | columns)
        rows += _effort_rows(own, report, prismatic_joints(record))
    return rows


def _effort_rows(key: Row, report: EngineReport, prismatic: frozenset[str]) -> list[Row]:
    """The least effort that moves each joint, towards open and towards closed."""
    rows: list[Row] = []
    for item in report.interaction.openings if report.interaction is not None else ():
        unit = "N" if item.joint in prismatic else "N·m"
        for way, effort in (("opening", item.opening), ("closing", item.closing)):
            said = "is at that end, or does not move" if effort is None else f"takes {effort:.3g} {unit}"
            reason = f"{way} joint '{item.joint}' {said}"
            own = {"test": way, "subject": item.joint, "passed": None, "value": effort, "limit_value": None}
            rows.append(key | own | {"reason": reason, "way": way})
    return rows


def overlap_rows(key: Row, record: AssetRecord) -> list[Row]:
    """Rows of ``link_overlaps``."""
    return [
        key
        | fields_of(item, "related", "cause")
        | fields_of(item.pair, "link_a", "link_b")
        | {"depth_mm": 1000.0 * item.pair.depth_m, "penetration_mm": 1000.0 * item.pair.penetration_m}
        for item in record.overlaps
    ]


def alignment_rows(key: Row, record: AssetRecord) -> list[Row]:
    """One row of ``alignment``, none for a record without it."""
    found = record.alignment
    if found is None:
        return []
    row = key | fields_of(found, "scale_deviation", "reference_states_scale", alignment="value")
    row |= fields_of(found.scale, scale_score="value", scale_reason="reason")
    row |= fields_of(found.state, state_score="value", state_reason="reason")
    row |= fields_of(found.judged, judged="value", judged_reason="reason")
    slider = found.joint_is_slider
    row |= {"joint_deviation_rad": None if slider else found.joint_deviation}
    return [row | {"joint_deviation_m": found.joint_deviation if slider else None}]


def expectation_rows(key: Row, record: AssetRecord) -> list[Row]:
    """Rows of ``expectations``: one for each thing that the dataset's expectations say of the asset."""
    own = {"met_at_start": "at_start", "met_at_rest": "at_rest"}
    return [
        key
        | fields_of(item, "start", "rest", "rest_engine", "reason", **own)
        | fields_of(item.expectation, "what", "unit", "why")
        | {"lows": [low for low, _ in item.expectation.ranges], "highs": [high for _, high in item.expectation.ranges]}
        for item in record.expected
    ]
