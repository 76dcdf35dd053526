"""The lines that a nightly prints on the terminal or into its log."""

import sys
from datetime import UTC, datetime

from asset2sim.catalog.run_page import headline
from asset2sim.catalog.text import output
from asset2sim.runs.request import RefineRequest
from asset2sim.runs.result import RunResult
from schemas.errors import printable


def print_served(request: RefineRequest, schedule: str, following: datetime | None, commands: list[str]) -> None:
    """Print what is served and when, and how to have a night at once."""
    console = output()
    lines = [f"nightly: {request.data!s} into {request.out!s}, on {schedule}"]
    if request.settings_file is not None:
        lines.append(f"settings: {request.settings_file}, read when a night begins")
    lines.append(f"next run: {moment(following)}")
    for line in [*lines, "a night at once, from another terminal:", *(f"  {command}" for command in commands)]:
        console.print(line, soft_wrap=True)
    sys.stdout.flush()


def moment(following: datetime | None, now: datetime | None = None) -> str:
    """A coming moment, and how far off it is; None: no run is planned."""
    if following is None:
        return "none is planned: does the Prefect server run its scheduler?"
    minutes = max(0, round((following - (now or datetime.now(UTC))).total_seconds() / 60.0))
    return f"{following.astimezone(UTC):%Y-%m-%d %H:%M} UTC, in {minutes // 60} h {minutes % 60:02d} min"


def night_line(result: RunResult) -> str:
    """A night in one line: how it went and where its report is."""
    line = f"{len(result.records)} assets"
    if result.changes:
        line = headline(result.records, result.changes, result.unchanged)
    report = f"report: {result.shown_report}" if result.report else None
    return " · ".join(part for part in (result.stopped, line, report) if part is not None)


def print_night(result: RunResult) -> None:
    """Print a night that came to a result, and its warnings."""
    for line in (night_line(result), *result.removed):
        sys.stdout.write(f"run {result.run.run_id}: {line}\n")
    sys.stdout.flush()
    for warning in result.warnings:
        complain(warning)


def complain(message: str) -> None:
    """Print one line on standard error."""
    sys.stdout.flush()
    sys.stderr.write(f"asset2sim: {printable(' '.join(message.split()))}\n")
    sys.stderr.flush()
