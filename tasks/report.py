"""The run's report: a file under OUT, and Prefect's page of the run."""

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from prefect import task
from prefect.artifacts import create_markdown_artifact
from prefect.cache_policies import NO_CACHE

from asset2sim.catalog.changes import Changes, Previous, find_changes
from asset2sim.catalog.previous import read_previous
from asset2sim.catalog.report import report_markdown
from asset2sim.catalog.report_file import write_report
from asset2sim.catalog.run import RunRow
from asset2sim.fanout.refine import Refined

ARTIFACT = "report"
"""Key of the artifact: Prefect keeps the versions of one key together, a night each."""


@dataclass(frozen=True)
class Reported:
    """What the run changed, the file with its report, and what kept the report from where it should be."""

    changes: Changes
    path: Path | None
    warnings: tuple[str, ...]


@task(name="find-previous", cache_policy=NO_CACHE, persist_result=False)
def find_previous(out: Path, run: RunRow, present: Collection[str] | None = None) -> Previous:
    """What the catalog holds before the run is published; see ``asset2sim.catalog.previous.read_previous``."""
    return read_previous(out, run, present)


@task(name="report", cache_policy=NO_CACHE, persist_result=False)
def report(out: Path, run: RunRow, refined: Refined, previous: Previous) -> Reported:
    """Write the report and attach it to the flow run. What cannot be kept is a warning: the tables hold all of it."""
    changes = find_changes(refined.records, previous)
    problems = [problem for problem in (refined.stopped, previous.problem) if problem]
    text = report_markdown(run, refined.records, previous, changes, problems, len(refined.unchanged))
    warnings, path = [], None
    try:
        path = write_report(out, run, text)
    except (OSError, UnicodeError) as error:
        warnings.append(f"the report of run {run.run_id} is not in {out}: {error}")
    try:
        create_markdown_artifact(text, key=ARTIFACT, description=f"run {run.run_id}")
    except Exception as error:  # whatever a server can raise, and whatever way it goes away
        warnings.append(f"Prefect does not hold the report of run {run.run_id}: {str(error).splitlines()[0]}")
    return Reported(changes, path, tuple(warnings))
