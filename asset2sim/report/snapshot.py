"""The catalog as the report reads it: what its index shows of one state of OUT, and the rows of some assets."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from asset2sim.catalog.changes import compared
from asset2sim.catalog.read import Part, read_assets, read_tables
from schemas.errors import UsageError
from schemas.table import ASSET_KEY
from schemas.tables import HISTORY

ASSETS = (
    *(*ASSET_KEY, "run_id", "content_hash", "category", "prompt", "status", "failure_mode", "reason", "support"),
    *("mass_kg", *(f"size_{axis}_m" for axis in "xyz"), "penetration_mm", "seconds_total", "cost_usd"),
    *("source_path", "refined_path"),
)
NEEDED: Mapping[str, Part] = {
    "assets": Part(ASSETS),
    "runs": Part(),
    "joints": Part(("position_unit", "damping")),
    "interactions": Part((*ASSET_KEY, "test", "reason", "value"), [("test", "==", "effort")]),
    HISTORY.name: Part(("run_id", *ASSET_KEY, "failure_mode")),
}
"""What an index shows of the tables, by name: a few columns, so that ten thousand assets fit."""
Row = Mapping[str, Any]
"""A row as read: column → value, None where it is missing."""


@dataclass(frozen=True)
class Snapshot:
    """Table name → its rows, as far as ``NEEDED``; ``runs`` are those that can be compared with the latest, oldest
    first, it included; and ``modes`` are run id → (asset, method, model) → failure mode, of the latest and the run
    before."""

    tables: Mapping[str, pd.DataFrame]
    runs: tuple[Row, ...]
    modes: Mapping[str, Mapping[tuple[str, ...], str]]

    @property
    def run(self) -> Row:
        """The latest run."""
        return self.runs[-1]

    @property
    def before(self) -> Row | None:
        """The run before it over the same part of the dataset, by the same method and model."""
        return self.runs[-2] if len(self.runs) > 1 else None


def read_snapshot(out: Path | str) -> Snapshot:
    """The catalog of OUT, a folder or a URL. Raises UsageError where there is none, or no run in it."""
    tables = read_tables(out, NEEDED, lambda runs: [row["run_id"] for row in _comparable(runs)[-2:]])
    runs = _comparable(tables["runs"])
    if not runs:
        raise UsageError(f"{out}: its catalog has no run; refine a dataset into it first")
    modes: dict[str, dict[tuple[str, ...], str]] = {row["run_id"]: {} for row in runs[-2:]}
    for row in rows(tables[HISTORY.name]):
        modes[row["run_id"]][tuple(row[name] for name in ASSET_KEY)] = row["failure_mode"]
    return Snapshot(tables, tuple(runs), modes)


def newest(assets: pd.DataFrame, runs: pd.DataFrame) -> pd.DataFrame:
    """The row of each asset that was written last, whichever its method and model: the one whose folder OUT has."""
    started = runs.set_index("run_id")["started_at"]
    ordered = assets.assign(_at=assets["run_id"].map(started)).sort_values("_at", kind="stable")
    return ordered.drop_duplicates("asset_id", keep="last").drop(columns="_at")


def rows(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """Rows as mappings, with None for every missing value and for what is not finite."""
    found = []
    for row in frame.to_dict("records"):
        found.append({str(name): _value(value) for name, value in row.items()})
    return found


def rows_of(out: Path, assets: Sequence[str]) -> dict[str, dict[str, list[dict[str, Any]]]]:
    """Table name → asset id → its rows, for these assets only."""
    found: dict[str, dict[str, list[dict[str, Any]]]] = {}
    for name, table in read_assets(out, assets).items():
        found[name] = {}
        for row in rows(table):
            found[name].setdefault(row["asset_id"], []).append(row)
    return found


def _value(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return None if value is pd.NA or value is pd.NaT else value


def _comparable(runs: pd.DataFrame) -> Sequence[Row]:
    ordered = runs.sort_values(["started_at", "run_id"]).reset_index(drop=True)
    same = compared(ordered)
    return rows(ordered[(same == same.iloc[-1]).all(axis=1)]) if len(ordered) else []
