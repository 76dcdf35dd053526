"""Records that a run has collected so far, and the assets that await a second attempt."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Generic, TypeVar

from asset2sim.runs.asset_attempt import FirstAttempt, failed_record, with_first_attempt, without_retry
from asset2sim.runs.plan import records
from asset2sim.runs.plan.records import KeptRecord
from asset2sim.runs.plan.timeouts import with_left_alone
from asset2sim.runs.remote.output import fetch_record
from asset2sim.runs.spread.job import Job, JobResult, LostJob
from asset2sim.storage.objects import StoreError
from schemas.asset import AssetRecord
from schemas.settings import Settings
from schemas.vocabulary import FailureMode

_NUMBER = re.compile(r"\d+(?:\.\d+)?")


@dataclass
class Breaker:
    """Counts equal model errors in a row. ``most`` of them break it, 0 for none; ``broken`` then says why."""

    most: int
    broken: str | None = None
    count: int = 0
    last: str = ""

    def see(self, record: AssetRecord) -> None:
        """Count a finished asset; one that ended otherwise begins the count anew, one that asked no model does not."""
        if self.broken is not None or self.most == 0:
            return
        if record.failure_mode is not FailureMode.MODEL_ERROR:
            if any(call.outcome == "ok" for call in record.calls):
                self.count = 0
            return
        error = kind_of_error(record)
        self.count = self.count + 1 if error == self.last else 1
        self.last = error
        if self.count >= self.most:
            self.broken = (
                f"the model failed {self.count} assets in a row with the same error, so the others were not tried; the "
                f"next run tries them: {record.reason}"
            )


def kind_of_error(record: AssetRecord) -> str:
    """A model error's text without what differs between assets: its id, and numbers such as times and request ids."""
    own = rf"(?<!\w){re.escape(record.ref.asset_id)}(?!\w)"
    return _NUMBER.sub("0", re.sub(own, "", record.reason))


Kept = TypeVar("Kept")
"""Summary that a run keeps in memory of a record."""


def second_attempt_jobs(
    jobs: Mapping[str, Job], dead: Mapping[str, FirstAttempt], has_record: Callable[[str], bool], most: int
) -> Iterator[Job]:
    """At most ``most`` second attempts at ``dead`` assets: those without a record first, else in ``dead``'s order."""
    order = sorted(dead, key=has_record)
    for asset_id in order[:most]:
        yield Job(jobs[asset_id].ref, jobs[asset_id].content_hash, dead[asset_id])


@dataclass
class Harvest(Generic[Kept]):
    """Collected results. ``report`` is told of each last record, and ``keep`` makes of it what the run remembers;
    ``records``: asset id → that. ``dead``: asset id → a first attempt that died and awaits a second, in the order in
    which that became known. ``first``: asset id → a dead first attempt's record, if it left one.
    ``tried_again`` counts second attempts. ``out`` is the run's own folder, ``url`` what it mirrors, if anything.
    ``timeouts``: asset id → runs in a row, until this one, in which it took too long. ``waits`` is told of each asset
    that waits for a second attempt."""

    out: Path
    run_id: str
    settings: Settings
    report: Callable[[AssetRecord], None]
    keep: Callable[[AssetRecord], Kept]
    records: dict[str, Kept] = field(default_factory=dict)
    dead: dict[str, FirstAttempt] = field(default_factory=dict)
    first: dict[str, AssetRecord] = field(default_factory=dict)
    tried_again: int = 0
    url: str | None = None
    timeouts: Mapping[str, int] = field(default_factory=dict)
    breaker: Breaker = field(default_factory=lambda: Breaker(0))
    waits: Callable[[str], None] = lambda asset_id: None

    @property
    def place(self) -> Path | str:
        """Where the workers keep records."""
        return self.url or self.out


def is_open(harvest: Harvest[Kept], job: Job) -> bool:
    """Whether the job's asset has neither a record nor a dead first attempt."""
    return job.ref.asset_id not in harvest.records and job.ref.asset_id not in harvest.dead


