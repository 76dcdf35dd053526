"""The commands that print: what a catalog holds, what a run came to, what works here, and where the pages are."""

import sys
from collections.abc import Sequence
from contextlib import suppress
from datetime import datetime
from pathlib import Path

import pandas as pd
from rich import box
from rich.table import Table
from rich.text import Text

from asset2sim.catalog.failures import failure_breakdown, render_failures
from asset2sim.catalog.text import NOTHING, output
from asset2sim.runs.result import RunResult
from schemas.settings import ModelSettings, Settings
from schemas.vocabulary import Grouping, Status

PREFECT_PORT = 4200
MLFLOW_PORT = 5000


def print_failures(
    out: Path | str,
    by: Grouping = Grouping.FAILURE_MODE,
    since: datetime | None = None,
    compare: Sequence[str] | None = None,
) -> None:
    """Print the failures in ``out``: the latest of each asset, all since a time, or two runs compared."""
    from asset2sim.catalog.failures import compare_runs, failures_by, find_run, render_comparison, render_failures_by

    if compare is not None:
        earlier, later = (find_run(out, name) for name in compare)
        output().print(render_comparison(compare_runs(out, earlier, later), earlier, later))
    elif since is None and by is Grouping.FAILURE_MODE:
        output().print(render_failures(failure_breakdown(out)))
    else:
        output().print(render_failures_by(failures_by(out, by, since), by, since))


def print_query(out: Path | str, sql: str, *, csv: bool) -> None:
    """Print the answer to a query over the tables of ``out``."""
    from asset2sim.catalog.read import query

    answer = query(out, sql)
    if csv:
        output().print(Text(answer.to_csv(index=False).rstrip("\n")), soft_wrap=True)
        return
    table = Table(box=box.SIMPLE_HEAD)
    for name in answer.columns:
        numeric = pd.api.types.is_numeric_dtype(answer[name])
        table.add_column(Text(str(name)), justify="right" if numeric else "left", overflow="fold")
    for row in answer.itertuples(index=False, name=None):
        table.add_row(*(_cell(value) for value in row))
    output().print(table)


def _cell(value: object) -> Text:
    if isinstance(value, float) and not pd.isna(value):
        return Text(f"{value:.6g}")
    missing = value is None or value is pd.NaT or (isinstance(value, float) and pd.isna(value)) or value is pd.NA
    return Text(NOTHING if missing else str(value))


def print_asset(out: Path | str, asset_id: str) -> None:
    """Print everything that the catalog in ``out`` has on one asset."""
    from asset2sim.catalog.show import describe_asset

    output().print(describe_asset(out, asset_id))


def print_summary(result: RunResult) -> None:
    """Print every refined asset with its verdict, the failure modes, and where the output is."""
    from asset2sim.catalog.summary import alignment_line, summary_tables

    console = output()
    if result.records or not result.unchanged:
        for table in summary_tables(result.records, result.run.settings.thresholds):
            console.print(table)
        console.print()
    if result.unchanged:
        console.print(Text(_unchanged_line(result) + "\n"))
    found = [record.alignment for record in result.records if record.alignment is not None]
    if found:
        console.print(Text(alignment_line(found) + "\n"))
    console.print(render_failures(failure_breakdown(result.out)))
    report = f"\nreport:  {result.shown_report}" if result.report else ""
    console.print(Text(f"assets:  {result.shown('assets')}\ncatalog: {result.shown('catalog')}{report}"))
    for line in result.removed:
        console.print(Text(line))
    sys.stdout.flush()
    for warning in result.warnings:
        sys.stderr.write(f"asset2sim: {warning}\n")
    if result.stopped is not None:
        sys.stderr.write(f"asset2sim: {result.stopped}; {len(result.records)} finished assets are in the catalog\n")


def _unchanged_line(result: RunResult) -> str:
    """How many assets there was no need to refine, and how to have them refined."""
    failed = sum(item.status is Status.FAILED for item in result.unchanged)
    every = len(result.unchanged) + len(result.records)
    again = f"; {failed} of them failed, and --retry-failed tries those again" if failed else ""
    return f"{len(result.unchanged)} of {every} assets are unchanged since they were refined{again}"


def print_doctor(out: Path | str, model: ModelSettings) -> bool:
    """Print what works on this machine and what does not; returns whether all that is needed works."""
    from asset2sim.runs.doctor import examine

    checks = examine(out, model)
    table = Table(box=box.SIMPLE_HEAD, show_header=False)
    table.add_column(no_wrap=True)
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for check in checks:
        broken = Text("broken", style="bold red") if check.needed else Text("note", style="yellow")
        table.add_row(Text("ok", style="green") if check.ok else broken, check.name, Text(check.detail))
    output().print(table)
    return all(check.ok for check in checks if check.needed)


def print_views(out: Path | str, settings: Settings) -> bool:
    """Write the views that are missing in ``out``, and print how many; returns whether all could be drawn."""
    from asset2sim.runs.later_views import write_missing_views

    drawn = write_missing_views(out, settings)
    output().print(Text(f"drew views of {sum(not problem for problem in drawn.values())} assets"))
    for asset_id, problem in drawn.items():
        if problem:
            sys.stderr.write(f"asset2sim: no views of {asset_id}: {problem}\n")
    return not any(drawn.values())


def print_and_serve_pages(out: Path | str) -> None:
    """Serve the pages of Prefect and MLflow for the runs in ``out`` until interrupted."""
    from flows.programs import run_together

    console = output()
    for name, address in addresses().items():
        console.print(f"{name}: {address}")
    with suppress(KeyboardInterrupt):
        run_together(commands(out))


def commands(out: Path | str) -> dict[str, list[str]]:
    """Name → command line of each server; both listen on 127.0.0.1 only. MLflow shows the runs of this machine."""
    from asset2sim.catalog.mlflow_store import tracking_uri
    from asset2sim.catalog.storage.cache import working_folder

    programs = Path(sys.executable).parent
    return {
        "Prefect": [str(programs / "prefect"), "server", "start", "--host", "127.0.0.1", "--port", str(PREFECT_PORT)],
        "MLflow": [
            *(str(programs / "mlflow"), "server", "--backend-store-uri", tracking_uri(working_folder(out))),
            *("--host", "127.0.0.1", "--port", str(MLFLOW_PORT)),
        ],
    }


def addresses() -> dict[str, str]:
    """Name → URL of its page."""
    return {"Prefect": f"http://127.0.0.1:{PREFECT_PORT}", "MLflow": f"http://127.0.0.1:{MLFLOW_PORT}"}
