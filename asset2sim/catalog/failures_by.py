"""Failures by category, subset, method, model or asset, now or over all runs since a day (``failures_by.sql``)."""

from datetime import datetime
from importlib import resources
from pathlib import Path

import pandas as pd
from rich import box
from rich.table import Table

from asset2sim.catalog.read import query
from asset2sim.catalog.text import NOTHING
from schemas.vocabulary import Grouping

_NOW = "(SELECT assets.*, runs.started_at FROM assets JOIN runs USING (run_id))"
_SINCE = "(SELECT * FROM asset_history WHERE started_at >= ?)"


def failures_by(out: Path | str, grouping: Grouping, since: datetime | None = None) -> pd.DataFrame:
    """A row per value of a column that has failures, most first; columns as ``failures_by.sql`` names them.

    Without ``since`` the latest refinement of each asset counts, with it (with a time zone) every run from then on: an
    asset that failed in three nights is one asset and three failures. Raises UsageError where OUT has no catalog.
    """
    modes = grouping is Grouping.FAILURE_MODE
    sql = resources.files("asset2sim.catalog").joinpath("failures_by.sql").read_text(encoding="utf-8")
    places = {
        "column": grouping.value,
        "rows": _NOW if since is None else _SINCE,
        # What a failure mode consists of is categories; what anything else consists of is failure modes.
        "cause": "category" if modes else "failure_mode",
        "of": "(SELECT sum(times) FROM every)" if modes else "every.times",
    }
    for name, text in places.items():
        sql = sql.replace(f"{{{name}}}", text)
    return query(out, sql, () if since is None else (since, since))


def render_failures_by(found: pd.DataFrame, grouping: Grouping, since: datetime | None = None) -> Table:
    """For the terminal."""
    when = (
        "of the latest refinements" if since is None else f"of all runs since {since:%Y-%m-%d %H:%M} {since.tzname()}"
    )
    title = f"Failures by {grouping.value.replace('_', ' ')}, {when}"
    table = Table(box=box.SIMPLE_HEAD, title=title, title_justify="left", title_style="bold")
    table.add_column(grouping.value.replace("_", " "), overflow="fold")
    for name in ("assets", "failures", "share %"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("among them")
    for name in ("first", "last"):
        table.add_column(name, no_wrap=True)
    table.add_column("for example")
    for row in found.to_dict("records"):
        examples = [str(asset) for asset in row["example_asset_ids"]]
        table.add_row(
            NOTHING if pd.isna(row[grouping.value]) else str(row[grouping.value]),
            str(row["assets"]),
            str(row["failures"]),
            f"{row['share_percent']:.1f}",
            str(row["causes"]),
            f"{row['first_at']:%Y-%m-%d}",
            f"{row['last_at']:%Y-%m-%d}",
            ", ".join(examples) + (", …" if row["assets"] > len(examples) else ""),
        )
    if found.empty:
        table.caption = "no failures"
    return table
