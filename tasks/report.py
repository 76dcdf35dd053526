"""Into Prefect's page of the run."""

from prefect import task
from prefect.artifacts import create_markdown_artifact
from prefect.cache_policies import NO_CACHE

from asset2sim.catalog.run import RunRow
from asset2sim.catalog.summary import summary_markdown
from asset2sim.fanout.refine import Refined


@task(name="report", cache_policy=NO_CACHE, persist_result=False)
def report(run: RunRow, refined: Refined) -> None:
    """Attach the summary table to the flow run."""
    text = summary_markdown(refined.records, run.settings.thresholds)
    create_markdown_artifact(text, key="summary", description=f"run {run.run_id}")
