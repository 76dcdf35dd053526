"""One asset on a Dask worker: a child process does the work, this process makes the model calls."""

import contextlib
import logging
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

from distributed import get_worker

from asset2sim.experiments.isolation.stopping import is_stopped
from asset2sim.models.gateway.ask import ask
from asset2sim.models.gateway.session import GatewaySession, open_gateway_session
from asset2sim.runs.asset_attempt import AssetAttempt, attempt_in_child, first_log_file, log_file, with_first_attempt
from asset2sim.runs.plan.records import (
    KeptRecord,
    call_writer,
    delete_paid_calls,
    paid_calls,
    read_record,
    write_record,
)
from asset2sim.runs.remote.output import send_record
from asset2sim.runs.remote.transfer import run_with_local_files, with_local_packages
from asset2sim.runs.spread.job import Job, JobResult
from asset2sim.storage.objects import StoreError, working_folder
from schemas.asset import AssetRef
from schemas.location import Location
from schemas.request import ModelAnswer, ModelCall, ModelRequest
from schemas.settings import ModelSettings, Settings
from schemas.vocabulary import Method

BEGUN = "asset2sim-begun"
"""Topic of Dask's events on which a worker tells that it begins an asset."""

logger = logging.getLogger(__name__)


def attempt_asset(
    ref: AssetRef,
    out: Path | str,
    settings: Settings,
    pipeline: str,
    run_id: str,
    made: Callable[[Iterable[ModelCall]], None],
    fresh: bool,
    recordings: str = "",
) -> AssetAttempt:
    """Attempt one asset in a child process, into ``out``, a folder or a URL. Model calls are made in this process and
    passed to ``made``. A ``fresh`` child has refined nothing before; ``recordings``: see ``GatewaySession``."""
    folder, owner = working_folder(out), str(out)
    stopped = partial(is_stopped, owner)
    patience_s = settings.run.asset_time_limit_s
    books = open_gateway_session(folder, run_id, ref.asset_id, settings.model, stopped, Path(recordings), patience_s)

    def ask_and_tell(request: ModelRequest) -> ModelAnswer:
        answer = ask_for_asset(request, settings, books)
        made(answer.calls)
        return answer

    attempt = partial(
        attempt_in_child,
        pipeline,
        out=folder,
        settings=with_local_packages(settings),
        ask=ask_and_tell,
        owner=owner,
        fresh=fresh,
    )
    place = Location(out)
    if place.is_url or Location(ref.path).is_url:
        return run_with_local_files(ref, place, settings, attempt)
    return attempt(ref)


def ask_for_asset(request: ModelRequest, settings: Settings, books: GatewaySession) -> ModelAnswer:
    """The answer to one model request of an asset, asked with the settings of its purpose."""
    return ask(request, ask_settings(settings, request.purpose, request.sample), books)


def ask_settings(settings: Settings, purpose: str, sample: int = 0) -> ModelSettings:
    """Model settings of a question: one that is repeated to measure the spread has a temperature."""
    if purpose == Method.IVW:
        return settings.model.model_copy(update={"temperature": settings.methods.ivw_temperature})
    if sample > 0:
        return settings.model.model_copy(update={"temperature": settings.doubt.sample_temperature})
    return settings.model


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
