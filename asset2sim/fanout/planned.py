"""The assets that a plan has to do, refined, each record kept from the moment that it is there."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from asset2sim.fanout.refine import Refined, refine_all
from asset2sim.fanout.worker import PIPELINE
from asset2sim.incremental.plan import Plan
from schemas.asset import AssetRef
from schemas.settings import Settings


def refine_planned(
    refs: Sequence[AssetRef],
    plan: Plan,
    out: Path,
    settings: Settings,
    run_id: str,
    pipeline: str = PIPELINE,
    url: str | None = None,
) -> Refined:
    """The records of what the plan has to do and of what a killed run had finished, in the order of ``refs``, and what
    is unchanged; ``url`` as ``refine_all`` has it."""
    refined = refine_all(plan.todo, out, settings, pipeline, run_id, plan.hashes, url)
    order = {ref.asset_id: number for number, ref in enumerate(refs)}
    records = sorted((*refined.records, *plan.finished), key=lambda record: order[record.ref.asset_id])
    return replace(refined, records=tuple(records), unchanged=plan.unchanged)
