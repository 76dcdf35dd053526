"""The run's report: a file under OUT, and Prefect's page of the run."""

import threading
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import TypeVar, cast
from uuid import UUID

from prefect import task
from prefect.artifacts import create_markdown_artifact
from prefect.cache_policies import NO_CACHE
from prefect.runtime import flow_run
from prefect.utilities.annotations import quote

from asset2sim.catalog import mlflow_log
from asset2sim.catalog.changes import Changes, Previous, find_changes, read_previous
from asset2sim.catalog.mlflow_store import prepare_mlflow
from asset2sim.catalog.report import report_markdown
from asset2sim.catalog.report_file import write_report
from asset2sim.catalog.run import RunRow
from asset2sim.catalog.write import write_run
from asset2sim.checks.alignment.align import align_all
from asset2sim.checks.alignment.reference import FILE, Reference, read_references
from asset2sim.runs import alert as alerts
from asset2sim.runs.check_request import check_request
from asset2sim.runs.plan.plan import Plan, make_plan, mark_published
from asset2sim.runs.remote.fetch_asset import local_file
from asset2sim.runs.remote.output import Output, send_plan, send_tables, stored_asset_ids
from asset2sim.runs.result import RunResult
from asset2sim.runs.spread.refine_all import RunRecords, refine_all
from flows.server.deployment import left_out
from schemas.asset import AssetRef, FoundAssets
from schemas.location import Location, below
from schemas.settings import Settings

ARTIFACT = "report"
"""Key of the artifact: Prefect keeps the versions of one key together, a night each."""


@dataclass(frozen=True)
class WrittenReport:
    """What the run changed, the file with its report, and warnings where the report could not be written."""

    changes: Changes
    path: Path | None
    warnings: tuple[str, ...]


def stopped_line(refined: RunRecords, chosen: int) -> str | None:
    """Why the run stopped, where it did, and how far it came."""
    if refined.stopped is None:
        return None
    seen = len(refined.records) + len(refined.unchanged)
    return f"{refined.stopped}: {chosen - seen} of {chosen} assets were not seen to"


def skipped_nights(since: datetime) -> str | None:
    """A sentence on the nights skipped after ``since`` because this run was at work; None where there were none."""
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
    out: Path, run: RunRow, refined: RunRecords, previous: Previous, chosen: int, died: str | None = None
) -> WrittenReport:
    """Write the report and attach it to the flow run. A failure is a warning only: the tables hold the same data.

    ``chosen`` is the number of assets of the run; ``died`` says what happened to the run before it, if that did not
    end.
    """
    changes = find_changes(refined.records, previous)
    told = [problem for problem in (died, skipped_nights(run.started_at)) if problem]
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
    return WrittenReport(changes, path, tuple(warnings))


@task(name="alert", cache_policy=NO_CACHE, persist_result=False)
def alert(result: RunResult, strict: bool) -> RunResult:
    """Run the hook; see ``asset2sim.runs.alert.alert``."""
    return alerts.alert(result, strict)


@task(name="find-references", cache_policy=NO_CACHE, persist_result=False)
def find_references(data: Location) -> dict[str, Reference]:
    """The experts' choices, as far as the dataset has any."""
    return read_references(local_file(below(data, FILE)))


@task(name="align", cache_policy=NO_CACHE, persist_result=False)
def align(refined: RunRecords, references: dict[str, Reference]) -> RunRecords:
    """The records with their alignment; see ``asset2sim.checks.alignment.align.align``."""
    return replace(refined, records=align_all(refined.records, references))


@task(name="discover", cache_policy=NO_CACHE, persist_result=False)
def discover(
    data: Location,
    out: Location,
    settings: Settings,
    subset: str | None,
    asset_ids: tuple[str, ...],
    limit: int | None,
    found: FoundAssets | None,
) -> list[AssetRef]:
    """The assets to refine: those found by the caller's check, else see ``asset2sim.runs.check_request``."""
    return (found or check_request(data, out, settings, subset, asset_ids, limit)).refs


@task(name="log-run", cache_policy=NO_CACHE, persist_result=False)
def log_run(out: Path, run: RunRow, refined: RunRecords, changes: Changes) -> str | None:
    """Log settings, figures and failures; returns a warning where MLflow could not take them."""
    return mlflow_log.log_run(out, run, refined.records, changes, refined.unchanged)


T = TypeVar("T")
opaque = cast(Callable[[T], T], quote)
"""Mark a task's argument as opaque; the task receives the value itself. Prefect walks through every argument, twice, in
search of results of other tasks: 50 ms a record (measured), which a dataset's records would cost at each task."""


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
    there = stored_asset_ids(output, views=settings.views.write)
    made = make_plan(refs, references, output.folder, settings, pipeline, run_id, there)
    send_plan(output, made)
    return made


@task(name="publish", cache_policy=NO_CACHE, persist_result=False)
def publish(output: Output, run: RunRow, refined: RunRecords, present: Collection[str] | None = None) -> None:
    """Write the run's rows to the Parquet tables; see ``asset2sim.catalog.write.write_run``."""
    folder = output.folder
    # Behind a URL, history is compacted after the upload: a store cannot switch a month's files at once.
    write_run(folder, run, refined.records, refined.unchanged, present, compact=output.url is None)
    send_tables(output, run.started_at)
    mark_published(folder, refined.records)


@task(name="refine-assets", cache_policy=NO_CACHE, persist_result=False)
def refine_assets(
    refs: list[AssetRef], plan: Plan, output: Output, settings: Settings, run_id: str, pipeline: str
) -> RunRecords:
    """A record per asset that the plan has to do; see ``asset2sim.runs.spread.refine_all``."""
    if plan.todo:
        # MLflow, which the run's last step needs, loads beside the work.
        threading.Thread(target=prepare_mlflow, args=(output.folder,), daemon=True).start()
    return refine_all(refs, output.folder, settings, pipeline, run_id, plan, output.url)
