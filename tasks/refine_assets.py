"""The work: one Prefect task that fans the assets out over Dask."""

from pathlib import Path

from prefect import task
from prefect.cache_policies import NO_CACHE

from asset2sim.fanout.refine import Refined, refine_all
from asset2sim.fanout.worker import PIPELINE
from schemas.asset import AssetRef
from schemas.settings import Settings


@task(name="refine-assets", cache_policy=NO_CACHE, persist_result=False)
def refine_assets(
    refs: list[AssetRef], out: Path, settings: Settings, pipeline: str = PIPELINE, run_id: str | None = None
) -> Refined:
    """A record per asset; see ``asset2sim.fanout.refine.refine_all``."""
    return refine_all(refs, out, settings, pipeline, run_id)
