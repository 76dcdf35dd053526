"""An asset's record in short: what a run keeps in memory of it."""

import sys
from collections.abc import Iterable

from asset2sim.catalog.kept import kept_counts, totals
from asset2sim.catalog.rows_engines import prismatic_joints
from asset2sim.checks.at_rest import oscillating_joints
from asset2sim.checks.verdict import report_verdict
from schemas.asset import AssetRecord, AssetSummary, MotionSummary
from schemas.interaction import Measurement
from schemas.settings import Thresholds
from schemas.vocabulary import Stage


def summarize(record: AssetRecord, limits: Thresholds) -> AssetSummary:
    """The record in short, judged by these thresholds."""
    overlay, paid = record.overlay, [call for call in record.calls if not call.cached]
    verdicts = [report_verdict(report, overlay, limits) for report in record.reports] if overlay else []
    return AssetSummary(
        ref=record.ref,
        category=shared(record.category),
        method=record.method,
        model=shared(record.model),
        status=record.status,
        failure_mode=record.failure_mode,
        reason=shared(record.reason),
        content_hash=record.content_hash,
        seconds={shared(stage): seconds for stage, seconds in record.seconds.items()},
        total_seconds=total_seconds(record),
        call_costs_usd=tuple(call.cost_usd for call in paid),
        prompt_tokens=sum(call.prompt_tokens for call in paid),
        completion_tokens=sum(call.completion_tokens for call in paid),
        cached_calls=len(record.calls) - len(paid),
        scale=overlay.scale if overlay else None,
        mass_kg=overlay.mass_kg if overlay else None,
        measurement=_motion(record, record.measurement, limits) if record.measurement else None,
        alignment=record.alignment,
        expected=record.expected,
        engines=(sum(verdict.passed for verdict in verdicts), len(verdicts)) if verdicts else None,
        numbers=totals(kept_counts(overlay)) if overlay and overlay.authored else None,
    )


def summarize_all(records: Iterable[AssetRecord]) -> tuple[AssetSummary, ...]:
    """The records in short, in their order."""
    return tuple(summarize(record, Thresholds()) for record in records)


def shared(text: str) -> str:
    """The one copy of a text that thousands of assets have."""
    return sys.intern(str(text))


def total_seconds(record: AssetRecord) -> float:
    """Wall time of the asset, s: the stages added up, or ``total`` where the record states one."""
    stages = sum(record.seconds.get(stage.value, 0.0) for stage in Stage)
    return record.seconds.get("total", stages)


def _motion(record: AssetRecord, measured: Measurement, limits: Thresholds) -> MotionSummary:
    return MotionSummary(
        penetration_m=measured.penetration_m,
        drift_m=measured.drift_m,
        drift_rad=measured.drift_rad,
        finite=measured.finite,
        oscillating_joints=len(oscillating_joints(measured, prismatic_joints(record), limits)),
    )
