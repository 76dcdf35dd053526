"""The run's report, HTML under OUT and a page of the flow run in Prefect, and the lines that a nightly prints."""

import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from uuid import UUID

from prefect.artifacts import create_markdown_artifact
from prefect.runtime import flow_run

from asset2sim.catalog.changes import Changes, Previous, find_changes
from asset2sim.catalog.run import RunRow
from asset2sim.catalog.summary import headline, run_page
from asset2sim.catalog.text import output
from asset2sim.runs.request import RefineRequest
from asset2sim.runs.result import INTERRUPTED, RunResult
from asset2sim.runs.spread.refine_all import RunRecords
from flows.server.client import count_skipped_runs
from schemas.asset import AssetSummary
from schemas.errors import complain
from schemas.location import Location

ARTIFACT = "report"
"""Key of the artifact: Prefect keeps the versions of one key together, a night each."""


@dataclass(frozen=True)
class WrittenReport:
    """The run's changes, warnings where a report could not be written, and the report's index, where there is one."""

    changes: Changes
    warnings: tuple[str, ...]
    index: Path | None = None


def publish_report(
    out: Path,
    run: RunRow,
    refined: RunRecords[AssetSummary],
    previous: Previous,
    chosen: int,
    died: str | None,
    by_hand: str | None = None,
    url: str | None = None,
) -> WrittenReport:
    """Write the HTML report, behind ``url`` too where the output is one, and attach a page in Markdown to the flow run.
    A failure is a warning only: the tables hold the same data.
    ``chosen`` counts the run's assets; ``died`` says what happened to the run before it, if that did not end;
    ``by_hand`` which results people changed since."""
    changes = find_changes(refined.records, previous)
    warnings = [problem for problem in (died, by_hand, skipped_nights(run.started_at)) if problem]
    problems = [problem for problem in (stopped_line(refined, chosen), previous.problem, *warnings) if problem]
    index, warning = _publish_site(out, run, refined, url)
    warnings += [warning] if warning else []
    place = str(Location(url or out).below(*index.relative_to(out).parts)) if index else None
    page = run_page(run, refined.records, changes, problems, refined.unchanged, place)
    try:
        create_markdown_artifact(page, key=ARTIFACT, description=f"run {run.run_id}")
    except Exception as error:  # whatever a server can raise, and whatever way it goes away
        warnings.append(f"Prefect does not hold the report of run {run.run_id}: {str(error).splitlines()[0]}")
    return WrittenReport(changes, tuple(warnings), index)


def _publish_site(
    out: Path, run: RunRow, refined: RunRecords[AssetSummary], url: str | None
) -> tuple[Path | None, str | None]:
    """Write the HTML report, and return its index; None, and a warning, where that fails, and None where the run
    is to have none or was interrupted: then its user waits."""
    if not run.settings.run.report or refined.stopped == INTERRUPTED:
        return None, None
    # Late: a run without a report needs none of it.
    from asset2sim.report.site import write_site

    try:
        before = run.settings.views.write
        site = write_site(out, url, workers=run.settings.run.workers, before=before, loops=False)
    except Exception as error:  # whatever is wrong with it, the run's results are there
        why = (str(error).splitlines() or [type(error).__name__])[0]
        return None, f"the report of run {run.run_id} was not written: {why}; asset2sim report tries again"
    return site.index, None


def stopped_line(refined: RunRecords[AssetSummary], chosen: int) -> str | None:
    """Why the run stopped, where it did, and how far it came."""
    if refined.stopped is None:
        return None
    unseen = chosen - len(refined.records) - len(refined.unchanged)
    return f"{refined.stopped}: {unseen} of {chosen} assets were not seen to" if unseen else refined.stopped


def skipped_nights(since: datetime) -> str | None:
    """A sentence on the nights skipped after ``since`` because this run was at work; None where there were none."""
    try:
        deployment = flow_run.parent_deployment_id
        missed = count_skipped_runs(UUID(str(deployment)), since) if deployment else 0
    except Exception as error:  # whatever a server can raise
        return f"Prefect does not say whether a night was left out: {str(error).splitlines()[0]}"
    if not missed:
        return None
    were = "1 night was" if missed == 1 else f"{missed} nights were"
    return f"{were} left out, since this run was at work when the time came"


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
