"""What the catalog held before a run, as far as the run's report needs it."""

from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from asset2sim.catalog.changes import Previous, PreviousRun
from asset2sim.catalog.read import query
from asset2sim.catalog.run import RunRow
from asset2sim.catalog.switch import find_catalog
from schemas.errors import Asset2SimError

_ASSETS = "SELECT asset_id, failure_mode FROM assets WHERE method = ? AND model = ?"
_RUN = """
SELECT
    run_id, started_at, assets, ok, queries, prompt_tokens + completion_tokens AS tokens, cost_usd, seconds,
    asset_seconds
FROM runs
WHERE method = ? AND model = ? AND dataset = ? AND subset IS NOT DISTINCT FROM ? AND run_id <> ?
ORDER BY started_at DESC
LIMIT 1
"""


def read_previous(out: Path, run: RunRow) -> Previous:
    """How each asset of the run's method and model ended before it, and the last run over the same dataset and subset.

    Call it before the run is written. Nothing, where OUT has no catalog yet; where it has one that cannot be read, the
    answer's ``problem`` says so, since no night's work may be lost for want of the last one's.
    """
    if find_catalog(out) is None:
        return Previous()
    pair = (run.settings.method.value, run.settings.model.model)
    try:
        assets = query(out, _ASSETS, pair)
        runs = query(out, _RUN, (*pair, run.dataset, run.subset, run.run_id))
    except (Asset2SimError, OSError) as error:
        return Previous(problem=f"what was there before cannot be read, so every failure counts as new: {error}")
    modes = dict(zip(assets["asset_id"].astype(str), assets["failure_mode"].astype(str), strict=True))
    rows = runs.to_dict("records")
    return Previous(modes, _run({str(name): value for name, value in rows[0].items()}) if rows else None)


def _run(row: Mapping[str, object]) -> PreviousRun:
    values: dict[str, object] = {
        "run_id": str(row["run_id"]),
        "started_at": pd.Timestamp(str(row["started_at"])).to_pydatetime(),
    }
    values |= {name: int(str(row[name])) for name in ("assets", "ok", "queries", "tokens")}
    values |= {name: float(str(row[name])) for name in ("cost_usd", "seconds", "asset_seconds")}
    return PreviousRun(**values)  # type: ignore[arg-type]
