"""One attempt at an asset in a child process, and a second one after a death: a record, however the process ends."""

from dataclasses import dataclass
from pathlib import Path

from asset2sim.checks.alignment.expectations import expectations_met
from asset2sim.experiments.isolation.children import preload
from asset2sim.experiments.isolation.pipe_messages import Ending, Outcome
from asset2sim.experiments.isolation.supervise import run_isolated
from asset2sim.models.gateway.questions import LOG_FOLDER, LoggedAnswer, write_refused_answers
from schemas.asset import AssetRecord, AssetRef
from schemas.errors import Asset2SimError
from schemas.finding import Finding, remark, warning
from schemas.request import ModelAnswer, ModelAsk, ModelCall, ModelRequest
from schemas.settings import Settings
from schemas.vocabulary import FailureMode, Severity, Stage, Status

DIED_ONCE = "died_once"
"""Code of the finding on an asset whose first attempt died and whose second one did not."""
NOT_TRIED_AGAIN = "not_tried_again"
"""Code of the finding on an asset whose attempt died and that the limit on second attempts left out."""


class StoppedError(Asset2SimError):
    """The run was stopped while this asset was in work; it has no record."""


RETRIED_ENDINGS = (Ending.DIED, Ending.TIMED_OUT, Ending.OUT_OF_MEMORY)
"""Endings worth a second attempt: the machine or another process may have caused them. Exceptions would recur."""

MODES = {
    Ending.TIMED_OUT: FailureMode.TIMEOUT,
    Ending.OUT_OF_MEMORY: FailureMode.OUT_OF_MEMORY,
    Ending.DISK_FULL: FailureMode.DISK_FULL,
}
"""Failure modes of endings; every other is a crash."""


@dataclass(frozen=True)
class AssetAttempt:
    """One attempt at an asset: its record, and how its process died, empty where it did not."""

    record: AssetRecord
    died: str = ""


@dataclass(frozen=True)
class FirstAttempt:
    """How an asset's first attempt died, in words, and the model calls that it had made until then."""

    died: str
    calls: tuple[ModelCall, ...] = ()


def log_file(out: Path, asset_id: str) -> Path:
    """Where the console lines of one asset's process are kept, if it prints any."""
    return out / LOG_FOLDER / f"{asset_id}.log"


def first_log_file(out: Path, asset_id: str) -> Path:
    """Where the console lines of a first attempt that died are kept, once there is a second."""
    return out / LOG_FOLDER / f"{asset_id}.first.log"


def attempt_in_child(
    pipeline: str,
    ref: AssetRef,
    out: Path,
    settings: Settings,
    ask: ModelAsk,
    owner: str | None = None,
    fresh: bool = False,
) -> AssetAttempt:
    """Refine one asset in a child process under the limits of ``settings.run``; always answers with a record.

    ``pipeline`` names a function as ``module:function``, which the child imports and calls as ``function(ref, out,
    settings, ask=ask)``; it returns the record. ``ask`` runs in this process. A child that crashes, hangs, outgrows
    its memory or raises leaves a failed record, which keeps the model calls it had made. Answers that the record calls
    invalid are kept in ``logs``. Raises ``StoppedError`` where ``stop_children(owner)`` ended it;
    ``owner`` is ``str(out)`` by default. A ``fresh`` child has refined nothing before.
    """
    calls: list[ModelCall] = []
    heard: list[LoggedAnswer] = []

    def ask_and_keep(request: ModelRequest) -> ModelAnswer:
        answer = ask(request)
        calls.extend(answer.calls)
        heard.append(LoggedAnswer.of(request, answer))
        return answer

    preload(pipeline)
    outcome = run_isolated(
        pipeline,
        (ref, out, settings),
        time_limit_s=settings.run.asset_time_limit_s,
        memory_limit_mb=settings.run.asset_memory_limit_mb,
        services={"ask": ask_and_keep},
        log_path=log_file(out, ref.asset_id),
        owner=owner or str(out),
        fresh=fresh,
    )
    if outcome.ending is Ending.STOPPED:
        raise StoppedError(f"asset {ref.asset_id} was stopped with the run")
    if outcome.ending is Ending.RETURNED and isinstance(outcome.value, AssetRecord):
        write_refused_answers(out, ref.asset_id, heard, outcome.value.calls)
        return AssetAttempt(outcome.value, death_of_engine(outcome.value))
    record = record_of_dead_child(ref, out, settings, outcome, tuple(calls))
    return AssetAttempt(record, record.reason if outcome.ending in RETRIED_ENDINGS else "")


