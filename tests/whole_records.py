"""Refining assets on the cluster of their settings, with the records kept whole."""

from collections.abc import Sequence
from pathlib import Path

from asset2sim.runs.plan.plan import Plan
from asset2sim.runs.spread.refine_all import RunRecords, refine_and_keep
from schemas.asset import AssetRecord, AssetRef
from schemas.settings import Settings


def refine_all(
    refs: Sequence[AssetRef],
    out: Path,
    settings: Settings,
    pipeline: str,
    run_id: str | None = None,
    plan: Plan | None = None,
    url: str | None = None,
) -> RunRecords[AssetRecord]:
    """``refine_and_keep`` of the whole records."""
    return refine_and_keep(refs, out, settings, pipeline, lambda record: record, run_id, plan, url)
