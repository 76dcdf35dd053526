"""Failures: by mode and other columns (``failures.sql``), between two runs, and beside people's reviews of assets."""

from collections.abc import Hashable, Mapping
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import pandas as pd
from rich.table import Table
from rich.text import Text

from asset2sim.catalog.changes import like_latest
from asset2sim.catalog.query import packaged_sql
from asset2sim.catalog.read import query, read_table
from asset2sim.catalog.text import NOTHING, cut_text, titled_table
from schemas.errors import UnknownChoiceError, UsageError
from schemas.model_names import described
from schemas.table import Row
from schemas.vocabulary import Grouping

LATEST, PREVIOUS = "latest", "previous"
"""Names of the last run, and of the one before it over the same part of a dataset with the same method and model."""
CHANGES = ("broke", "fails otherwise", "mended", "came", "went")
"""Kinds of change of an asset between two runs, the most important first."""
_STYLES = {"broke": "bold red", "fails otherwise": "red", "mended": "green"}
_LATEST_ROWS = "(SELECT assets.*, runs.started_at FROM assets JOIN runs USING (run_id))"
_ROWS_SINCE = "(SELECT * FROM asset_history WHERE started_at >= ?)"


MAX_REASON = 200
"""Characters of a reason in the table for the terminal."""


def failure_breakdown(out: Path | str) -> pd.DataFrame:
    """A row per method, model and failure mode, ``none`` first; columns as ``failures.sql`` names them. Raises
    UsageError where OUT has no catalog."""
    return query(out, packaged_sql("failures"))


def render_failures(breakdown: pd.DataFrame) -> Table:
    """The breakdown as a table for the terminal; method and model only where there is more than one pair of them."""
    pairs = sorted(set(zip(breakdown["method"], breakdown["model"], strict=True)))
    several = len(pairs) > 1
    only = f": {pairs[0][0]}, {described(pairs[0][1])}" if len(pairs) == 1 else ""
    table = titled_table(f"Failure modes{only}")
    table.padding = (0, 1, 0, 0)
    for name in ("method", "model") if several else ():
        table.add_column(name)
    table.add_column("failure mode", no_wrap=True)
    table.add_column("in the paper", max_width=16)
    table.add_column("assets", justify="right", no_wrap=True)
    table.add_column("share %", justify="right", no_wrap=True)
    table.add_column("causes", overflow="fold", max_width=20)
    table.add_column("for example", overflow="fold", max_width=16)
    table.add_column("reason of the first", overflow="fold")
    for row in breakdown.to_dict("records"):
        passed = row["failure_mode"] == "none"
        mode = Text("none (ok)" if passed else str(row["failure_mode"]), style="green" if passed else "red")
        own = (str(row["method"]), described(str(row["model"]))) if several else ()
        reason = Text("" if passed else cut_text(_text(row["reason"]), MAX_REASON))
        figures = (
            str(row["assets"]),
            f"{row['share_percent']:.1f}",
            _text(row["causes"]),
            Text(_examples(row)),
            reason,
        )
        table.add_row(*own, mode, _text(row["paper_failure_mode"]), *figures)
    return table


def _text(value: object) -> str:
    return value if isinstance(value, str) else NOTHING


def _examples(row: Mapping[Hashable, Any]) -> str:
    names = [str(asset) for asset in row["example_asset_ids"]]
    return ", ".join(names) + (", …" if row["assets"] > len(names) else "")


def compare_runs(out: Path | str, earlier: str, later: str) -> pd.DataFrame:
    """A row per asset whose result in ``later`` is another than in ``earlier``, with ``compare_runs.sql``'s columns. A
    run is an id, its beginning, ``latest`` or ``previous``. Raises UsageError for an unknown or ambiguous one."""
    return query(out, packaged_sql("compare_runs"), (find_run(out, earlier), find_run(out, later)))


def find_run(out: Path | str, name: str) -> str:
    """The id of the run that a user names. Raises UsageError."""
    runs = read_table(out, "runs").sort_values(["started_at", "run_id"])
    ids = [str(run_id) for run_id in runs["run_id"]]
    if name == LATEST:
        return ids[-1]
    if name == PREVIOUS:
        like = like_latest(runs)
        if len(like) < 2:
            raise UsageError(
                f"run {ids[-1]} is the first over this part of its dataset with its method and model; name two runs by "
                "their ids"
            )
        return str(like.iloc[-2]["run_id"])
    found = [name] if name in ids else [run_id for run_id in ids if name and run_id.startswith(name)]
    if len(found) > 1:
        raise UsageError(f"'{name}' is the beginning of {len(found)} runs: {', '.join(found[-5:])}; write more of it")
    if not found:
        raise UnknownChoiceError("run", name, [LATEST, PREVIOUS, *ids[-28:]])
    return found[0]


