"""Refine all assets of a run on a Dask cluster, which may be interrupted or lost."""

import logging
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Generic

from distributed import Client, wait

from asset2sim.experiments.cluster import RETURN_LIMIT_S, concurrency, open_client
from asset2sim.experiments.interrupt import sigterm_as_interrupt
from asset2sim.experiments.isolation import accept_children, stop_children
from asset2sim.experiments.isolation.children import warm_up
from asset2sim.models.gateway.environment import preload_litellm
from asset2sim.runs.plan.plan import Plan
from asset2sim.runs.plan.records import KeptRecord, LeftRecords, drop_record, keep_record
from asset2sim.runs.result import INTERRUPTED
from asset2sim.runs.spread.harvest import (
    Harvest,
    Kept,
    finish_stopped,
    finish_untried,
    finish_without_retry,
    is_open,
    second_attempt_jobs,
    take_result,
)
from asset2sim.runs.spread.job import (
    IN_FLIGHT_PER_THREAD,
    InFlight,
    Job,
    LostClusterError,
    RefineJob,
    jobs_of,
    last_seconds,
    spread,
)
from asset2sim.runs.spread.progress import progress
from asset2sim.runs.spread.worker import BEGUN, refine_on_worker
from schemas.asset import AssetRecord, AssetRef, Unchanged
from schemas.errors import UsageError
from schemas.settings import Settings

FINISH_LIMIT_S = 1.0
"""After an interruption, time that workers get to write their records once their children are killed, s."""

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class RunRecords(Generic[Kept]):
    """Summaries of the finished assets' records, in the dataset's order; ``stopped`` says why some are missing or
    were not tried, ``unchanged`` which assets needed no refinement."""

    records: tuple[Kept, ...]
    stopped: str | None
    unchanged: tuple[Unchanged, ...] = ()


def refine_and_keep(
    refs: Sequence[AssetRef],
    out: Path,
    settings: Settings,
    pipeline: str,
    keep: Callable[[AssetRecord], Kept],
    run_id: str | None = None,
    plan: Plan | None = None,
    url: str | None = None,
) -> RunRecords[Kept]:
    """Refine every asset, or ``todo`` of the ``plan``, into ``out`` (absolute) by ``pipeline`` (``module:function``),
    on the cluster of ``settings.run``; records come in the order of ``refs``, those that a killed run left among them.
    ``keep`` is called with each as it comes in, and may be called again with the same one after an interruption.

    ``url`` is the URL that ``out`` mirrors, to which workers upload; None: they write into ``out`` itself.
    ``run_id`` names the run whose budget the model calls count towards; None is a run of its own. Record files stay in
    ``out``, named by the plan's content hashes; without a plan they are removed at the end.
    Ctrl-C, SIGTERM and the loss of the cluster end it early, with no child process left and with the records so far.
    """
    run_id = run_id or uuid.uuid4().hex
    plan = plan or Plan(tuple(refs), LeftRecords(out), (), {})
    harvest, stopped = Harvest(out, run_id, settings, lambda record: None, keep, url=url), None
    with sigterm_as_interrupt():
        try:
            _take_up(plan, harvest)
        except KeyboardInterrupt:
            # What has not been taken up is left for the next run.
            stopped = INTERRUPTED
    # A record that was there when the run was planned may be gone.
    todo = [*plan.todo, *(ref for ref in plan.finished.refs if ref.asset_id not in harvest.records)]
    if todo and stopped is None:
        jobs = jobs_of(todo, run_id, plan.hashes, last_seconds(out, settings.method))
        accept_children(str(url or out))
        warm_up(pipeline)
        if settings.run.scheduler is None:
            preload_litellm(settings.model)
        with sigterm_as_interrupt(), progress(len(jobs)) as report:
            harvest.report, harvest.waits, harvest.timeouts = report, report.waits, plan.timeouts
            harvest.breaker.most = settings.run.max_model_errors
            work = partial(
                refine_on_worker,
                out=harvest.place,
                settings=settings,
                pipeline=pipeline,
                run_id=run_id,
                # Workers elsewhere were started in other folders.
                recordings=str(Path.cwd()),
            )
            stopped = _refine(jobs, work, harvest, report.begun)
            finish_stopped(harvest)
        if not plan.hashes:
            for job in jobs.values():
                drop_record(out, job.content_hash)
    found = tuple(harvest.records[ref.asset_id] for ref in refs if ref.asset_id in harvest.records)
    return RunRecords(found, stopped, plan.unchanged)


def _take_up(plan: Plan, harvest: Harvest[Kept]) -> None:
    """Keep the records that a killed run left, as records of this run."""
    for record in plan.finished:
        harvest.records[record.ref.asset_id] = harvest.keep(record)
        kept = KeptRecord(run_id=harvest.run_id, redo=harvest.settings.run.redo, record=record)
        keep_record(harvest.out, kept)


def _refine(
    jobs: Mapping[str, Job], work: RefineJob, harvest: Harvest[Kept], begun: Callable[[str], None]
) -> str | None:
    """Run all jobs, then second attempts, on a cluster that may be lost and return; ``begun`` is told of each asset
    that a worker begins. Returns why it stopped early, or None."""
    run, lost, patience_s = harvest.settings.run, None, 0.0
    bring_in = partial(take_result, harvest)
    while True:
        try:
            with open_client(run, harvest.place, patience_s) as client, _in_flight(client, harvest) as in_flight:
                if lost is not None:
                    logger.warning("the Dask scheduler at %s is back", run.scheduler)
                    _collect_unreported(jobs.values(), harvest)
                still_open = (job for job in jobs.values() if is_open(harvest, job) and not harvest.breaker.broken)
                client.subscribe_topic(BEGUN, lambda event: begun(event[1]))
                spread(client, still_open, work, IN_FLIGHT_PER_THREAD * concurrency(client), in_flight, bring_in)
                most = run.retries_alone - harvest.tried_again
                for job in list(second_attempt_jobs(jobs, harvest.dead, harvest.first.__contains__, most)):
                    harvest.tried_again += 1
                    spread(client, [job], work, 1, in_flight, bring_in)
                for asset_id in list(harvest.dead):
                    finish_without_retry(harvest, jobs[asset_id])
                finish_untried(harvest, jobs.values())
                return harvest.breaker.broken
        except LostClusterError as error:
            lost, patience_s = str(error), RETURN_LIMIT_S
            logger.warning("the Dask scheduler at %s went away; waiting %g s for it", run.scheduler, patience_s)
        except UsageError:
            # Nothing has begun where the first attempt to join fails.
            if lost is None:
                raise
            _collect_unreported(jobs.values(), harvest)
            return lost
        except KeyboardInterrupt:
            # No child is running: they were stopped, or it came between two clusters.
            return INTERRUPTED


@contextmanager
def _in_flight(client: Client, harvest: Harvest[Kept]) -> Iterator[InFlight]:
    """The jobs in flight in the block: after an interruption children are stopped and records collected."""
    in_flight: InFlight = {}
    try:
        yield in_flight
    except KeyboardInterrupt:
        _stop(client, harvest.place, harvest.settings)
        with suppress(OSError, TimeoutError):
            wait(list(in_flight), timeout=FINISH_LIMIT_S)
        _collect_unreported(in_flight.values(), harvest)
        raise
    finally:
        if in_flight and client.status == "running":
            client.cancel(list(in_flight), force=True)


def _collect_unreported(jobs: Iterable[Job], harvest: Harvest[Kept]) -> None:
    """Collect the records of these jobs that workers have written but could not report."""
    for job in jobs:
        take_result(harvest, job, None)


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
