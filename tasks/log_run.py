"""Into MLflow."""

from pathlib import Path

from prefect import task
from prefect.cache_policies import NO_CACHE

from asset2sim.catalog import mlflow_log
from asset2sim.catalog.changes import Changes
from asset2sim.catalog.run import RunRow
from asset2sim.runs.spread.refine_all import Refined


@task(name="log-run", cache_policy=NO_CACHE, persist_result=False)
def log_run(out: Path, run: RunRow, refined: Refined, changes: Changes) -> str | None:
    """Log settings, figures and failures; returns a warning where MLflow could not take them."""
    return mlflow_log.log_run(out, run, refined.records, changes, refined.unchanged)
