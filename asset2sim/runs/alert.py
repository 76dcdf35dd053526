"""The hook, a user's shell command that gets a run's result in environment variables, and the run's exit code.

Nothing of a run is put into the command's text, so that no asset's name or message can inject shell code.
"""

import os
import re
import signal
import subprocess
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from asset2sim.catalog.rows import run_cost
from asset2sim.runs.result import INTERRUPTED, RunResult
from schemas.asset import Unchanged
from schemas.errors import DONE, FAILED, STOPPED, error_exit_code
from schemas.settings import RunSettings
from schemas.summary import AssetSummary
from schemas.vocabulary import Status

PREFIX = "ASSET2SIM_"
MAX_VALUE = 4096
"""Characters of one variable: far below what any system takes, and enough for a path or a message."""
_IMPOSSIBLE = re.compile("[\0\ud800-\udc7f\udd00-\udfff]")
"""Characters that an environment cannot hold; it can hold undecodable bytes of a file name (U+DC80 to U+DCFF)."""
REAP_LIMIT_S = 5.0
"""Longest wait for a killed hook to exit, s."""


def exit_code(result: RunResult, strict: bool) -> int:
    """0; 130 for an interrupted run; 1 for one that stopped otherwise, and under ``strict`` if an asset failed."""
    if result.stopped is not None:
        return STOPPED if result.stopped == INTERRUPTED else FAILED
    every: list[AssetSummary | Unchanged] = [*result.records, *result.unchanged]
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
    said = str(error) or type(error).__name__
    values = {"outcome": "failed", "exit": error_exit_code(error), "error": said, "out": out}
    return run_hook(settings.hook, _EMPTY | values, settings.hook_time_limit_s)


def hook_values(result: RunResult, strict: bool) -> dict[str, object]:
    """Values for the hook, by lower-case name; the same names for every run, empty where there is no value.

    ``assets``, ``ok`` and ``failed`` count unchanged assets too, as the report, MLflow and the exit code do.
    """
    every: list[AssetSummary | Unchanged] = [*result.records, *result.unchanged]
    ok = sum(item.status is Status.OK for item in every)
    cost = run_cost(result.records)
    changes = result.changes
    values: dict[str, object] = {
        "outcome": result.run.outcome,
        "exit": exit_code(result, strict),
        "error": result.stopped,
        "out": result.shown(),
        "run_id": result.run.run_id,
        "report": result.shown_report,
        "assets": len(every),
        "unchanged": len(result.unchanged),
        "ok": ok,
        "failed": len(every) - ok,
        "new_failures": len(changes.new_failures) if changes else 0,
        "mended": len(changes.mended) if changes else 0,
        "queries": cost["queries"],
        "cost_usd": f"{cost['cost_usd']:.4f}",
        "seconds": f"{(result.run.finished_at - result.run.started_at).total_seconds():.0f}",
        "warnings": " · ".join(result.warnings),
    }
    return _EMPTY | values


def run_hook(command: str, values: Mapping[str, object], limit_s: float) -> str | None:
    """Run ``command`` in a shell for at most ``limit_s`` s, with each value as ``ASSET2SIM_<NAME>`` in its environment.

    Returns None, or a one-line warning where it failed; its standard error is passed on, not kept. A hook that takes
    too long, or whose run is interrupted meanwhile, is killed with every process that it started.
    """
    try:
        process = subprocess.Popen(
            ["/bin/sh", "-c", command],
            env={**os.environ, **hook_environment(values)},
            stdin=subprocess.DEVNULL,
            start_new_session=True,
        )
    except (OSError, ValueError) as error:
        return f"the hook did not start: {error}"
    try:
        code = process.wait(timeout=limit_s)
    except subprocess.TimeoutExpired:
        _kill(process)
        return f"the hook was killed after {limit_s:g} s; see run.hook_time_limit_s"
    except BaseException:
        _kill(process)
        raise
    if code < 0:
        return f"the hook was killed by {signal.Signals(-code).name}"
    return f"the hook ended with exit code {code}" if code else None


def hook_environment(values: Mapping[str, object]) -> dict[str, str]:
    """Name → value as an environment takes it: prefixed and in capitals, without zero bytes, of bounded length."""
    shown = {name: "" if value is None else str(value) for name, value in values.items()}
    return {f"{PREFIX}{name.upper()}": _IMPOSSIBLE.sub("", text)[:MAX_VALUE] for name, text in shown.items()}


def _kill(process: subprocess.Popen[bytes]) -> None:
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    with suppress(subprocess.TimeoutExpired):
        process.wait(timeout=REAP_LIMIT_S)


_EMPTY: dict[str, object] = {
    **dict.fromkeys(("outcome", "exit", "error", "out", "run_id", "report", "warnings"), ""),
    **dict.fromkeys(("assets", "unchanged", "ok", "failed", "new_failures", "mended"), 0),
    **dict.fromkeys(("queries", "cost_usd", "seconds"), 0),
}
