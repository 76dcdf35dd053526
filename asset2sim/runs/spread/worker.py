"""One asset on a Dask worker: a child process does the work, this process makes the model calls."""

import contextlib
import logging
from pathlib import Path

from distributed import get_worker

from asset2sim.runs.asking_attempt import attempt_asset
from asset2sim.runs.asset_attempt import first_log_file, log_file, with_first_attempt
from asset2sim.runs.plan.records import (
    KeptRecord,
    call_writer,
    delete_paid_calls,
    paid_calls,
    read_record,
    write_record,
)
from asset2sim.runs.remote.output import send_record
from asset2sim.runs.spread.job import Job, JobResult
from asset2sim.storage.objects import StoreError, working_folder
from schemas.settings import Settings

BEGUN = "asset2sim-begun"
"""Topic of Dask's events on which a worker tells that it begins an asset."""

logger = logging.getLogger(__name__)


def refine_on_worker(
    job: Job, out: Path | str, settings: Settings, pipeline: str, run_id: str, recordings: str = ""
) -> JobResult:
    """The record of one refined asset, also of a failure; ``pipeline`` is a ``module:function`` name. The model calls
    count towards the budget of the run ``run_id``. ``recordings`` is the folder from which those of recorded models
    count; empty: the working folder.

    The record travels as this value. Before it does, it is written to ``out``, a folder or a URL, here and by no other
    process: where the run is killed or loses its scheduler, what its workers still finish is there for the next.
    """
    folder = working_folder(out)
    before = read_record(folder, job.content_hash)
    if before is not None and (before.run_id, before.attempt) == (run_id, job.attempt):
        # Dask submits a finished job again if its reply was lost with the worker.
        return JobResult(before)
    _tell_begun(job.ref.asset_id)
    _keep_first_log(folder, job)
    lost = paid_calls(folder, job.content_hash)
    keep = call_writer(folder, job.content_hash)
    attempt = attempt_asset(job.ref, out, settings, pipeline, run_id, keep, job.first is not None, recordings)
    record = attempt.record if job.first is None else with_first_attempt(attempt.record, job.first, attempt.died)
    record = record.model_copy(update={"content_hash": job.content_hash, "calls": (*lost, *record.calls)})
    kept = KeptRecord(run_id=run_id, redo=settings.run.redo, record=record, attempt=job.attempt, died=attempt.died)
    try:
        write_record(folder, kept)
        send_record(out, job.content_hash)
        delete_paid_calls(folder, job.content_hash)
    except (OSError, StoreError) as error:
        logger.warning("cannot keep what has finished in %s (%s)", out, error)
        return JobResult(kept, written=False)
    return JobResult(kept)


def _tell_begun(asset_id: str) -> None:
    """Tell the run that this worker begins an asset; outside a worker this does nothing."""
    with contextlib.suppress(ValueError):
        get_worker().log_event(BEGUN, asset_id)


def _keep_first_log(out: Path, job: Job) -> None:
    """Rename the first attempt's log before a second one; before a first, delete what an earlier run left."""
    log, first = log_file(out, job.ref.asset_id), first_log_file(out, job.ref.asset_id)
    with contextlib.suppress(OSError):
        if job.first is None:
            first.unlink(missing_ok=True)
        else:
            log.replace(first)