def take_result(harvest: Harvest[Kept], job: Job, end: JobResult | LostJob | None) -> None:
    """Collect a job's record, and report an asset's last one. None: its worker may have written one."""
    asset_id = job.ref.asset_id
    if end is None and asset_id in harvest.records:
        return
    kept: KeptRecord | None
    if isinstance(end, JobResult):
        kept = _received(harvest, end)
    elif end is None:
        kept = _written(harvest, job)
    else:
        kept = _lost(harvest, job, f"its Dask worker was lost: {end.reason}")
    if kept is None:
        if asset_id in harvest.dead:
            harvest.waits(asset_id)
        return
    if kept.died and kept.attempt == 1:
        harvest.waits(asset_id)
        harvest.first[asset_id] = kept.record
        harvest.dead[asset_id] = FirstAttempt(kept.died, kept.record.calls)
    else:
        _finish(harvest, kept.record)


def finish_untried(harvest: Harvest[Kept], jobs: Iterable[Job]) -> None:
    """A failed record for each asset that the broken circuit left out; no file, so that the next run tries it."""
    reason = harvest.breaker.broken
    for job in jobs if reason is not None else ():
        if is_open(harvest, job):
            record = failed_record(job.ref, harvest.settings, FailureMode.MODEL_ERROR, f"not tried: {reason}")
            record = record.model_copy(update={"content_hash": job.content_hash})
            harvest.records[job.ref.asset_id] = harvest.keep(record)


def finish_without_retry(harvest: Harvest[Kept], job: Job) -> None:
    """Report the record of a dead asset that the limit on second attempts left out."""
    first = harvest.dead[job.ref.asset_id]
    record = harvest.first.get(job.ref.asset_id) or _failed(harvest, job, first.died)
    record = without_retry(record, first, harvest.tried_again)
    _finish(harvest, _keep(harvest, _kept(harvest, job, record)).record)


def finish_stopped(harvest: Harvest[Kept]) -> None:
    """Keep the first attempts' records of dead assets that a run which stopped could not try again."""
    for asset_id in harvest.dead:
        if (record := harvest.first.get(asset_id)) is not None:
            harvest.records[asset_id] = harvest.keep(record)


def _finish(harvest: Harvest[Kept], record: AssetRecord) -> None:
    """Remember and report an asset's last record."""
    asset_id = record.ref.asset_id
    record = with_left_alone(record, harvest.timeouts.get(asset_id, 0), harvest.settings.run)
    harvest.records[asset_id] = harvest.keep(record)
    harvest.dead.pop(asset_id, None)
    harvest.first.pop(asset_id, None)
    harvest.breaker.see(record)
    harvest.report(record)


def _received(harvest: Harvest[Kept], end: JobResult) -> KeptRecord:
    """The record that a worker handed over, written here where there was no room for it there."""
    records.share_field_sets(end.kept)
    return end.kept if end.written else _keep(harvest, end.kept)


def _written(harvest: Harvest[Kept], job: Job) -> KeptRecord | None:
    """The record that a worker wrote in this run, at this attempt or a later one, and could not hand over."""
    with suppress(StoreError):  # a failed download counts as a lost record
        fetch_record(harvest.place, job.content_hash, harvest.run_id, job.attempt)
    kept = records.read_record(harvest.out, job.content_hash)
    return kept if kept is not None and kept.run_id == harvest.run_id and kept.attempt >= job.attempt else None


def _lost(harvest: Harvest[Kept], job: Job, died: str) -> KeptRecord | None:
    """The failed record of an asset whose second attempt was lost with its worker; None: it was the first."""
    if job.first is None:
        harvest.dead[job.ref.asset_id] = FirstAttempt(died)
        return None
    record = with_first_attempt(_failed(harvest, job, died), job.first, died)
    return _keep(harvest, _kept(harvest, job, record, died))


def _failed(harvest: Harvest[Kept], job: Job, reason: str) -> AssetRecord:
    record = failed_record(job.ref, harvest.settings, FailureMode.ENGINE_CRASH, reason)
    paid = records.paid_calls(harvest.out, job.content_hash)
    return record.model_copy(update={"content_hash": job.content_hash, "calls": paid})


def _kept(harvest: Harvest[Kept], job: Job, record: AssetRecord, died: str = "") -> KeptRecord:
    redo = harvest.settings.run.redo
    return KeptRecord(run_id=harvest.run_id, redo=redo, record=record, attempt=job.attempt, died=died)


def _keep(harvest: Harvest[Kept], kept: KeptRecord) -> KeptRecord:
    """The record, written by the run itself, where no worker has."""
    records.keep_record(harvest.out, kept)
    records.delete_paid_calls(harvest.out, kept.record.content_hash)
    return kept
