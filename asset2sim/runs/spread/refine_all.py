"""Refine all assets of a run on a Dask cluster, which may be interrupted or lost."""

import logging
import threading
import uuid
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from distributed import Client, wait

from asset2sim.models.gateway.lite import load_litellm
from asset2sim.runs.interrupt import sigterm_as_interrupt
from asset2sim.runs.isolation import accept_children, stop_children
from asset2sim.runs.isolation.children import warm_up
from asset2sim.runs.plan.plan import Plan
from asset2sim.runs.plan.records import drop_record
from asset2sim.runs.result import INTERRUPTED
from asset2sim.runs.spread.cluster import concurrency, open_client
from asset2sim.runs.spread.existing_cluster import RETURN_LIMIT_S
from asset2sim.runs.spread.harvest import (
    Harvest,
    collect_unreported,
    finish_without_retry,
    is_open,
    second_attempt_jobs,
    take,
)
from asset2sim.runs.spread.job import Job, JobResult, job_of, last_seconds, longest_first
from asset2sim.runs.spread.progress import Report, progress
from asset2sim.runs.spread.spread import IN_FLIGHT_PER_THREAD, InFlight, LostClusterError, LostJob, RefineJob, spread
from asset2sim.runs.spread.worker import refine_on_worker
from schemas.asset import AssetRecord, AssetRef, Unchanged
from schemas.errors import UsageError
from schemas.settings import Settings

FINISH_LIMIT_S = 1.0
"""After an interruption, time that workers get to write their records once their children are killed, s."""

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class RunRecords:
    """Records of the finished assets, in the dataset's order; ``stopped`` says why some are missing, ``unchanged``
    which assets needed no refinement."""

    records: tuple[AssetRecord, ...]
    stopped: str | None
    unchanged: tuple[Unchanged, ...] = ()


def refine_all(
    refs: Sequence[AssetRef],
    out: Path,
    settings: Settings,
    pipeline: str,
    run_id: str | None = None,
    hashes: Mapping[str, str] | None = None,
    url: str | None = None,
) -> RunRecords:
    """Refine every asset into ``out`` (absolute) by ``pipeline`` (``module:function``), on the cluster of
    ``settings.run``.

    ``url`` is the URL that ``out`` mirrors, to which workers upload; None: they write into ``out`` itself.
    ``run_id`` names the run whose budget the model calls count towards; None is a run of its own. Record files stay in
    ``out``, named by ``hashes`` (asset id → content hash); without ``hashes`` they are removed at the end.
    Ctrl-C, SIGTERM and the loss of the cluster end it early, with no child process left and with the records so far.
    """
    if not refs:
        return RunRecords((), None)
    run_id = run_id or uuid.uuid4().hex
    ordered = longest_first(refs, last_seconds(out, settings.method))
    jobs = {ref.asset_id: job_of(ref, run_id, hashes) for ref in ordered}
    harvest = Harvest(out, run_id, settings, url=url)
    accept_children(str(harvest.place))
    warm_up(pipeline)
    if settings.run.scheduler is None:
        threading.Thread(target=load_litellm, daemon=True).start()
    with sigterm_as_interrupt(), progress(len(jobs)) as report:
        work = partial(refine_on_worker, out=harvest.place, settings=settings, pipeline=pipeline, run_id=run_id)
        stopped = _refine(jobs, work, harvest, report)
    if hashes is None:
        for job in jobs.values():
            drop_record(out, job.content_hash)
    return RunRecords(tuple(harvest.records[ref.asset_id] for ref in refs if ref.asset_id in harvest.records), stopped)


