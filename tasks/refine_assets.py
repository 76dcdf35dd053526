"""The work: one Prefect task that fans the assets out over Dask."""

import threading

from prefect import task
from prefect.cache_policies import NO_CACHE

from asset2sim.catalog.mlflow_store import prepare_mlflow
from asset2sim.runs.plan.plan import Plan
from asset2sim.runs.remote.output import Output
from asset2sim.runs.spread.refine_all import Refined, refine_planned
from asset2sim.runs.spread.worker import PIPELINE
from schemas.asset import AssetRef
from schemas.settings import Settings


@task(name="refine-assets", cache_policy=NO_CACHE, persist_result=False)
def refine_assets(
    refs: list[AssetRef], plan: Plan, output: Output, settings: Settings, run_id: str, pipeline: str = PIPELINE
) -> Refined:
    """A record per asset that the plan has to do; see ``asset2sim.runs.spread.refine_all.refine_planned``."""
    if plan.todo:
        # MLflow, which the run's last step needs, loads beside the work.
        threading.Thread(target=prepare_mlflow, args=(output.folder,), daemon=True).start()
    return refine_planned(refs, plan, output.folder, settings, run_id, pipeline, output.url)
