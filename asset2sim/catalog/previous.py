"""What the catalog held before a run, as far as the run's report needs it."""

from collections.abc import Collection
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from asset2sim.catalog.changes import Previous, PreviousRun
from asset2sim.catalog.read import read_table
from asset2sim.catalog.run import RunRow
from asset2sim.catalog.switch import find_catalog
from schemas.errors import Asset2SimError
from schemas.tables import TABLES

_ASKED = ["asset_id", "method", "model", "failure_mode"]


def read_previous(out: Path, run: RunRow, present: Collection[str] | None = None) -> Previous:
    """How each asset of the run's method and model ended before it, and the last run over the same dataset and subset.

    ``present`` names the assets that the dataset still has, None where the run does not know. Call it before the run is
    written. Nothing, where OUT has no catalog yet; where it has one that cannot be read, the
    answer's ``problem`` says so, since no night's work may be lost for want of the last one's.
    """
    folder = find_catalog(out)
    if folder is None:
        return Previous()
    try:
        # A few columns of the widest table: whoever calls this holds OUT's lock, so that no other run can switch it.
        assets = pq.read_table(folder / TABLES["assets"].file, columns=_ASKED).to_pandas()
        runs = read_table(out, "runs")
    except (Asset2SimError, OSError, KeyError, pa.ArrowException) as error:
        return Previous(problem=f"what was there before cannot be read, so every failure counts as new: {error}")
    assets, runs = (table[same_way(table, run)] for table in (assets, runs))
    subset = runs["subset"].isna() if run.subset is None else runs["subset"] == run.subset
    runs = runs[(runs["dataset"] == run.dataset) & subset & (runs["run_id"] != run.run_id)]
    modes = dict(zip(assets["asset_id"].astype(str), assets["failure_mode"].astype(str), strict=True))
    gone = () if present is None else tuple(sorted(name for name in modes if name not in present))
    modes = {name: mode for name, mode in modes.items() if present is None or name in present}
    return Previous(modes, None if runs.empty else _run(runs.sort_values("started_at").iloc[-1]), gone)


def same_way(table: pd.DataFrame, run: RunRow) -> "pd.Series[bool]":
    """Which rows are of the run's method and model."""
    settings = run.settings
    found: pd.Series[bool] = (table["method"] == settings.method.value) & (table["model"] == settings.model.model)
    return found


def _run(row: "pd.Series[Any]") -> PreviousRun:
    return PreviousRun(
        run_id=str(row["run_id"]),
        started_at=pd.Timestamp(row["started_at"]).to_pydatetime(),
        assets=int(row["assets"]),
        ok=int(row["ok"]),
        refined=int(row["assets"]) - (0 if pd.isna(row["unchanged"]) else int(row["unchanged"])),
        queries=int(row["queries"]),
        tokens=int(row["prompt_tokens"] + row["completion_tokens"]),
        cost_usd=float(row["cost_usd"]),
        seconds=float(row["seconds"]),
        asset_seconds=float(row["asset_seconds"]),
    )
