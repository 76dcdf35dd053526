"""What has to be done, and what an earlier run has done already."""

from prefect import task
from prefect.cache_policies import NO_CACHE

from asset2sim.checks.alignment.reference import Reference
from asset2sim.runs.plan.plan import Plan, make_plan
from asset2sim.runs.remote.output import Output, folders_there, send_plan
from schemas.asset import AssetRef
from schemas.settings import Settings


@task(name="plan", cache_policy=NO_CACHE, persist_result=False)
def plan(
    refs: list[AssetRef],
    references: dict[str, Reference],
    output: Output,
    settings: Settings,
    pipeline: str,
    run_id: str,
) -> Plan:
    """The run's plan; see ``asset2sim.runs.plan.plan.make_plan``."""
    there = folders_there(output, views=settings.views.write)
    made = make_plan(refs, references, output.folder, settings, pipeline, run_id, there)
    send_plan(output, made)
    return made
