"""Reviews of assets by people, a row each of the table ``reviews``, and the failures beside them."""

from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path

import pandas as pd
from rich.table import Table
from rich.text import Text

from asset2sim.catalog.query import packaged_sql
from asset2sim.catalog.read import query
from asset2sim.catalog.text import NOTHING, cut, titled_table
from schemas.errors import UsageError
from schemas.table import Row

VERDICTS = ("good", "bad")


@dataclass(frozen=True)
class Review:
    """One person's review of one asset as one run refined it; ``reviewed_at`` has a time zone. Raises UsageError for a
    verdict that is none."""

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
    """The failures with their reviews for the terminal, the unreviewed first. A verdict in brackets is of an asset that
    was refined again since."""
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
        table.add_row(*names, review, *said, when, Text(cut(str(row["reason"]))))
    return table
