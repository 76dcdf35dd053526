"""To the user's hook."""

from prefect import task
from prefect.cache_policies import NO_CACHE

from asset2sim.runs import alert as alerts
from asset2sim.runs.result import RunResult


@task(name="alert", cache_policy=NO_CACHE, persist_result=False)
def alert(result: RunResult, strict: bool) -> RunResult:
    """Run the hook; see ``asset2sim.runs.alert.alert``."""
    return alerts.alert(result, strict)
