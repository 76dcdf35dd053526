"""Into the catalog."""

from collections.abc import Collection

from prefect import task
from prefect.cache_policies import NO_CACHE

from asset2sim.catalog.run import RunRow
from asset2sim.catalog.write import write_run
from asset2sim.runs.plan.plan import settle
from asset2sim.runs.remote.output import Output, send_tables
from asset2sim.runs.spread.refine_all import Refined


@task(name="publish", cache_policy=NO_CACHE, persist_result=False)
def publish(output: Output, run: RunRow, refined: Refined, present: Collection[str] | None = None) -> None:
    """Write the run's rows to the Parquet tables; see ``asset2sim.catalog.write.write_run``."""
    folder = output.folder
    # What is sent is compacted once the store has it: it cannot switch a month's files at once.
    write_run(folder, run, refined.records, refined.unchanged, present, compact=output.url is None)
    send_tables(output, run.started_at)
    settle(folder, refined.records)
