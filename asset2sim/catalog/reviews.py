"""Reviews of assets by people: ``OUT/reviews/NAME.parquet``, a file of each viewer that wrote some.

No run touches these files, and no two viewers write the same one: a review needs no lock, also while a run is going on,
and also where OUT is a URL.
"""

from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path

import pandas as pd
from rich.table import Table
from rich.text import Text

from asset2sim.catalog.enforce import to_arrow
from asset2sim.catalog.own_files import new_name, write_own_file
from asset2sim.catalog.query import packaged_sql
from asset2sim.catalog.read import query
from asset2sim.catalog.text import NOTHING, cut, titled_table
from schemas.errors import UsageError
from schemas.location import Location
from schemas.tables_reviews import REVIEWS

VERDICTS = ("good", "bad")


@dataclass(frozen=True)
class Review:
    """What one person says of one asset as one run refined it; ``reviewed_at`` has a time zone."""

    run_id: str
    asset_id: str
    method: str
    model: str
    reviewed_at: datetime
    reviewer: str
    verdict: str
    note: str


class ReviewFile:
    """The file of one viewer's reviews in OUT, a folder or a URL; written anew, in one step, with each of them."""

    def __init__(self, out: Path | str) -> None:
        self.out, self.name = Location(out), new_name()
        self.reviews: tuple[Review, ...] = ()

    def add(self, review: Review) -> None:
        """Store one more. Raises UsageError, and keeps none, for a verdict that is none or where OUT cannot be written
        to."""
        if review.verdict not in VERDICTS:
            raise UsageError(f"a verdict is {' or '.join(VERDICTS)}, not '{review.verdict}'")
        every = (*self.reviews, review)
        write_own_file(self.out, REVIEWS, self.name, to_arrow(REVIEWS, [asdict(item) for item in every]))
        self.reviews = every


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
