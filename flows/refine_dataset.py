"""Refine a dataset: discover, refine, publish, log, report."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from prefect import flow

from asset2sim.catalog.parts import open_parts
from asset2sim.catalog.run import finish_run, remove_run_marker, selection_of, start_run, write_run_marker
from asset2sim.catalog.stored_tables import check_catalog
from asset2sim.runs.plan.hand_changes import changes_text
from asset2sim.runs.remote.output import open_output, send_rest
from asset2sim.runs.request import bounded_by_memory
from asset2sim.runs.result import INTERRUPTED, RunResult
from asset2sim.storage.objects import working_folder
from flows import PIPELINE
from flows.steps import (
    assemble,
    discover,
    find_previous,
    find_yardsticks,
    log_run,
    opaque,
    plan,
    publish,
    refine_assets,
    remove_old,
    report,
)
from schemas.asset import FoundAssets
from schemas.errors import Asset2SimError, complain, is_disk_full
from schemas.location import Location
from schemas.settings import Settings


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
