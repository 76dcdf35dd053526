"""The second attempt at an asset whose first one died: alone, once all others are done, and a few of them only."""

from collections.abc import Callable, Iterator, Mapping

from asset2sim.fanout.job import FirstAttempt, Job
from schemas.asset import AssetRecord
from schemas.finding import Finding
from schemas.vocabulary import Severity, Stage

DIED_ONCE = "died_once"
"""Code of the finding on an asset whose first attempt died and whose second one did not."""
NOT_TRIED_AGAIN = "not_tried_again"
"""Code of the finding on an asset whose attempt died, and that was one too many to be tried once more."""


def second_jobs(
    jobs: Mapping[str, Job], dead: Mapping[str, FirstAttempt], has_record: Callable[[str], bool], most: int
) -> Iterator[Job]:
    """At most so many jobs for the dead: first those of which there is no record, then in the order of ``dead``."""
    order = sorted(dead, key=has_record)
    for asset_id in order[:most]:
        yield Job(jobs[asset_id].ref, jobs[asset_id].content_hash, dead[asset_id])


def with_first(record: AssetRecord, first: FirstAttempt | None, died: str) -> AssetRecord:
    """The record of a second attempt with what the first one cost and how it died; ``died`` is how this one did."""
    if first is None:
        return record
    asset_id, calls = record.ref.asset_id, (*first.calls, *record.calls)
    # The log has been moved out of the second attempt's way.
    before = first.died.replace(f"{asset_id}.log", f"{asset_id}.first.log")
    if not died:
        finding = Finding(
            stage=Stage.REFINE,
            severity=Severity.WARNING,
            code=DIED_ONCE,
            message=f"asset {asset_id}: its first attempt died ({before}); this is the second, alone",
        )
        return record.model_copy(update={"calls": calls, "findings": (*record.findings, finding)})
    reason = f"died twice: {died}; the first time: {before}"
    message = f"asset {asset_id}: {reason}"
    findings = tuple(
        finding.model_copy(update={"message": message}) if finding.code == record.failure_mode else finding
        for finding in record.findings
    )
    return record.model_copy(update={"calls": calls, "reason": reason, "findings": findings})


def not_tried_again(record: AssetRecord, first: FirstAttempt, most: int) -> AssetRecord:
    """The record of an asset that died and is left at that."""
    finding = Finding(
        stage=Stage.REFINE,
        severity=Severity.INFO,
        code=NOT_TRIED_AGAIN,
        message=f"asset {record.ref.asset_id} was not tried again: {most} others of this run were, one after the "
        "other; the next run tries it",
    )
    return record.model_copy(update={"calls": record.calls or first.calls, "findings": (*record.findings, finding)})
