"""The commands that print: what a catalog holds, what a run came to, what works here, and where the pages are."""

import sys

import pandas as pd
from rich import box
from rich.table import Table
from rich.text import Text

from asset2sim.catalog.failures import failure_breakdown, render_failures
from asset2sim.catalog.text import NOTHING, cut_text, output
from asset2sim.runs.option_groups import ReportOptions
from asset2sim.runs.options import (
    AskOptions,
    DoctorOptions,
    FailuresOptions,
    QueryOptions,
    RecordOptions,
    SettingsOptions,
    ShowOptions,
    ViewsOptions,
)
from asset2sim.runs.result import RunResult
from flows import PIPELINE
from schemas.errors import DONE, FAILED, complain, printable
from schemas.settings import Settings
from schemas.vocabulary import Grouping, Status


def print_failures(options: FailuresOptions, _: Settings) -> None:
    """Print the failures in ``out``: the latest of each asset, all since a time, each ``reviewed`` or not, or two runs
    compared."""
    from asset2sim.catalog.failures import (
        compare_runs,
        failures_by,
        find_run,
        render_comparison,
        render_failures_by,
        render_reviewed,
        reviewed_failures,
        unreviewed_line,
    )

    out, by, since = options.out, options.by, options.since
    if options.reviewed:
        output().print(render_reviewed(reviewed_failures(out)))
    elif options.compare is not None:
        earlier, later = (find_run(out, name) for name in options.compare)
        output().print(render_comparison(compare_runs(out, earlier, later), earlier, later))
    elif since is None and by is Grouping.FAILURE_MODE:
        output().print(render_failures(failure_breakdown(out)))
        left = unreviewed_line(reviewed_failures(out))
        if left:
            output().print(Text(f"{left}; look at them: asset2sim view --out {out}"))
    else:
        output().print(render_failures_by(failures_by(out, by, since), by, since))


def print_query(options: QueryOptions, _: Settings) -> None:
    """Print the answer to a query over OUT's tables; it reaches other files only where that is allowed."""
    from asset2sim.catalog.read import query

    answer = query(options.out, options.sql, files=options.allow_files)
    if options.csv:
        text = answer.to_csv(index=False)
        # A file or a program gets the values as they are; a terminal would obey escapes among them.
        sys.stdout.write(printable(text) if sys.stdout.isatty() else text)
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
    return Text(NOTHING if missing else cut_text(str(value)))


def print_asset(options: ShowOptions, _: Settings) -> None:
    """Print everything that OUT's catalog has on one asset."""
    from asset2sim.catalog.show import describe_asset

    output().print(describe_asset(options.out, options.asset_id))


def print_settings(options: SettingsOptions, settings: Settings) -> None:
    """Print every setting as a file."""
    from asset2sim.runs.settings_file import settings_text

    sys.stdout.write(settings_text(settings, options.format))


def print_summary(result: RunResult) -> None:
    """Print every refined asset with its verdict, the failure modes, and where the output is."""
    from asset2sim.catalog.summarize import kept_line
    from asset2sim.catalog.summary import alignment_line, expected_line, summary_tables

    console = output()
    if result.records or not result.unchanged:
        for table in summary_tables(result.records, result.run.settings.thresholds):
            console.print(table)
        console.print()
    if result.unchanged:
        console.print(Text(_unchanged_line(result) + "\n"))
    for line in (kept_line(result.records), expected_line(result.records), alignment_line(result.records)):
        if line:
            console.print(Text(line + "\n"))
    console.print(render_failures(failure_breakdown(result.out)))
    report = f"\nreport:  {result.shown_report}" if result.report else ""
    console.print(Text(f"assets:  {result.shown('assets')}\ncatalog: {result.shown('catalog')}{report}"))
    if result.run.settings.inputs.split:
        console.print(Text(f"scenes:  {result.shown('scenes')}"))
    for line in result.removed:
        console.print(Text(line))
    for warning in result.warnings:
        complain(warning)
    if result.stopped is not None:
        complain(f"{result.stopped}; {len(result.records)} finished assets are in the catalog")


