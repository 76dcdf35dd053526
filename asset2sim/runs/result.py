"""The result of a run, its exit code, and the hook: a user's shell command that gets it in environment variables.

Nothing of a run is put into the command's text, so that no asset's name or message can inject shell code.
"""

import os
import re
import signal
import subprocess
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from asset2sim.catalog.changes import Changes
from asset2sim.catalog.rows import run_cost
from asset2sim.catalog.run import RunRow
from schemas.asset import AssetSummary, Unchanged
from schemas.errors import DONE, FAILED, GATE, STOPPED, error_exit_code
from schemas.location import Location
from schemas.secret import REDACTED
from schemas.settings import RunSettings
from schemas.vocabulary import Gate, Status

INTERRUPTED = "interrupted"
"""Value of ``RunResult.stopped`` for a run that the user stopped."""


@dataclass(frozen=True)
class RunResult:
    """A run that is in the catalog. ``stopped`` says why not every asset is; ``warnings`` what else went wrong;
    ``unchanged`` are the assets not refined again, ``report`` is the index of the run's report, if it wrote one, and
    ``changes`` the differences from the catalog before it. ``out`` is the folder in which the run worked; ``place`` is
    the output as the user named it, None if that is ``out``; ``removed`` are lines that say what was too old to
    keep."""

    out: Path
    run: RunRow
    records: tuple[AssetSummary, ...]
    stopped: str | None
    warnings: tuple[str, ...]
    unchanged: tuple[Unchanged, ...] = ()
    report: Path | None = None
    changes: Changes | None = None
    place: Location | None = None
    removed: tuple[str, ...] = ()

    @property
    def every(self) -> tuple[AssetSummary | Unchanged, ...]:
        """All assets of the run, unchanged ones too."""
        return (*self.records, *self.unchanged)

    def shown(self, *parts: str) -> Location:
        """Path or URL of the output as the user named it, or of ``parts`` below it."""
        return Location(self.place or self.out).below(*parts)

    @property
    def shown_report(self) -> Location | None:
        """Path or URL of the report, below the output as the user named it."""
        return None if self.report is None else self.shown(*self.report.relative_to(self.out).parts)


PREFIX = "ASSET2SIM_"
MAX_VALUE = 4096
"""Characters of one variable: far below what any system takes, and enough for a path or a message."""
_IMPOSSIBLE = re.compile("[\0\ud800-\udc7f\udd00-\udfff]")
"""Characters that an environment cannot hold; it can hold undecodable bytes of a file name (U+DC80 to U+DCFF)."""
REAP_LIMIT_S = 5.0
"""Longest wait for a killed hook to exit, s."""


def exit_code(result: RunResult, strict: bool) -> int:
    """0; 130 for an interrupted run; 1 for one that stopped otherwise, and under ``strict`` if an asset failed; 3 for
    one that missed a gate of severity ``error``."""
    if result.stopped is not None:
        return STOPPED if result.stopped == INTERRUPTED else FAILED
    if strict and any(item.status is Status.FAILED for item in result.every):
        return FAILED
    return GATE if missed_gates(result) and result.run.settings.run.gate is Gate.ERROR else DONE


def missed_gates(result: RunResult) -> tuple[str, ...]:
    """A sentence for each gate of the run's settings that it missed."""
    run, every = result.run.settings.run, result.every
    ok, new = sum(item.status is Status.OK for item in every), _new_failures(result)
    missed = []
    # In whole assets: 0.95 of 20 is 19, whatever floating point makes of it.
    if run.min_success is not None and every and ok / len(every) < run.min_success - 1e-9:
        share = f"{ok} of {len(every)} assets are ok ({100.0 * ok / len(every):.1f} %)"
        missed.append(f"{share}, the gate --min-success asks for {100.0 * run.min_success:g} %")
    if run.max_new_failures is not None and new > run.max_new_failures:
        missed.append(
            f"{new} new failure{'' if new == 1 else 's'}, the gate --max-new-failures allows {run.max_new_failures}"
        )
    return tuple(missed)


def _new_failures(result: RunResult) -> int:
    """Assets that failed and did not before; without a comparison every failure counts."""
    if result.changes is not None:
        return len(result.changes.new_failures)
    return sum(record.status is Status.FAILED for record in result.records)


def alert(result: RunResult, strict: bool) -> RunResult:
    """Run the hook of the settings, if any; its failure and the gates missed are more warnings of the result."""
    settings = result.run.settings.run
    missed = tuple(f"gate ({settings.gate}): {sentence}" for sentence in missed_gates(result))
    if missed:
        result = replace(result, warnings=(*result.warnings, *missed))
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
    every, cost, changes = result.every, run_cost(result.records), result.changes
    ok = sum(item.status is Status.OK for item in every)
    return {
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
        "gate": " · ".join(missed_gates(result)),
        "mended": len(changes.mended) if changes else 0,
        "queries": cost["queries"],
        "cost_usd": f"{cost['cost_usd']:.4f}",
        "seconds": f"{(result.run.finished_at - result.run.started_at).total_seconds():.0f}",
        "warnings": " · ".join(result.warnings),
    }


def run_hook(command: str, values: Mapping[str, object], limit_s: float) -> str | None:
    """Run ``command`` in a shell for at most ``limit_s`` s, with each value as ``ASSET2SIM_<NAME>`` in its environment.

    Returns None, or a one-line warning where it failed; its standard error is passed on, not kept. A hook that takes
    too long, or whose run is interrupted meanwhile, is killed with every process that it started.
    """
    if command == REDACTED:
        return "the hook did not run: what it is was not kept; start `asset2sim nightly` again"
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
    **dict.fromkeys(("outcome", "exit", "error", "out", "run_id", "report", "gate", "warnings"), ""),
    **dict.fromkeys(("assets", "unchanged", "ok", "failed", "new_failures", "mended"), 0),
    **dict.fromkeys(("queries", "cost_usd", "seconds"), 0),
}
