"""Records that a run has collected from the output folder so far, and the assets that await a second attempt."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from asset2sim.catalog.storage.objects import StoreError
from asset2sim.runs.isolation.asset_attempt import FirstAttempt, failed_record, with_first_attempt, without_retry
from asset2sim.runs.plan.records import (
    KeptRecord,
    await_record,
    delete_paid_calls,
    keep_record,
    paid_calls,
    read_record,
)
from asset2sim.runs.remote.output import fetch_record
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
    """Collected results. ``records``: asset id → record. ``dead``: asset id → a first attempt that died and awaits a
    second, in the order in which that became known; an asset in both has the first attempt's record.
    ``tried_again`` counts second attempts. ``out`` is the run's own folder, ``url`` what it mirrors, if anything."""

    out: Path
    run_id: str
    settings: Settings
    records: dict[str, AssetRecord] = field(default_factory=dict)
    dead: dict[str, FirstAttempt] = field(default_factory=dict)
    tried_again: int = 0
    url: str | None = None

    @property
    def place(self) -> Path | str:
        """Where the workers keep records."""
        return self.url or self.out


def is_open(harvest: Harvest, job: Job) -> bool:
    """Whether the job's asset has neither a record nor a dead first attempt."""
    return job.ref.asset_id not in harvest.records and job.ref.asset_id not in harvest.dead


def take(harvest: Harvest, job: Job, end: JobResult | LostJob) -> AssetRecord | None:
    """Collect a finished job's result. Returns the asset's record if this was its last attempt, else None."""
    if isinstance(end, LostJob):
        return _take_lost(harvest, job, end.reason)
    if end.record is not None:
        return _take_kept(harvest, _keep(harvest, job, end.record, end.died))
    _fetch(harvest, job)
    found = await_record(harvest.out, job.content_hash, harvest.run_id, job.attempt)
    if found is None:
        return _take_lost(harvest, job, f"it has kept a record that is not to be seen in {harvest.place}")
    return _take_kept(harvest, found)


def collect_unreported(harvest: Harvest, job: Job) -> AssetRecord | None:
    """Collect the record of a job whose end was not reported. Returns it if it is the last attempt's, else None."""
    if job.ref.asset_id in harvest.records and job.ref.asset_id not in harvest.dead:
        return None
    _fetch(harvest, job)
    kept = read_record(harvest.out, job.content_hash)
    if kept is None or kept.run_id != harvest.run_id or kept.attempt < job.attempt:
        return None
    return _take_kept(harvest, kept)


def finish_without_retry(harvest: Harvest, job: Job) -> AssetRecord:
    """The record of a dead asset that the limit on second attempts left out."""
    first = harvest.dead.pop(job.ref.asset_id)
    record = harvest.records.get(job.ref.asset_id) or _failed(harvest, job, first.died)
    kept = _keep(harvest, job, without_retry(record, first, harvest.tried_again), "")
    harvest.records[job.ref.asset_id] = kept.record
    return kept.record


def _fetch(harvest: Harvest, job: Job) -> None:
    """Download the record that a worker uploaded to the output's URL; a failed download counts as a lost record."""
    with suppress(StoreError):
        fetch_record(harvest.place, job.content_hash, harvest.run_id, job.attempt)


def _take_kept(harvest: Harvest, kept: KeptRecord) -> AssetRecord | None:
    asset_id = kept.record.ref.asset_id
    harvest.records[asset_id] = kept.record
    if kept.died and kept.attempt == 1:
        harvest.dead[asset_id] = FirstAttempt(kept.died, kept.record.calls)
        return None
    harvest.dead.pop(asset_id, None)
    return kept.record


def _take_lost(harvest: Harvest, job: Job, reason: str) -> AssetRecord | None:
    died = f"its Dask worker was lost: {reason}"
    if job.first is None:
        harvest.dead[job.ref.asset_id] = FirstAttempt(died)
        return None
    record = with_first_attempt(_failed(harvest, job, died), job.first, died)
    return _take_kept(harvest, _keep(harvest, job, record, died))


def _failed(harvest: Harvest, job: Job, reason: str) -> AssetRecord:
    record = failed_record(job.ref, harvest.settings, FailureMode.ENGINE_CRASH, reason)
    paid = paid_calls(harvest.out, job.content_hash)
    return record.model_copy(update={"content_hash": job.content_hash, "calls": paid})


def _keep(harvest: Harvest, job: Job, record: AssetRecord, died: str) -> KeptRecord:
    kept = KeptRecord(
        run_id=harvest.run_id, redo=harvest.settings.run.redo, record=record, attempt=job.attempt, died=died
    )
    keep_record(harvest.out, kept)
    delete_paid_calls(harvest.out, job.content_hash)
    return kept