def _refine(jobs: Mapping[str, Job], work: RefineJob, harvest: Harvest, report: Report) -> str | None:
    """Run all jobs on a cluster that may be lost and return. Returns why it stopped early, or None."""
    run, lost, patience_s = harvest.settings.run, None, 0.0
    while True:
        try:
            with open_client(run, harvest.place, patience_s) as client:
                if lost is not None:
                    logger.warning("the Dask scheduler at %s is back", run.scheduler)
                    _collect_unreported(jobs.values(), harvest, report)
                return _refine_on(client, jobs, work, harvest, report)
        except LostClusterError as error:
            lost, patience_s = str(error), RETURN_LIMIT_S
            logger.warning("the Dask scheduler at %s went away; waiting %g s for it", run.scheduler, patience_s)
        except UsageError:
            # Nothing has begun where the first attempt to join fails.
            if lost is None:
                raise
            _collect_unreported(jobs.values(), harvest, report)
            return lost
        except KeyboardInterrupt:
            # Ctrl-C between two clusters: no child is running.
            return INTERRUPTED


def _refine_on(
    client: Client, jobs: Mapping[str, Job], work: RefineJob, harvest: Harvest, report: Report
) -> str | None:
    """Run the open jobs, then second attempts. Returns ``INTERRUPTED`` or None. Raises LostClusterError."""
    in_flight: InFlight = {}
    try:
        _do(client, jobs, work, harvest, in_flight, report)
        return None
    except KeyboardInterrupt:
        _stop(client, harvest.place, harvest.settings)
        _let_finish(in_flight)
        _collect_unreported(in_flight.values(), harvest, report)
        return INTERRUPTED
    finally:
        if in_flight and client.status == "running":
            client.cancel(list(in_flight), force=True)


def _do(
    client: Client, jobs: Mapping[str, Job], work: RefineJob, harvest: Harvest, in_flight: InFlight, report: Report
) -> None:
    def bring_in(job: Job, end: JobResult | LostJob) -> None:
        record = take(harvest, job, end)
        if record is not None:
            report(record)

    still_open = (job for job in jobs.values() if is_open(harvest, job))
    spread(client, still_open, work, IN_FLIGHT_PER_THREAD * concurrency(client), in_flight, bring_in)
    most = harvest.settings.run.retries_alone - harvest.tried_again
    for job in list(second_attempt_jobs(jobs, harvest.dead, harvest.records.__contains__, most)):
        harvest.tried_again += 1
        spread(client, [job], work, 1, in_flight, bring_in)
    for asset_id in list(harvest.dead):
        report(finish_without_retry(harvest, jobs[asset_id]))


def _collect_unreported(jobs: Iterable[Job], harvest: Harvest, report: Report) -> None:
    """Collect the records of these jobs that workers have written but could not report."""
    for job in jobs:
        record = collect_unreported(harvest, job)
        if record is not None:
            report(record)


def _let_finish(in_flight: InFlight) -> None:
    try:
        wait(list(in_flight), timeout=FINISH_LIMIT_S)
    except (OSError, TimeoutError):
        return


def _stop(client: Client, out: Path | str, settings: Settings) -> None:
    """Kill this run's children, here or on the workers of an existing cluster, which then accept children again."""
    if settings.run.scheduler is None:
        stop_children(str(out))
        return
    try:
        client.run(stop_children, str(out))
        client.run(accept_children, str(out))
    except (OSError, TimeoutError) as error:
        logger.warning("cannot stop the workers (%s); what they still do ends with its time limit", error)


def refine_planned(
    refs: Sequence[AssetRef],
    plan: Plan,
    out: Path,
    settings: Settings,
    run_id: str,
    pipeline: str,
    url: str | None = None,
) -> RunRecords:
    """Refine the plan's ``todo``. Returns their records and those that a killed run left, in the order of ``refs``, and
    the unchanged assets; for ``url`` see ``refine_all``."""
    refined = refine_all(plan.todo, out, settings, pipeline, run_id, plan.hashes, url)
    order = {ref.asset_id: number for number, ref in enumerate(refs)}
    records = sorted((*refined.records, *plan.finished), key=lambda record: order[record.ref.asset_id])
    return replace(refined, records=tuple(records), unchanged=plan.unchanged)
