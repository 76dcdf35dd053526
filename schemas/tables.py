"""The catalog's tables: an Arrow schema each, with units in column names and a description in every field."""

from collections.abc import Iterable

from schemas.csv_rows import rows_beside
from schemas.extensions import further_columns
from schemas.table import Column, Table, columns_of, make_table

USED, CONTENTS, LIFTED = (tuple(columns_of(check)) for check in ("used", "contents", "lifted"))
"""Columns of a hand's checks (``schemas.hand_settings``) in the table ``assets``."""
OUTCOME_COLUMNS = (
    *("category", "subset", "status", "failure_mode", "paper_failure_mode", "reason", "scale", "mass_kg"),
    *("penetration_mm", "drift_m", "drift_rad", "peak_speed_m_s", "oscillating_joints"),
    *("errors", "warnings", "content_hash"),
)
"""The asset's result and measurements; an unchanged asset keeps its earlier values."""

COST_COLUMNS = ("queries", "cached_calls", "prompt_tokens", "completion_tokens", "cost_usd", "seconds_total")
"""What the run spent on the asset: nothing where it was unchanged."""

_ABOUT = {row["name"]: row for row in rows_beside(__file__, "tables.csv")}


def _table(name: str, columns: Iterable[Column] | None = None) -> Table:
    """The table of this row of ``tables.csv``, with these columns or those that ``columns.csv`` lists of it."""
    row = _ABOUT[name]
    return make_table(name, row["grain"], tuple(row["key"].split()), row["description"], columns)


_ASSETS = columns_of("assets", further={"further checks": further_columns()})
TABLES = {
    name: _table(name, _ASSETS if name == "assets" else None)
    for name in _ABOUT
    if name not in ("asset_history", "reviews")
}
"""Tables of the catalog's folder by name: written together, with the latest rows of every asset."""

_OUTCOME_AND_COST = [
    column for column in columns_of("assets") if column[0].removesuffix("!") in (*OUTCOME_COLUMNS, *COST_COLUMNS)
]
HISTORY = _table("asset_history", columns_of("asset_history", further={"outcome and cost": _OUTCOME_AND_COST}))
"""History of all runs: an append-only folder of files by month of the run's start."""

REVIEWS = _table("reviews")
"""Reviews: a folder of files, each written by one viewer."""

PUBLISHED = {**TABLES, HISTORY.name: HISTORY, REVIEWS.name: REVIEWS}
"""Every table that can be read, by name."""