def _unchanged_line(result: RunResult) -> str:
    """How many assets there was no need to refine, and how to have them refined."""
    failed = sum(item.status is Status.FAILED for item in result.unchanged)
    every = len(result.unchanged) + len(result.records)
    again = f"; {failed} of them failed, and --retry-failed tries those again" if failed else ""
    return f"{len(result.unchanged)} of {every} assets are unchanged since they were refined{again}"


def print_doctor(options: DoctorOptions, settings: Settings) -> int:
    """Print what works on this machine and what does not. Returns the exit code: 1 where what is needed does not."""
    from asset2sim.runs.doctor import run_all_checks

    checks = run_all_checks(options.out, settings.model)
    table = Table(box=box.SIMPLE_HEAD, show_header=False)
    table.add_column(no_wrap=True)
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for check in checks:
        broken = Text("broken", style="bold red") if check.needed else Text("note", style="yellow")
        table.add_row(Text("ok", style="green") if check.ok else broken, check.name, Text(check.detail))
    output().print(table)
    return DONE if all(check.ok for check in checks if check.needed) else FAILED


def print_recorded(options: RecordOptions, _: Settings) -> None:
    """Record the answers of OUT's latest run, and print what was recorded and what could not be."""
    from asset2sim.runs.record_answers import record_answers

    found = record_answers(options.out, options.folder)
    models = ", ".join(dict.fromkeys(origin.model for origin in found.origins.values() if origin.model))
    output().print(
        Text(
            f"{len(found.texts)} answers for {len(found.assets)} assets{models and f', of {models}'}\n"
            f"run them again with --model recorded/{options.folder}"
        )
    )
    for line in found.lost:
        complain(f"no answer recorded for {line}")


def print_questions(options: AskOptions, settings: Settings) -> int:
    """Write the questions about a dataset's assets that have no answer yet, and print what was written. Returns the
    exit code: 1 where no asset could be asked about."""
    from asset2sim.intake.dataset import load_dataset
    from asset2sim.runs.record_answers import FOLDER, write_questions

    refs, folder = load_dataset(options.data, options.subset, options.assets, options.limit), options.folder
    written = write_questions(refs, folder, settings, PIPELINE)
    for asset_id, reason in written.failed.items():
        complain(f"no question about asset {asset_id}: {reason}")
    if written.answered:
        output().print(Text(f"every question about {len(written.answered)} assets has its answer in {folder}"))
    if not written.origins:
        return DONE if written.answered else FAILED
    output().print(
        Text(
            f"{len(written.origins)} questions in {folder / FOLDER}, each a question.md with pictures, and a "
            f"question.json for programs\nput the answers into {folder}, as {next(iter(written.origins))}, ask again "
            f"for what follows from them, and run them with --model recorded/{folder}"
        )
    )
    return DONE


def print_views(options: ViewsOptions, settings: Settings) -> int:
    """Write the views that are missing in OUT, and print how many. Returns the exit code: 1 where one was not drawn."""
    from asset2sim.runs.later_views import write_missing_views

    drawn = write_missing_views(options.out, settings)
    output().print(Text(f"drew views of {sum(not problem for problem in drawn.values())} assets"))
    for asset_id, problem in drawn.items():
        if problem:
            complain(f"no views of {asset_id}: {problem}")
    return FAILED if any(drawn.values()) else DONE


def print_site(options: ReportOptions, settings: Settings) -> None:
    """Write OUT's report, and print where it is and how many pages were made."""
    from asset2sim.report.site import write_report_of

    site = write_report_of(options.out, workers=settings.run.workers, anew=options.force)
    made = f"{site.written} of {site.pages} objects' pages made anew"
    output().print(Text(f"report: {options.out.below(*site.index.parts[-2:])}\n{made}"))
