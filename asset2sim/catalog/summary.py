"""The summary of a run for the terminal: one line per asset and a line of totals."""

from collections.abc import Iterator, Sequence
from statistics import fmean

from rich import box
from rich.table import Table
from rich.text import Text

from asset2sim.catalog.run_figures import expected_counts, joint_deviations, run_figures
from asset2sim.catalog.text import NOTHING, number
from schemas.settings import Thresholds
from schemas.summary import AssetSummary
from schemas.vocabulary import Status

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
        touching = f"mean over {figures['penetrating_assets']:.0f} not zero {number(mean, 'mm')}"
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
        number(record.scale),
        number(record.mass_kg),
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
