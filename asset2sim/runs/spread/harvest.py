"""Records that a run has collected from the output folder so far, and the assets that await a second attempt."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from asset2sim.catalog.storage.objects import StoreError
from asset2sim.runs.isolation.asset_attempt import FirstAttempt, failed_record, with_first_attempt, without_retry
from asset2sim.runs.plan import records
from asset2sim.runs.plan.records import KeptRecord
from asset2sim.runs.plan.timeouts import with_left_alone
from asset2sim.runs.remote.output import fetch_record
from asset2sim.runs.spread.breaker import Breaker
from asset2sim.runs.spread.job import Job, JobResult
from asset2sim.runs.spread.spread import LostJob
from schemas.asset import AssetRecord
from schemas.settings import Settings
from schemas.vocabulary import FailureMode


def second_attempt_jobs(
    jobs: Mapping[str, Job], dead: Mapping[str, FirstAttempt], has_record: Callable[[str], bool], most: int
) -> Iterator[Job]:
    """At most ``most`` second attempts at ``dead`` assets: those without a record first, else in ``dead``'s order."""
    order = sorted(dead, key=has_record)
    for asset_id in order[:most]:
        yield Job(jobs[asset_id].ref, jobs[asset_id].content_hash, dead[asset_id])


@dataclass
class Harvest:
    """Collected results. ``report`` is told of each last record. ``records``: asset id → record. ``dead``: asset id → a
    first attempt that died and awaits a second, in the order in which that became known; an asset in both has the first
    attempt's record. ``tried_again`` counts second attempts. ``out`` is the run's own folder, ``url`` what it mirrors,
    if anything. ``timeouts``: asset id → runs in a row, until this one, in which it took too long."""

    out: Path
    run_id: str
    settings: Settings
    report: Callable[[AssetRecord], None]
    records: dict[str, AssetRecord] = field(default_factory=dict)
    dead: dict[str, FirstAttempt] = field(default_factory=dict)
    tried_again: int = 0
    url: str | None = None
    timeouts: Mapping[str, int] = field(default_factory=dict)
    breaker: Breaker = field(default_factory=lambda: Breaker(0))

    @property
    def place(self) -> Path | str:
        """Where the workers keep records."""
        return self.url or self.out


def is_open(harvest: Harvest, job: Job) -> bool:
    """Whether the job's asset has neither a record nor a dead first attempt."""
    return job.ref.asset_id not in harvest.records and job.ref.asset_id not in harvest.dead


def take(harvest: Harvest, job: Job, end: JobResult | LostJob | None) -> None:
    """Collect a job's record, and report it if this was the asset's last attempt. Where no end was reported (None), the
    job need not have a record."""
    asset_id = job.ref.asset_id
    if end is None and asset_id in harvest.records and asset_id not in harvest.dead:
        return
    kept = _find(harvest, job, end)
    if kept is None and end is not None:
        unseen = f"it has kept a record that is not to be seen in {harvest.place}"
        died = f"its Dask worker was lost: {end.reason if isinstance(end, LostJob) else unseen}"
        if job.first is None:
            harvest.dead[asset_id] = FirstAttempt(died)
        else:
            kept = _keep(harvest, job, with_first_attempt(_failed(harvest, job, died), job.first, died), died)
    if kept is None:
        return
    harvest.records[asset_id] = kept.record
    if kept.died and kept.attempt == 1:
        harvest.dead[asset_id] = FirstAttempt(kept.died, kept.record.calls)
    else:
        harvest.dead.pop(asset_id, None)
        _end(harvest, kept.record)


def _end(harvest: Harvest, record: AssetRecord) -> None:
    """Collect and report the last record of an asset."""
    record = with_left_alone(record, harvest.timeouts.get(record.ref.asset_id, 0), harvest.settings.run)
    harvest.records[record.ref.asset_id] = record
    harvest.breaker.see(record)
    harvest.report(record)


def finish_untried(harvest: Harvest, jobs: Iterable[Job]) -> None:
    """A failed record for each asset without one that the broken circuit left out. No file is kept of it: the next run
    tries the asset."""
    reason = harvest.breaker.broken
    for job in jobs if reason is not None else ():
        if is_open(harvest, job):
            record = failed_record(job.ref, harvest.settings, FailureMode.MODEL_ERROR, f"not tried: {reason}")
            harvest.records[job.ref.asset_id] = record.model_copy(update={"content_hash": job.content_hash})


def finish_without_retry(harvest: Harvest, job: Job) -> None:
    """Report the record of a dead asset that the limit on second attempts left out."""
    first = harvest.dead.pop(job.ref.asset_id)
    record = harvest.records.get(job.ref.asset_id) or _failed(harvest, job, first.died)
    record = without_retry(record, first, harvest.tried_again)
    _end(harvest, _keep(harvest, job, record, "").record)


def _find(harvest: Harvest, job: Job, end: JobResult | LostJob | None) -> KeptRecord | None:
    """The record with which the job ended, or may have ended."""
    if isinstance(end, LostJob):
        return None
    if end is not None and end.record is not None:
        return _keep(harvest, job, end.record, end.died)
    with suppress(StoreError):  # a failed download counts as a lost record
        fetch_record(harvest.place, job.content_hash, harvest.run_id, job.attempt)
    limit_s = 0.0 if end is None else records.VISIBLE_LIMIT_S
    return records.await_record(harvest.out, job.content_hash, harvest.run_id, job.attempt, limit_s)


def _failed(harvest: Harvest, job: Job, reason: str) -> AssetRecord:
    record = failed_record(job.ref, harvest.settings, FailureMode.ENGINE_CRASH, reason)
    paid = records.paid_calls(harvest.out, job.content_hash)
    return record.model_copy(update={"content_hash": job.content_hash, "calls": paid})


def _keep(harvest: Harvest, job: Job, record: AssetRecord, died: str) -> KeptRecord:
    kept = KeptRecord(
        run_id=harvest.run_id, redo=harvest.settings.run.redo, record=record, attempt=job.attempt, died=died
    )
    records.keep_record(harvest.out, kept)
    records.delete_paid_calls(harvest.out, job.content_hash)
    return kept
