"""One runner of experiments: jobs in killable children, spread over Dask's workers, to rows of tables; resumable."""

import sys
import tempfile
import uuid
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Generic, Protocol, TypeVar

import pandas as pd
from distributed import as_completed

from asset2sim.catalog.own_files import OwnFile, read_own_files
from asset2sim.experiments.cluster import open_client
from asset2sim.experiments.interrupt import sigterm_as_interrupt
from asset2sim.experiments.isolation import Ending, Outcome, accept_children, stop_children
from asset2sim.experiments.isolation.supervise import Work, in_child
from schemas.errors import Asset2SimError
from schemas.settings import RunSettings
from schemas.table import Row, Table


class StudyJob(Protocol):
    """One job of a study: the output folder that gets its rows, and the columns of them that are known before."""

    @property
    def out(self) -> Path:
        """The output folder."""

    @property
    def known(self) -> Row:
        """The known columns."""


Job = TypeVar("Job", bound=StudyJob)
FAILED = "failed"
"""Outcome of a job whose child did not come back with a row."""
RECORDED_AT = "recorded_at"
"""Column of the tables of experiments: when a row was made."""

RunWork = Callable[[Work], Outcome]
Told = Callable[[str, Row, int], None]


class StudyError(Asset2SimError):
    """A study of which nothing could be done."""


@dataclass(frozen=True)
class Done:
    """Result of a job: its row, and rows of further tables by name, all without the columns that were known."""

    row: Row
    more: Mapping[str, Sequence[Row]] = field(default_factory=dict)


@dataclass(frozen=True)
class Study(Generic[Job]):
    """An experiment: the table that gets a row of every job, and others that may get some. ``do`` does a job, with a
    function that runs work in a child; ``title`` names it in a line of progress, and ``settled`` says of a job's latest
    row whether the job need not be done again."""

    name: str
    tables: tuple[Table, ...]
    do: Callable[[Job, RunWork], Done]
    title: Callable[[Row], str]
    settled: Callable[[Job, Row], bool] = lambda job, row: False

    @property
    def table(self) -> Table:
        """The table of the jobs."""
        return self.tables[0]


def done_row(outcome: Outcome) -> Row:
    """The row that a child returned, or one that says how it failed."""
    if outcome.ending is Ending.RETURNED and isinstance(outcome.value, dict):
        return outcome.value
    return {"outcome": FAILED, "reason": outcome.reason}


def do_job(study: Study[Job], job: Job, owner: str) -> dict[str, list[Row]]:
    """The whole rows of a job by table. Whatever its child does is a row."""
    done = study.do(job, partial(in_child, owner=owner))
    known, ended = job.known, {RECORDED_AT: datetime.now(UTC)}
    found = {study.table.name: [done.row], **done.more}
    rows = {}
    for table in study.tables:
        columns = dict.fromkeys(table.schema.names)
        own = {name: value for name, value in known.items() if name in columns}
        rows[table.name] = [columns | row | own | ended for row in found.get(table.name, ())]
    return rows


def run_study(
    study: Study[Job],
    jobs: Sequence[Job],
    run: RunSettings,
    told: Told | None = None,
    enough: Callable[[Row], bool] = lambda _: False,
) -> int:
    """Do every job and store its rows in its output; ``told``, by default ``tell``, hears each job's title and row, and
    how many are left. Returns how many were left undone: those that remain once ``enough`` says so of a row. An
    interruption ends the children and keeps the rows so far."""
    files = {out: [OwnFile(out, table) for table in study.tables] for out in dict.fromkeys(job.out for job in jobs)}
    owner, left = f"{study.name}-{uuid.uuid4().hex}", len(jobs)
    accept_children(owner)
    with tempfile.TemporaryDirectory() as place, sigterm_as_interrupt(), open_client(run, Path(place)) as client:
        try:
            futures = {client.submit(do_job, study, job, owner, pure=False): job for job in jobs}
            for future in as_completed(futures):
                rows = future.result()
                for file in files[futures[future].out]:
                    if rows[file.table.name]:
                        file.add(rows[file.table.name])
                left -= 1
                (row,) = rows[study.table.name]
                (told or tell)(study.title(row), row, left)
                if enough(row):
                    break
        finally:
            stop_children(owner)
    return left


def left_to_do(study: Study[Job], jobs: Sequence[Job]) -> list[Job]:
    """The jobs without a row, or whose latest does not settle them."""
    key = list(study.table.key)
    kept: dict[Path, dict[tuple[object, ...], Row]] = {}
    for out in dict.fromkeys(job.out for job in jobs):
        rows = latest_own([out], study.table).astype(object)
        found: list[Row] = rows.where(rows.notna(), None).to_dict("records")  # type: ignore[assignment]
        kept[out] = {tuple(row[name] for name in key): row for row in found}

    def is_settled(job: Job) -> bool:
        known = job.known
        row = kept[job.out].get(tuple(known[name] for name in key))
        return row is not None and study.settled(job, row)

    return [job for job in jobs if not is_settled(job)]


def tell(title: str, row: Row, left: int) -> None:
    """A line about a job that has ended, on standard error."""
    why = f": {row['reason']}" if row["reason"] else ""
    sys.stderr.write(f"{title}: {row['outcome']}{why}; {left} left\n")


def telling(rows: list[Row]) -> Told:
    """``tell``, which keeps the rows too."""

    def told(title: str, row: Row, left: int) -> None:
        tell(title, row, left)
        rows.append(row)

    return told


def require_one_done(
    rows: Sequence[Row], what: str, undone: Callable[[Row], bool] = lambda row: row["outcome"] == FAILED
) -> None:
    """Raise StudyError where there are rows and every one is of a job that was not done."""
    if rows and all(map(undone, rows)):
        raise StudyError(f"none of {len(rows)} {what} could be done, the last: {rows[-1]['reason']}")


def latest_own(outs: Sequence[Path | str], table: Table) -> pd.DataFrame:
    """The latest row of every key of an experiment's table in these outputs, in the keys' order."""
    frames = [read_own_files(out, table) for out in outs]
    whole = pd.concat(frames, ignore_index=True) if frames else pd.DataFrame(columns=table.schema.names)
    key = list(table.key)
    return whole.sort_values(RECORDED_AT).drop_duplicates(key, keep="last").sort_values(key, ignore_index=True)
