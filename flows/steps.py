"""The steps of a run as Prefect tasks: each only calls what ``asset2sim`` does for it."""

import threading
from collections.abc import Callable, Collection
from typing import ParamSpec, TypeVar, cast

from prefect import Task, task
from prefect.cache_policies import NO_CACHE
from prefect.utilities.annotations import quote

from asset2sim.catalog import mlflow_log
from asset2sim.catalog.changes import read_previous
from asset2sim.catalog.history import remove_old_history
from asset2sim.catalog.index import write_index
from asset2sim.catalog.mlflow_store import prepare_mlflow
from asset2sim.catalog.parts import Parts
from asset2sim.catalog.run import RunRow
from asset2sim.catalog.write import write_parts
from asset2sim.runs import result
from asset2sim.runs.check_request import check_request, with_yardsticks
from asset2sim.runs.plan.hand_changes import set_aside, set_aside_stored
from asset2sim.runs.plan.plan import Plan, make_plan, mark_published
from asset2sim.runs.put_together import put_together
from asset2sim.runs.remote.output import Output, send_plan, send_tables, stored_asset_ids
from asset2sim.runs.spread.refine_all import RunRecords, refine_and_keep
from flows.run_report import publish_report
from schemas.asset import AssetRecord, AssetRef, AssetSummary, FoundAssets
from schemas.location import Location
from schemas.settings import Settings

T = TypeVar("T")
Arguments = ParamSpec("Arguments")
opaque = cast(Callable[[T], T], quote)
"""Mark a task's argument as opaque; the task receives the value itself. Prefect walks through every argument, twice, in
search of results of other tasks: 50 ms a record (measured), which a dataset's records would cost at each task."""


def step(name: str) -> Callable[[Callable[Arguments, T]], Task[Arguments, T]]:
    """Decorator that makes a function a task, whose results Prefect neither caches nor keeps."""
    return task(name=name, cache_policy=NO_CACHE, persist_result=False)


find_yardsticks = step("find-yardsticks")(with_yardsticks)
find_previous = step("find-previous")(read_previous)
assemble = step("put-together")(put_together)
report = step("report")(publish_report)
alert = step("alert")(result.alert)
log_run = step("log-run")(mlflow_log.log_run)
remove_old = step("remove-old")(mlflow_log.remove_old_artifacts)


@step("discover")
def discover(
    data: Location,
    out: Location,
    settings: Settings,
    subset: str | None,
    asset_ids: tuple[str, ...],
    limit: int | None,
    found: FoundAssets | None,
) -> list[AssetRef]:
    """The assets to refine: those found by the caller's check, else by a check here."""
    return (found or check_request(data, out, settings, subset, asset_ids, limit)).refs


@step("plan")
def plan(refs: list[AssetRef], output: Output, settings: Settings, pipeline: str) -> Plan:
    """The assets that the run must do, sent to the workers where the output is a URL."""
    there = stored_asset_ids(output, views=settings.views.write)
    made = make_plan(refs, output.folder, settings, pipeline, there)
    send_plan(output, made)
    return made


@step("refine-assets")
def refine_assets(
    refs: list[AssetRef], plan: Plan, output: Output, run: RunRow, parts: Parts, pipeline: str
) -> RunRecords[AssetSummary]:
    """Every asset that the plan has to do, in short; their rows are in ``parts``."""

    def keep(record: AssetRecord) -> AssetSummary:
        before = plan.owned.get(record.ref.asset_id)
        if output.url is None:
            return parts.add(set_aside(output.folder, record, before))
        return parts.add(set_aside_stored(output.url, record, before))

    if plan.todo:
        # MLflow, which the run's last step needs, loads beside the work.
        threading.Thread(target=prepare_mlflow, args=(output.folder,)).start()
    return refine_and_keep(refs, output.folder, run.settings, pipeline, keep, run.run_id, plan, output.url)


@step("publish")
def publish(
    output: Output, run: RunRow, parts: Parts, refined: RunRecords[AssetSummary], present: Collection[str] | None
) -> str | None:
    """Write the run's rows to the Parquet tables, and the index of what can be loaded; ``present`` are all assets of
    the dataset, where that is known. Returns a line that says what was removed of the history, if anything was."""
    folder = output.folder
    write_parts(folder, run, parts, refined.records, refined.unchanged, present)
    days = run.settings.run.keep_days
    removed = remove_old_history(folder, run.started_at, days) if days is not None else None
    send_tables(output)
    write_index(folder, output.url)
    mark_published(folder, refined.records, stored_asset_ids(output, views=False))
    return removed
