"""Reading the few catalog columns that a new run needs: results of assets, and run ids."""

from dataclasses import dataclass
from pathlib import Path

import pyarrow.compute as pc
import pyarrow.parquet as pq

from asset2sim.catalog.switch import find_catalog
from schemas.tables import TABLES
from schemas.vocabulary import FailureMode, Status


@dataclass(frozen=True)
class Known:
    """Status, failure mode and content hash of an asset, from its row."""

    status: Status
    failure_mode: FailureMode
    content_hash: str


def recorded_assets(out: Path, method: str, model: str) -> dict[str, Known]:
    """Asset id → its row of this method and model; empty where OUT has no catalog. The caller holds OUT's lock."""
    path = _file(out, "assets")
    if path is None:
        return {}
    table = pq.read_table(path, columns=["asset_id", "method", "model", "status", "failure_mode", "content_hash"])
    mine = table.filter(pc.and_(pc.equal(table["method"], method), pc.equal(table["model"], model)))
    return {
        row["asset_id"]: Known(Status(row["status"]), FailureMode(row["failure_mode"]), row["content_hash"])
        for row in mine.select(["asset_id", "status", "failure_mode", "content_hash"]).to_pylist()
    }


def recorded_run_ids(out: Path) -> frozenset[str]:
    """The ids of all runs in OUT's catalog."""
    path = _file(out, "runs")
    return frozenset(pq.read_table(path, columns=["run_id"])["run_id"].to_pylist()) if path is not None else frozenset()


def _file(out: Path, name: str) -> Path | None:
    folder = find_catalog(out)
    path = folder / TABLES[name].file if folder is not None else None
    return path if path is not None and path.is_file() else None
