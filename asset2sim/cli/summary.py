"""What a run says at its end."""

import sys

from rich.text import Text

from asset2sim.catalog.failures import failure_breakdown, render_failures
from asset2sim.catalog.summary import alignment_line, summary_table
from asset2sim.cli.console import output
from asset2sim.runs.result import RunResult
from schemas.vocabulary import Status


def print_summary(result: RunResult) -> None:
    """Every refined asset with its verdict, the failure modes, and where the output is."""
    console = output()
    if result.records or not result.unchanged:
        console.print(summary_table(result.records, result.run.settings.thresholds))
        console.print()
    if result.unchanged:
        console.print(Text(unchanged_line(result) + "\n"))
    found = [record.alignment for record in result.records if record.alignment is not None]
    if found:
        console.print(Text(alignment_line(found) + "\n"))
    console.print(render_failures(failure_breakdown(result.out)))
    report = f"\nreport:  {result.shown_report}" if result.report else ""
    console.print(Text(f"assets:  {result.shown('assets')}\ncatalog: {result.shown('catalog')}{report}"))
    sys.stdout.flush()
    for warning in result.warnings:
        sys.stderr.write(f"asset2sim: {warning}\n")
    if result.stopped is not None:
        sys.stderr.write(f"asset2sim: {result.stopped}; {len(result.records)} finished assets are in the catalog\n")


def unchanged_line(result: RunResult) -> str:
    """How many assets there was no need to refine, and how to have them refined."""
    failed = sum(item.status is Status.FAILED for item in result.unchanged)
    every = len(result.unchanged) + len(result.records)
    again = f"; {failed} of them failed, and --retry-failed tries those again" if failed else ""
    return f"{len(result.unchanged)} of {every} assets are unchanged since they were refined{again}"
