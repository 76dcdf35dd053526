"""A run in one line, and as the page that Prefect shows of it: figures, new failures, mended assets."""

import re
from collections.abc import Sequence

from asset2sim.catalog.changes import AssetChange, Changes
from asset2sim.catalog.run import RunRow
from asset2sim.catalog.run_figures import failure_counts
from asset2sim.catalog.summary import totals_line
from asset2sim.catalog.text import markdown_table
from schemas.asset import Unchanged
from schemas.errors import shortened
from schemas.model_names import described
from schemas.summary import AssetSummary
from schemas.vocabulary import FailureMode, Status

MAX_LISTED = 20
"""Assets that one list names; the tables hold all."""
MAX_REASON = 240
"""Characters of a reason in a table's cell."""

_SPECIAL = re.compile(r"([\\`*\[\]<>|~]|(?<![A-Za-z0-9])_|_(?![A-Za-z0-9]))")


def headline(records: Sequence[AssetSummary], changes: Changes, unchanged: Sequence[Unchanged] = ()) -> str:
    """One line: assets that pass (unchanged ones included), new failures, mended, gone and unchanged assets."""
    every: list[AssetSummary | Unchanged] = [*records, *unchanged]
    ok = sum(item.status is Status.OK for item in every)
    parts = [f"{ok} of {len(every)} ok"] if every else ["no assets"]
    new = len(changes.new_failures)
    parts.append(f"{new} new failure{'' if new == 1 else 's'}")
    others = (("mended", len(changes.mended)), ("gone", len(changes.gone)), ("unchanged", len(unchanged)))
    return ", ".join([*parts, *(f"{count} {name}" for name, count in others if count)])


def run_page(
    run: RunRow,
    records: Sequence[AssetSummary],
    changes: Changes,
    problems: Sequence[str] = (),
    unchanged: Sequence[Unchanged] = (),
    report: str | None = None,
) -> str:
    """Markdown of bounded length: headline, ``problems``, totals, failure modes, new failures and mended assets.
    ``problems`` are other errors, first the reason why the run stopped; ``report`` is where its HTML report is."""
    stopped = "" if run.outcome == "finished" else f"{run.outcome.capitalize()}: "
    modes = {mode: count for mode, count in failure_counts([*records, *unchanged]).items() if count}
    parts = [
        f"# {stopped}{headline(records, changes, unchanged)}",
        _about(run),
        *(f"> **{escape(problem)}**" for problem in problems),
        escape(totals_line(records, run.settings.thresholds)) if records else "",
        ", ".join(f"`{mode.value}` {count}" for mode, count in sorted(modes.items(), key=lambda item: -item[1])),
        _list("New failures", changes.new_failures),
        _list("Mended", changes.mended),
        f"Every object with its pictures, numbers and reasons: `{report}`." if report else "",
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def escape(text: str) -> str:
    """Text as one line, with Markdown's special characters escaped."""
    return _SPECIAL.sub(r"\\\1", " ".join(text.split()))


def _about(run: RunRow) -> str:
    commit = f"commit `{run.git_commit[:12]}`{' with changes' if run.git_dirty else ''}" if run.git_commit else None
    parts = [
        f"Run `{run.run_id}`, {run.outcome}",
        f"from {run.started_at:%Y-%m-%d %H:%M} to {run.finished_at:%H:%M} UTC",
        f"dataset {escape(run.dataset)}" + (f", subset {escape(run.subset)}" if run.subset else ""),
        f"method {escape(run.settings.method.value)}, model {escape(described(run.settings.model.model))}",
    ]
    return " · ".join([*parts, *([commit] if commit else [])])


def _list(title: str, items: Sequence[AssetChange]) -> str:
    if not items:
        return ""
    more = f"\n\n… and {len(items) - MAX_LISTED} more." if len(items) > MAX_LISTED else ""
    rows = [_cells(item) for item in items[:MAX_LISTED]]
    table = markdown_table(("asset", "category", "was", "is", "why"), rows)
    return f"## {title}: {len(items)}\n\n{table}{more}"


def _cells(item: AssetChange) -> tuple[str, ...]:
    record = item.record
    why = escape(shortened(record.reason, MAX_REASON)) if record.status is Status.FAILED else ""
    modes = (_mode(item.was), _mode(record.failure_mode.value))
    return escape(record.ref.asset_id), escape(record.category), *modes, why


def _mode(mode: str | None) -> str:
    if mode is None:
        return "not there"
    return "ok" if mode == FailureMode.NONE else f"`{mode}`"
