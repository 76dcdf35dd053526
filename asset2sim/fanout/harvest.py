"""What a run has brought in so far: records out of the output folder, and which assets are to be tried once more."""

from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from asset2sim.catalog.storage.objects import StoreError
from asset2sim.fanout.again import not_tried_again, with_first
from asset2sim.fanout.done import Done
from asset2sim.fanout.job import FirstAttempt, Job
from asset2sim.fanout.spread import Lost
from asset2sim.incremental.paid_calls import drop_calls, paid_calls
from asset2sim.incremental.records import KeptRecord, await_record, keep_record, read_record
from asset2sim.isolation.asset import failed_record
from asset2sim.remote.records import fetch_record
from schemas.asset import AssetRecord
from schemas.settings import Settings
from schemas.vocabulary import FailureMode


@dataclass
class Harvest:
    """``records`` maps asset ids to what came of them; ``dead`` holds how a first attempt died that is to be followed
    by another, in the order in which that became known. An asset may be in both: its record is then the first's.
    ``tried_again`` counts second attempts. ``out`` is the run's own folder, ``url`` what that mirrors, if anything."""

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
    """Whether nothing is known of the job's asset yet."""
    return job.ref.asset_id not in harvest.records and job.ref.asset_id not in harvest.dead


def take(harvest: Harvest, job: Job, end: Done | Lost) -> AssetRecord | None:
    """Bring in how a job ended; the asset's record, if that was its last attempt."""
    if isinstance(end, Lost):
        return _take_lost(harvest, job, end.reason)
    if end.record is not None:
        return _take_kept(harvest, _keep(harvest, job, end.record, end.died))
    _fetch(harvest, job)
    found = await_record(harvest.out, job.content_hash, harvest.run_id, job.attempt)
    if found is None:
        return _take_lost(harvest, job, f"it has kept a record that is not to be seen in {harvest.place}")
    return _take_kept(harvest, found)


def pick_up(harvest: Harvest, job: Job) -> AssetRecord | None:
    """Bring in what a job's worker has kept, if nobody told that it ended; the record, if that was the last attempt."""
    if job.ref.asset_id in harvest.records and job.ref.asset_id not in harvest.dead:
        return None
    _fetch(harvest, job)
    kept = read_record(harvest.out, job.content_hash)
    if kept is None or kept.run_id != harvest.run_id or kept.attempt < job.attempt:
        return None
    return _take_kept(harvest, kept)


def give_up(harvest: Harvest, job: Job) -> AssetRecord:
    """The record of a dead asset that is one too many to be tried once more."""
    first = harvest.dead.pop(job.ref.asset_id)
    record = harvest.records.get(job.ref.asset_id) or _failed(harvest, job, first.died)
    kept = _keep(harvest, job, not_tried_again(record, first, harvest.tried_again), "")
    harvest.records[job.ref.asset_id] = kept.record
    return kept.record


def _fetch(harvest: Harvest, job: Job) -> None:
    """Have the record here that a worker kept behind the output's URL; what cannot be fetched is as good as lost."""
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
    record = with_first(_failed(harvest, job, died), job.first, died)
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
    drop_calls(harvest.out, job.content_hash)
    return kept
