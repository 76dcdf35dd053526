"""The run's report: a file under OUT, and Prefect's page of the run."""

from collections.abc import Collection
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from uuid import UUID

from prefect import task
from prefect.artifacts import create_markdown_artifact
from prefect.cache_policies import NO_CACHE
from prefect.runtime import flow_run

from asset2sim.catalog.changes import Changes, Previous, find_changes, read_previous
from asset2sim.catalog.report import report_markdown
from asset2sim.catalog.report_file import write_report
from asset2sim.catalog.run import RunRow
from asset2sim.runs.spread.refine_all import Refined
from tasks.deployment import left_out

ARTIFACT = "report"
"""Key of the artifact: Prefect keeps the versions of one key together, a night each."""


@dataclass(frozen=True)
class Reported:
    """What the run changed, the file with its report, and what kept the report from where it should be."""

    changes: Changes
    path: Path | None
    warnings: tuple[str, ...]


def stopped_line(refined: Refined, chosen: int) -> str | None:
    """Why the run stopped, where it did, and how far it came."""
    if refined.stopped is None:
        return None
    seen = len(refined.records) + len(refined.unchanged)
    return f"{refined.stopped}: {chosen - seen} of {chosen} assets were not seen to"


def nights_left_out(since: datetime) -> str | None:
    """A sentence on the nights that were due since then and found this one at work; None where there were none."""
    try:
        deployment = flow_run.parent_deployment_id
        missed = left_out(UUID(str(deployment)), since) if deployment else 0
    except Exception as error:  # whatever a server can raise
        return f"Prefect does not say whether a night was left out: {str(error).splitlines()[0]}"
    if not missed:
        return None
    were = "1 night was" if missed == 1 else f"{missed} nights were"
    return f"{were} left out, since this run was at work when the time came"


@task(name="find-previous", cache_policy=NO_CACHE, persist_result=False)
def find_previous(out: Path, run: RunRow, present: Collection[str] | None = None) -> Previous:
    """What the catalog holds before the run is published; see ``asset2sim.catalog.changes.read_previous``."""
    return read_previous(out, run, present)


@task(name="report", cache_policy=NO_CACHE, persist_result=False)
def report(
    out: Path, run: RunRow, refined: Refined, previous: Previous, chosen: int, died: str | None = None
) -> Reported:
    """Write the report and attach it to the flow run. What cannot be kept is a warning: the tables hold all of it.

    ``chosen`` counts the assets that the run was to see to, and ``died`` says what became of the run before it, where
    that did not come to an end.
    """
    changes = find_changes(refined.records, previous)
    told = [problem for problem in (died, nights_left_out(run.started_at)) if problem]
    problems = [problem for problem in (stopped_line(refined, chosen), previous.problem, *told) if problem]
    text = report_markdown(run, refined.records, previous, changes, problems, refined.unchanged, str(out))
    warnings, path = told, None
    try:
        path = write_report(out, run, text)
    except (OSError, UnicodeError) as error:
        warnings.append(f"the report of run {run.run_id} is not in {out}: {error}")
    try:
        create_markdown_artifact(text, key=ARTIFACT, description=f"run {run.run_id}")
    except Exception as error:  # whatever a server can raise, and whatever way it goes away
        warnings.append(f"Prefect does not hold the report of run {run.run_id}: {str(error).splitlines()[0]}")
    return Reported(changes, path, tuple(warnings))