def death_of_engine(record: AssetRecord) -> str:
    """How an engine's process died, in words, if the asset failed because of it; else empty. An engine has a process of
    its own below the asset's, which survives it and reports the death."""
    if record.failure_mode not in (FailureMode.ENGINE_CRASH, FailureMode.TIMEOUT):
        return ""
    return next((report.problem or "" for report in record.reports if report.died), "")


def record_of_dead_child(
    ref: AssetRef, out: Path, settings: Settings, outcome: Outcome, calls: tuple[ModelCall, ...]
) -> AssetRecord:
    """The failed record of an asset whose process did not come back with one."""
    mode = MODES.get(outcome.ending, FailureMode.ENGINE_CRASH)
    reason = outcome.reason or f"the pipeline returned {type(outcome.value).__name__} instead of a record"
    log = log_file(out, ref.asset_id)
    if log.exists():
        reason = f"{reason} (see {log.relative_to(out)})"
    return failed_record(ref, settings, mode, reason, seconds={"total": outcome.seconds}, calls=calls)


def failed_record(
    ref: AssetRef,
    settings: Settings,
    mode: FailureMode,
    reason: str,
    *,
    seconds: dict[str, float] | None = None,
    calls: tuple[ModelCall, ...] = (),
) -> AssetRecord:
    """A failed record that holds only its failure mode and reason, with one finding that says the same."""
    message = f"asset {ref.asset_id}: {reason}"
    record = AssetRecord(
        ref=ref,
        category=ref.category or "unknown",
        method=settings.method,
        model=settings.model.model,
        status=Status.FAILED,
        failure_mode=mode,
        reason=reason,
        findings=(Finding(stage=Stage.REFINE, severity=Severity.ERROR, code=mode.value, message=message),),
        calls=calls,
        seconds=seconds or {},
    )
    return record.model_copy(update={"expected": expectations_met(record)})


def with_first_attempt(record: AssetRecord, first: FirstAttempt, died: str) -> AssetRecord:
    """The second attempt's record with the first one's calls and cause of death; ``died``: how the second died."""
    asset_id, calls = record.ref.asset_id, (*first.calls, *record.calls)
    # The log has been moved out of the second attempt's way.
    before = first.died.replace(log_file(Path(), asset_id).name, first_log_file(Path(), asset_id).name)
    if not died:
        said = f"asset {asset_id}: its first attempt died ({before}); this is the second, alone"
        finding = warning(Stage.REFINE, DIED_ONCE, said)
        return record.model_copy(update={"calls": calls, "findings": (*record.findings, finding)})
    reason = f"died twice: {died}; the first time: {before}"
    message = f"asset {asset_id}: {reason}"
    findings = tuple(
        finding.model_copy(update={"message": message}) if finding.code == record.failure_mode else finding
        for finding in record.findings
    )
    record = record.model_copy(update={"calls": calls, "reason": reason, "findings": findings})
    return record.model_copy(update={"expected": expectations_met(record)})


def without_retry(record: AssetRecord, first: FirstAttempt, most: int) -> AssetRecord:
    """The record of an asset that died and gets no second attempt, with a finding that says so."""
    said = (
        f"asset {record.ref.asset_id} was not tried again: {most} others of this run were, one after the other; the "
        "next run tries it"
    )
    finding = remark(Stage.REFINE, NOT_TRIED_AGAIN, said)
    return record.model_copy(update={"calls": record.calls or first.calls, "findings": (*record.findings, finding)})
