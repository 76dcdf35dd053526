"""Running the user's hook after a run: the values that it gets, and the run's exit code."""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from asset2sim.runs.hook import run_hook
from asset2sim.runs.result import INTERRUPTED, RunResult
from schemas.asset import AssetRecord, Unchanged
from schemas.errors import Asset2SimError, UsageError
from schemas.settings import RunSettings
from schemas.vocabulary import Status

DONE, FAILED, MISTAKE, STOPPED = 0, 1, 2, 130


def exit_code(result: RunResult, strict: bool) -> int:
    """0; 130 for an interrupted run; 1 for one that stopped otherwise, and under ``strict`` if an asset failed."""
    if result.stopped is not None:
        return STOPPED if result.stopped == INTERRUPTED else FAILED
    every: list[AssetRecord | Unchanged] = [*result.records, *result.unchanged]
    return FAILED if strict and any(item.status is Status.FAILED for item in every) else DONE


def alert(result: RunResult, strict: bool) -> RunResult:
    """Run the hook of the run's settings, if there is one; its failure is one more warning of the result."""
    settings = result.run.settings.run
    if settings.hook is None:
        return result
    warning = run_hook(settings.hook, hook_values(result, strict), settings.hook_time_limit_s)
    return result if warning is None else replace(result, warnings=(*result.warnings, warning))


def alert_error(out: Path | str, settings: RunSettings, error: BaseException) -> str | None:
    """Run the hook for a run that ended in an error; returns a warning where the hook failed."""
    if settings.hook is None:
        return None
    values = {
        "outcome": "failed",
        "exit": error_exit_code(error),
        "error": str(error) or type(error).__name__,
        "out": out,
    }
    return run_hook(settings.hook, _EMPTY | values, settings.hook_time_limit_s)


def error_exit_code(error: BaseException) -> int:
    """Exit code for an error that ended a run before it had a result."""
    if isinstance(error, KeyboardInterrupt):
        return STOPPED
    return MISTAKE if isinstance(error, UsageError) else FAILED


def run_program(name: str, run: Callable[[], int]) -> int:
    """Exit code of ``run``; a user's mistake, a failure that we know and Ctrl-C are one line on standard error."""
    try:
        return run()
    except (Asset2SimError, KeyboardInterrupt) as error:
        said = "interrupted" if isinstance(error, KeyboardInterrupt) else str(error)
        sys.stderr.write(f"{name}: {said}\n")
        return error_exit_code(error)


def hook_values(result: RunResult, strict: bool) -> dict[str, object]:
    """Values for the hook, by lower-case name; the same names for every run, empty where there is no value."""
    ok = sum(record.status is Status.OK for record in result.records)
    paid = [call for record in result.records for call in record.calls if not call.cached]
    changes = result.changes
    values: dict[str, object] = {
        "outcome": result.run.outcome,
        "exit": exit_code(result, strict),
        "error": result.stopped,
        "out": result.shown(),
        "run_id": result.run.run_id,
        "report": result.shown_report,
        "assets": len(result.records),
        "unchanged": len(result.unchanged),
        "ok": ok,
        "failed": len(result.records) - ok,
        "new_failures": len(changes.new_failures) if changes else 0,
        "mended": len(changes.mended) if changes else 0,
        "queries": len(paid),
        "cost_usd": f"{sum(call.cost_usd for call in paid):.4f}",
        "seconds": f"{(result.run.finished_at - result.run.started_at).total_seconds():.0f}",
        "warnings": " · ".join(result.warnings),
    }
    return _EMPTY | values


_EMPTY: dict[str, object] = {
    **dict.fromkeys(("outcome", "exit", "error", "out", "run_id", "report", "warnings"), ""),
    **dict.fromkeys(("assets", "unchanged", "ok", "failed", "new_failures", "mended"), 0),
    **dict.fromkeys(("queries", "cost_usd", "seconds"), 0),
}
