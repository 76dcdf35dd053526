"""The flow over a dataset and its steps, Prefect tasks: discover, plan, refine, publish, log, report."""

import shutil
import threading
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import ParamSpec, TypeVar, cast

from prefect import Task, flow, task
from prefect.cache_policies import NO_CACHE
from prefect.utilities.annotations import quote

from asset2sim.catalog import mlflow_log
from asset2sim.catalog.changes import read_previous
from asset2sim.catalog.history import remove_old_history
from asset2sim.catalog.index import write_index
from asset2sim.catalog.mlflow_log import prepare_mlflow
from asset2sim.catalog.parts import Parts, open_parts
from asset2sim.catalog.run import RunRow, finish_run, remove_run_marker, selection_of, start_run, write_run_marker
from asset2sim.catalog.stored_tables import check_catalog
from asset2sim.catalog.write import write_parts
from asset2sim.runs import result
from asset2sim.runs.check_request import check_request, with_yardsticks
from asset2sim.runs.plan.hand_changes import changes_text, set_aside, set_aside_stored
from asset2sim.runs.plan.plan import Plan, make_plan, mark_published
from asset2sim.runs.put_together import put_together
from asset2sim.runs.remote.output import Output, open_output, send_plan, send_rest, send_tables, stored_asset_ids
from asset2sim.runs.request import bounded_by_memory
from asset2sim.runs.result import INTERRUPTED, RunResult
from asset2sim.runs.spread.refine_all import RunRecords, refine_and_keep
from asset2sim.storage.objects import working_folder
from flows import PIPELINE
from flows.run_report import publish_report
from schemas.asset import AssetRecord, AssetRef, AssetSummary, FoundAssets
from schemas.errors import Asset2SimError, complain, is_disk_full
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


class DiskFullError(Asset2SimError):
    """The output folder's disk is full; the message names it."""


@contextmanager
def raise_disk_full(out: Path) -> Iterator[None]:
    """Raise DiskFullError, which names the disk and what to do, where the block fails because a disk is full."""
    try:
        yield
    except Asset2SimError:
        raise
    except Exception as error:
        if not is_disk_full(error):
            raise
        raise DiskFullError(_message(out, error)) from error


def _message(out: Path, error: Exception) -> str:
    try:
        free = f", {shutil.disk_usage(out).free / 1e6:.0f} MB free"
    except OSError:
        free = ""
    return (
        f"the disk of {out} is full{free} ({error}); make room and run the same again: the tables hold the last "
        "complete run, and what has finished since is taken up as far as there was room to keep it"
    )


@flow(name="refine-dataset", persist_result=False)
def refine_dataset(
    data: Location,
    out: Location,
    settings: Settings | None = None,
    subset: str | None = None,
    asset_ids: tuple[str, ...] = (),
    limit: int | None = None,
    pipeline: str = PIPELINE,
    found: FoundAssets | None = None,
) -> RunResult:
    """Refine the chosen assets of ``data`` that changed into ``out``, folders or URLs, and publish the results; see
    ``RunResult``.

    ``found`` are the assets, where the caller has checked the request. An asset that fails is a row. Raises
    ``UsageError`` for a request that cannot be met, before anything is written.
    """
    data, place = data.absolute(), out.absolute()
    settings, fewer = bounded_by_memory(settings or Settings())
    if fewer is not None:
        complain(fewer)
    held = find_yardsticks(data, opaque(discover(data, place, settings, subset, asset_ids, limit, found)))
    refs = held.refs
    # Only a run over the whole dataset can tell which assets were removed from it.
    whole = subset is None and not asset_ids and limit is None
    present = frozenset(ref.asset_id for ref in refs) if whole else None
    with raise_disk_full(working_folder(place)), open_output(place) as output:
        folder = output.folder
        check_catalog(folder)
        started = start_run(settings, str(data), subset, selection_of(asset_ids, limit))
        died = write_run_marker(folder, started)
        todo = plan(opaque(refs), output, settings, pipeline)
        with open_parts(folder, started) as parts:
            refined = refine_assets(opaque(refs), opaque(todo), output, started, opaque(parts), pipeline)
            run = finish_run(started, "interrupted" if refined.stopped else "finished")
            previous = find_previous(folder, run, opaque(present))
            removed = [publish(output, run, opaque(parts), opaque(refined), opaque(present))]
            remove_run_marker(folder)
            seen = {record.ref.asset_id for record in refined.records}
            split = assemble(opaque(refs), opaque(seen), folder, settings) if settings.inputs.split else ()
            by_hand = changes_text(todo.by_hand, settings.run.redo)
            told = report(folder, run, opaque(refined), opaque(previous), len(refs), died, by_hand, output.url)
            # After Ctrl-C the run ends without MLflow, which alone takes seconds.
            warning, counted = None, (opaque(refined.records), opaque(told.changes), opaque(refined.unchanged))
            if refined.stopped != INTERRUPTED:
                warning = log_run(folder, run, *counted, opaque(parts), told.index)
                if settings.run.keep_days is not None:
                    removed.append(remove_old(folder, run, settings.run.keep_days))
        send_rest(output)
    warnings = (*told.warnings, *split, *((warning,) if warning else ()), *held.unknown(present))
    return RunResult(
        folder,
        run,
        refined.records,
        refined.stopped,
        warnings,
        refined.unchanged,
        told.index,
        told.changes,
        place,
        tuple(line for line in removed if line is not None),
    )
