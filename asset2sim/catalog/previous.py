"""What the catalog held before a run, as far as the run's report needs it."""

from collections.abc import Mapping
from pathlib import Path

import pandas as pd
import pyarrow as pa

from asset2sim.catalog.changes import Previous, PreviousRun
from asset2sim.catalog.read import read_table
from asset2sim.catalog.run import RunRow
from asset2sim.catalog.switch import find_catalog
from schemas.errors import Asset2SimError


def read_previous(out: Path, run: RunRow) -> Previous:
    """How each asset of the run's method and model ended before it, and the last run over the same dataset and subset.

    Call it before the run is written. Nothing, where OUT has no catalog yet; where it has one that cannot be read, the
    answer's ``problem`` says so, since no night's work may be lost for want of the last one's.
    """
    if find_catalog(out) is None:
        return Previous()
    try:
        assets, runs = read_table(out, "assets"), read_table(out, "runs")
    except (Asset2SimError, OSError, KeyError, pa.ArrowException) as error:
        return Previous(problem=f"what was there before cannot be read, so every failure counts as new: {error}")
    assets, runs = (table[same_way(table, run)] for table in (assets, runs))
    subset = runs["subset"].isna() if run.subset is None else runs["subset"] == run.subset
    runs = runs[(runs["dataset"] == run.dataset) & subset & (runs["run_id"] != run.run_id)]
    runs = runs.sort_values("started_at", ascending=False)
    modes = dict(zip(assets["asset_id"].astype(str), assets["failure_mode"].astype(str), strict=True))
    runs = runs.assign(tokens=runs["prompt_tokens"] + runs["completion_tokens"])
    rows = runs.head(1).to_dict("records")
    return Previous(modes, _run({str(name): value for name, value in rows[0].items()}) if rows else None)


def same_way(table: pd.DataFrame, run: RunRow) -> "pd.Series[bool]":
    """Which rows are of the run's method and model."""
    settings = run.settings
    found: pd.Series[bool] = (table["method"] == settings.method.value) & (table["model"] == settings.model.model)
    return found


def _run(row: Mapping[str, object]) -> PreviousRun:
    values: dict[str, object] = {
        "run_id": str(row["run_id"]),
        "started_at": pd.Timestamp(str(row["started_at"])).to_pydatetime(),
    }
    values |= {name: int(str(row[name])) for name in ("assets", "ok", "queries", "tokens")}
    values |= {name: float(str(row[name])) for name in ("cost_usd", "seconds", "asset_seconds")}
    return PreviousRun(**values)  # type: ignore[arg-type]
