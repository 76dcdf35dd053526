"""The rows of the latest run's assets, whichever run wrote them."""

from pathlib import Path

import pandas as pd

from asset2sim.catalog.read import read_table
from schemas.errors import UsageError
from schemas.table import ASSET_KEY


def latest_run(out: Path) -> "pd.Series[str]":
    """The row of ``runs`` of the run that started last. Raises UsageError where there is none."""
    runs = read_table(out, "runs")
    if runs.empty:
        raise UsageError(f"{out}: its catalog has no run; refine a dataset into it first")
    latest: pd.Series[str] = runs.sort_values("started_at").iloc[-1]
    return latest


def latest_rows(out: Path, *names: str) -> tuple[pd.DataFrame, ...]:
    """These per-asset tables, as far as they are of assets of the latest run; unchanged ones have rows of earlier runs.

    Raises UsageError where OUT has no run.
    """
    run_id = latest_run(out)["run_id"]
    history = read_table(out, "asset_history")
    keys = history.loc[history["run_id"] == run_id, list(ASSET_KEY)]
    tables = [read_table(out, name) for name in names]
    if keys.empty:
        # A catalog of a version that kept no history: every run wrote all rows of its assets.
        return tuple(table[table["run_id"] == run_id] for table in tables)
    return tuple(table.merge(keys, on=list(ASSET_KEY), how="inner") for table in tables)
