"""The run's report: a file under OUT, and a page of the flow run in Prefect."""

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from uuid import UUID

from prefect.artifacts import create_markdown_artifact
from prefect.runtime import flow_run

from asset2sim.catalog.changes import Changes, Previous, find_changes
from asset2sim.catalog.report import report_markdown
from asset2sim.catalog.report_file import write_report
from asset2sim.catalog.run import RunRow
from asset2sim.runs.spread.refine_all import RunRecords
from flows.server.deployment import count_skipped_runs
from schemas.summary import AssetSummary

ARTIFACT = "report"
"""Key of the artifact: Prefect keeps the versions of one key together, a night each."""


@dataclass(frozen=True)
class WrittenReport:
    """What the run changed, the file with its report, and warnings where the report could not be written."""

    changes: Changes
    path: Path | None
    warnings: tuple[str, ...]


def publish_report(
    out: Path,
    run: RunRow,
    refined: RunRecords[AssetSummary],
    previous: Previous,
    chosen: int,
    died: str | None,
    by_hand: str | None = None,
) -> WrittenReport:
    """Write the report and attach it to the flow run. A failure is a warning only: the tables hold the same data.
    ``chosen`` counts the run's assets; ``died`` says what happened to the run before it, if that did not end;
    ``by_hand`` which results people changed since."""
    changes = find_changes(refined.records, previous)
    warnings = [problem for problem in (died, by_hand, skipped_nights(run.started_at)) if problem]
    problems = [problem for problem in (stopped_line(refined, chosen), previous.problem, *warnings) if problem]
    text = report_markdown(run, refined.records, previous, changes, problems, refined.unchanged, str(out))
    path = None
    try:
        path = write_report(out, run, text)
    except (OSError, UnicodeError) as error:
        warnings.append(f"the report of run {run.run_id} is not in {out}: {error}")
    try:
        create_markdown_artifact(text, key=ARTIFACT, description=f"run {run.run_id}")
    except Exception as error:  # whatever a server can raise, and whatever way it goes away
        warnings.append(f"Prefect does not hold the report of run {run.run_id}: {str(error).splitlines()[0]}")
    return WrittenReport(changes, path, tuple(warnings))


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
