"""Into the catalog."""

from collections.abc import Collection
from pathlib import Path

from prefect import task
from prefect.cache_policies import NO_CACHE

from asset2sim.catalog.run import RunRow
from asset2sim.catalog.store import write_run
from asset2sim.fanout.refine import Refined
from asset2sim.incremental.plan import settle


@task(name="publish", cache_policy=NO_CACHE, persist_result=False)
def publish(out: Path, run: RunRow, refined: Refined, present: Collection[str] | None = None) -> None:
    """Write the run's rows to the Parquet tables; see ``asset2sim.catalog.store.write_run``."""
    write_run(out, run, refined.records, refined.unchanged, present)
    settle(out, refined.records)
