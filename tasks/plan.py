"""What has to be done, and what an earlier run has done already."""

from pathlib import Path

from prefect import task
from prefect.cache_policies import NO_CACHE

from asset2sim.incremental.plan import Plan, make_plan
from asset2sim.metrics.reference import Reference
from schemas.asset import AssetRef
from schemas.settings import Settings


@task(name="plan", cache_policy=NO_CACHE, persist_result=False)
def plan(
    refs: list[AssetRef],
    references: dict[str, Reference],
    out: Path,
    settings: Settings,
    pipeline: str,
    run_id: str,
) -> Plan:
    """The run's plan; see ``asset2sim.incremental.plan.make_plan``."""
    return make_plan(refs, references, out, settings, pipeline, run_id)
