"""A job on a Dask worker: the asset refined, its record kept in the output folder, and a word that it is there."""

import contextlib
import logging
import uuid
from dataclasses import replace
from pathlib import Path

from asset2sim.catalog.storage.cache import working_folder
from asset2sim.catalog.storage.objects import StoreError
from asset2sim.fanout.again import with_first
from asset2sim.fanout.done import Done
from asset2sim.fanout.job import Job
from asset2sim.fanout.worker import PIPELINE, attempt_asset
from asset2sim.incremental.paid_calls import drop_calls, keeping_calls, paid_calls
from asset2sim.incremental.records import KeptRecord, read_record, write_record
from asset2sim.isolation.asset import first_log_file, log_file
from asset2sim.remote.records import send_record
from schemas.settings import Settings

logger = logging.getLogger(__name__)


def refine_on_worker(
    job: Job, out: Path | str, settings: Settings, pipeline: str = PIPELINE, run_id: str | None = None
) -> Done:
    """Refine one asset, whatever happens to it, and keep its record in ``out``, a folder or a URL; ``pipeline`` is a
    ``module:function`` name.

    ``run_id`` names the run whose budget the model calls count towards; None is a run of its own.
    """
    run_id = run_id or uuid.uuid4().hex
    folder = working_folder(out)
    before = read_record(folder, job.content_hash)
    if before is not None and (before.run_id, before.attempt) == (run_id, job.attempt):
        # Dask asks once more for what a worker had done whose answer was lost with it.
        return Done(job.ref.asset_id, before.record.status, before.died)
    _keep_first_log(folder, job)
    lost = paid_calls(folder, job.content_hash)
    keep = keeping_calls(folder, job.content_hash)
    attempt = attempt_asset(job.ref, out, settings, pipeline, run_id, keep, fresh=job.first is not None)
    record = with_first(attempt.record, job.first, attempt.died)
    record = record.model_copy(update={"content_hash": job.content_hash, "calls": (*lost, *record.calls)})
    done = Done(job.ref.asset_id, record.status, attempt.died)
    kept = KeptRecord(run_id=run_id, redo=settings.run.redo, record=record, attempt=job.attempt, died=attempt.died)
    try:
        write_record(folder, kept)
        send_record(out, job.content_hash)
        drop_calls(folder, job.content_hash)
    except (OSError, StoreError) as error:
        logger.warning("cannot keep what has finished in %s (%s)", out, error)
        return replace(done, record=record)
    return done


def _keep_first_log(out: Path, job: Job) -> None:
    """The log of a first attempt out of the second one's way, and one of an earlier run away."""
    log, first = log_file(out, job.ref.asset_id), first_log_file(out, job.ref.asset_id)
    with contextlib.suppress(OSError):
        if job.first is None:
            first.unlink(missing_ok=True)
        else:
            log.replace(first)
