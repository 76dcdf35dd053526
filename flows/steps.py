"""The steps of a run as Prefect tasks: each calls one function of ``asset2sim``, whose docstring says more."""

import threading
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import TypeVar, cast

from prefect import task
from prefect.cache_policies import NO_CACHE
from prefect.utilities.annotations import quote

from asset2sim.catalog import mlflow_log
from asset2sim.catalog.changes import Changes, Previous, read_previous
from asset2sim.catalog.mlflow_store import prepare_mlflow
from asset2sim.catalog.run import RunRow
from asset2sim.catalog.write import write_run
from asset2sim.checks.alignment.align import align_all
from asset2sim.checks.alignment.reference import FILE, Reference, read_references
from asset2sim.runs import alert as alerts
from asset2sim.runs.check_request import check_request
from asset2sim.runs.plan.plan import Plan, make_plan, settle
from asset2sim.runs.remote.fetch_asset import local_file
from asset2sim.runs.remote.output import Output, send_plan, send_tables, stored_asset_ids
from asset2sim.runs.result import RunResult
from asset2sim.runs.spread.refine_all import Refined, refine_planned
from flows.run_report import WrittenReport, publish_report
from schemas.asset import AssetRef
from schemas.location import Location, below
from schemas.settings import Settings

T = TypeVar("T")


def opaque(value: T) -> T:
    """Mark a task's argument as opaque; the task receives the value itself.

    Prefect walks through every argument, twice, in search of results of other tasks: 50 ms a record (measured), which
    a dataset's records would cost at each of a run's tasks.
    """
    return cast(T, quote(value))


@task(name="find-previous", cache_policy=NO_CACHE, persist_result=False)
def find_previous(out: Path, run: RunRow, present: Collection[str] | None = None) -> Previous:
    """What the catalog holds before the run is published; see ``asset2sim.catalog.changes.read_previous``."""
    return read_previous(out, run, present)


@task(name="report", cache_policy=NO_CACHE, persist_result=False)
def report(
    out: Path, run: RunRow, refined: Refined, previous: Previous, chosen: int, died: str | None = None
) -> WrittenReport:
    """The run's report, written and attached to the flow run; see ``flows.run_report.publish_report``."""
    return publish_report(out, run, refined, previous, chosen, died)


@task(name="alert", cache_policy=NO_CACHE, persist_result=False)
def alert(result: RunResult, strict: bool) -> RunResult:
    """Run the hook; see ``asset2sim.runs.alert.alert``."""
    return alerts.alert(result, strict)


@task(name="find-references", cache_policy=NO_CACHE, persist_result=False)
def find_references(data: Location) -> dict[str, Reference]:
    """The experts' choices, as far as the dataset has any."""
    return read_references(local_file(below(data, FILE)))


@task(name="align", cache_policy=NO_CACHE, persist_result=False)
def align(refined: Refined, references: dict[str, Reference]) -> Refined:
    """The records with their alignment; see ``asset2sim.checks.alignment.align.align_all``."""
    return replace(refined, records=align_all(refined.records, references))


@task(name="discover", cache_policy=NO_CACHE, persist_result=False)
def discover(
    data: Location,
    out: Location,
    settings: Settings,
    subset: str | None,
    asset_ids: tuple[str, ...],
    limit: int | None,
) -> list[AssetRef]:
    """The assets to refine; see ``asset2sim.runs.check_request.check_request``."""
    return check_request(data, out, settings, subset, asset_ids, limit)


@task(name="log-run", cache_policy=NO_CACHE, persist_result=False)
def log_run(out: Path, run: RunRow, refined: Refined, changes: Changes) -> str | None:
    """Log settings, figures and failures; returns a warning where MLflow could not take them."""
    return mlflow_log.log_run(out, run, refined.records, changes, refined.unchanged)


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
def publish(output: Output, run: RunRow, refined: Refined, present: Collection[str] | None = None) -> None:
    """Write the run's rows to the Parquet tables; see ``asset2sim.catalog.write.write_run``."""
    folder = output.folder
    # Behind a URL, history is compacted after the upload: a store cannot switch a month's files at once.
    write_run(folder, run, refined.records, refined.unchanged, present, compact=output.url is None)
    send_tables(output, run.started_at)
    settle(folder, refined.records)


@task(name="refine-assets", cache_policy=NO_CACHE, persist_result=False)
def refine_assets(
    refs: list[AssetRef], plan: Plan, output: Output, settings: Settings, run_id: str, pipeline: str
) -> Refined:
    """A record per asset that the plan has to do; see ``asset2sim.runs.spread.refine_all.refine_planned``."""
    if plan.todo:
        # MLflow, which the run's last step needs, loads beside the work.
        threading.Thread(target=prepare_mlflow, args=(output.folder,), daemon=True).start()
    return refine_planned(refs, plan, output.folder, settings, run_id, pipeline, output.url)