def render_comparison(found: pd.DataFrame, earlier: str, later: str) -> Table:
    """Table for the terminal, broken assets first. Of assets in only one run, it names only those that failed."""
    counts = found["change"].value_counts()
    told = ", ".join(f"{counts[change]} {change}" for change in CHANGES if change in counts) or "nothing changed"
    table = titled_table(f"From {earlier} to {later}: {told}")
    for name in ("change", "asset", "category", "before", "after", "reason"):
        table.add_column(name, overflow="fold")
    for row in found.to_dict("records"):
        before, after = _text(row["before"]), _text(row["after"])
        if row["change"] not in ("came", "went") or {before, after} - {"none", NOTHING}:
            change = Text(str(row["change"]), style=_STYLES.get(str(row["change"]), ""))
            names = (Text(str(row["asset_id"])), Text(str(row["category"])))
            table.add_row(change, *names, before, after, Text(cut_text(_text(row["reason"]))))
    return table


def failures_by(out: Path | str, grouping: Grouping, since: datetime | None = None) -> pd.DataFrame:
    """A row per value of a column that has failures, most first; columns as ``failures_by.sql`` names them. Without
    ``since`` the latest refinement of each asset counts, with it (with a time zone) every run from then on: an asset
    that failed in three nights is one asset and three failures. Raises UsageError where OUT has no catalog."""
    modes = grouping is Grouping.FAILURE_MODE
    sql = packaged_sql("failures_by")
    places = {
        "column": grouping.value,
        "rows": _LATEST_ROWS if since is None else _ROWS_SINCE,
        # Failure modes are broken down by category, everything else by failure mode.
        "cause": "category" if modes else "failure_mode",
        "of": "(SELECT sum(times) FROM every)" if modes else "every.times",
    }
    for name, text in places.items():
        sql = sql.replace(f"{{{name}}}", text)
    return query(out, sql, () if since is None else (since, since))


def render_failures_by(found: pd.DataFrame, grouping: Grouping, since: datetime | None = None) -> Table:
    """Table of the failures for the terminal."""
    when = f"all runs since {since:%Y-%m-%d %H:%M} {since.tzname()}" if since else "the latest refinements"
    column = grouping.value.replace("_", " ")
    table = titled_table(f"Failures by {column}, of {when}")
    table.add_column(column, overflow="fold")
    for name in ("assets", "failures", "share %"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("among them")
    for name in ("first", "last"):
        table.add_column(name, no_wrap=True)
    table.add_column("for example")
    for row in found.to_dict("records"):
        counts = (str(row["assets"]), str(row["failures"]), f"{row['share_percent']:.1f}")
        days = (f"{row[name]:%Y-%m-%d}" for name in ("first_at", "last_at"))
        table.add_row(_text(row[grouping.value]), *counts, str(row["causes"]), *days, _examples(row))
    if found.empty:
        table.caption = "no failures"
    return table


VERDICTS = ("good", "bad")


@dataclass(frozen=True)
class Review:
    """One person's review of one asset of a run; ``reviewed_at`` has a time zone. UsageError for another verdict."""

    run_id: str
    asset_id: str
    method: str
    model: str
    reviewed_at: datetime
    reviewer: str
    verdict: str
    note: str

    def __post_init__(self) -> None:
        if self.verdict not in VERDICTS:
            raise UsageError(f"a verdict is {' or '.join(VERDICTS)}, not '{self.verdict}'")

    @property
    def row(self) -> Row:
        """Its row."""
        return asdict(self)


def reviewed_failures(out: Path | str) -> pd.DataFrame:
    """A row per asset that fails, with its latest review, nulls where it has none; the unreviewed first. Columns are as
    ``reviewed_failures.sql`` names them. Raises UsageError where OUT has no catalog."""
    return query(out, packaged_sql("reviewed_failures"))


def unreviewed_line(found: pd.DataFrame) -> str:
    """How many failures have no review of their present state; empty where there is no failure."""
    left = int((~found["current"]).sum())
    return f"{left} of {len(found)} failures not reviewed" if len(found) else ""


def render_reviewed(found: pd.DataFrame) -> Table:
    """The reviewed failures for the terminal, the unreviewed first; in brackets a verdict before a later run."""
    table = titled_table(unreviewed_line(found) or "no failures")
    for name in ("asset", "category", "failure mode", "review", "note", "by", "when", "reason"):
        table.add_column(name, overflow="fold", no_wrap=name == "when")
    for row in found.to_dict("records"):
        verdict = row["verdict"] if isinstance(row["verdict"], str) else None
        review = Text(NOTHING, style="yellow")
        if verdict is not None:
            style = "green" if verdict == "good" else "red"
            review = Text(verdict, style=style) if row["current"] else Text(f"({verdict})", style="yellow")
        said = [Text(str(row[name]) if verdict is not None else "") for name in ("note", "reviewer")]
        when = f"{row['reviewed_at']:%Y-%m-%d %H:%M}" if verdict is not None else ""
        names = [Text(str(row[name])) for name in ("asset_id", "category", "failure_mode")]
        table.add_row(*names, review, *said, when, Text(cut_text(str(row["reason"]))))
    return table
