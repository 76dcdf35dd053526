"""The summary of a run: for the terminal, in one line, and as the page in Markdown that Prefect shows of it."""

import re
from collections.abc import Iterator, Sequence
from statistics import fmean

from rich import box
from rich.table import Table
from rich.text import Text

from asset2sim.catalog.changes import AssetChange, Changes
from asset2sim.catalog.run import RunRow
from asset2sim.catalog.run_figures import expected_counts, failure_counts, joint_deviations, run_figures
from asset2sim.catalog.text import NOTHING, markdown_table, significant
from schemas.asset import AssetSummary, Unchanged
from schemas.errors import shortened
from schemas.model_names import described
from schemas.settings import Thresholds
from schemas.vocabulary import FailureMode, Status

_HEADINGS = ("scale", "mass\nkg", "Φ\nmm", "drift\nmm", "drift\nrad", "sims", "calls", "s")


PAGE = 500
"""Rows of one table: rich keeps some 7 kB of each until the table is printed."""


def summary_tables(records: Sequence[AssetSummary], limits: Thresholds) -> Iterator[Table]:
    """Tables of ``PAGE`` assets for terminals of at least 100 columns; failed assets come last, nearest to the prompt,
    and the last table's caption holds the totals."""
    ordered = sorted(records, key=lambda record: record.status is not Status.OK)
    for first in range(0, max(1, len(ordered)), PAGE):
        table = _table(ordered[first : first + PAGE])
        if first + PAGE >= len(ordered):
            table.caption = totals_line(records, limits)
        yield table


def _table(records: Sequence[AssetSummary]) -> Table:
    """A row an asset; the verdict column holds the failure mode of one that failed."""
    table = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0), caption_justify="left")
    # Every failure mode fits and no number loses a digit: the first two columns give way.
    table.add_column("asset", overflow="fold", min_width=min(8, max((len(r.ref.asset_id) for r in records), default=0)))
    table.add_column("category", overflow="fold", min_width=8)
    table.add_column("verdict", no_wrap=True)
    for heading in _HEADINGS:
        table.add_column(heading, justify="right", no_wrap=True)
    for record in records:
        passed = record.status is Status.OK
        verdict = Text(record.status if passed else record.failure_mode, style="green" if passed else "bold red")
        table.add_row(record.ref.asset_id, record.category, verdict, *_numbers(record))
    return table


def totals_line(records: Sequence[AssetSummary], limits: Thresholds) -> str:
    """Totals of a run in one line."""
    if not records:
        return "no assets"
    figures = run_figures(records, limits)
    parts = [f"{figures['ok']:.0f} of {figures['assets']:.0f} ok ({100.0 * figures['success_rate']:.1f} %)"]
    if measured := figures["measured"]:
        mean = figures.get("penetration_mm_mean_nonzero")
        touching = f"mean over {figures['penetrating_assets']:.0f} not zero {significant(mean, 'mm')}"
        parts.append(f"Φ {touching if mean else 'zero everywhere'}")
        for name in ("drift", "oscillation"):
            parts.append(f"{name} {figures[f'{name}_pass_share'] * measured:.0f}/{measured:.0f}")
    tokens = figures["prompt_tokens"] + figures["completion_tokens"]
    parts += [f"{figures['queries_per_asset']:.2f} calls an asset", f"{tokens:.0f} tokens"]
    parts += [f"{figures['cost_usd']:.2f} USD", f"{sum(record.total_seconds for record in records):.0f} s of work"]
    return " · ".join(parts)


def _numbers(record: AssetSummary) -> list[str]:
    """(8,) cells in the order of ``_HEADINGS``."""
    measured = record.measurement
    moved = measured if measured and measured.finite else None
    return [
        significant(record.scale),
        significant(record.mass_kg),
        _fixed(1000.0 * measured.penetration_m if measured else None, 3),
        _fixed(1000.0 * moved.drift_m if moved else None, 3),
        _fixed(moved.drift_rad if moved else None, 4),
        f"{record.engines[0]}/{record.engines[1]}" if record.engines else NOTHING,
        str(record.queries),
        f"{record.total_seconds:.1f}",
    ]


def _fixed(value: float | None, decimals: int) -> str:
    """Fixed decimals, so that a column can be compared at a glance; an exponent where the number would be too wide."""
    if value is None:
        return NOTHING
    return f"{value:.{decimals}f}" if abs(value) < 1e5 else f"{value:.1e}"


def expected_line(records: Sequence[AssetSummary]) -> str:
    """How many sizes and asked joints are as the dataset's expectations have them; "" without any."""
    met = expected_counts(records)
    if not met:
        return ""
    parts = [f"{name} {count} of {asked}" for name, (count, asked) in met.items() if asked]
    return f"as its readers expect: {', '.join(parts) or 'nothing that could be told'}"


def alignment_line(records: Sequence[AssetSummary]) -> str:
    """Prompt alignment by rubric of the assets without expectations, and mean deviations from the expert reference
    where there is one; "" without assets."""
    found = [record.alignment for record in records if record.alignment is not None]
    if not found:
        return ""
    alone = [record.alignment.value for record in records if record.alignment is not None and not record.expected]
    line = "prompt alignment by rubric: every asset has expectations instead"
    if alone:
        line = f"prompt alignment by rubric {100.0 * fmean(alone):.1f} % over {len(alone)} assets"
    judged = [item.judged.value for item in found if item.judged is not None]
    if judged:
        line += f", by the judge {100.0 * fmean(judged):.1f} % over {len(judged)}"
    every = [(item.scale_deviation, item.reference_states_scale) for item in found]
    scales = [(value, stated) for value, stated in every if value is not None]
    if not scales:
        return line
    stated = [value for value, is_stated in scales if is_stated]
    line += "; off the expert reference: "
    if stated:
        line += f"scale {100.0 * fmean(stated):.1f} % over {len(stated)}"
    if len(stated) < len(scales):
        everyone = 100.0 * fmean([value for value, _ in scales])
        line += (
            f"{' (' if stated else 'scale '}{everyone:.1f} % over {len(scales)}, those whose reference states no scale "
            f"included{')' if stated else ''}"
        )
    for slider, what in ((False, "rad over {} hinges"), (True, "m over {} sliders")):
        if off := joint_deviations(found, slider=slider):
            line += f"{', ' if slider else '; first joint position '}{fmean(off):.3g} {what.format(len(off))}"
    return line


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
