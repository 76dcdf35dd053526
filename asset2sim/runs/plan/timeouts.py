"""Assets that took too long in several runs in a row, and are left alone until something about them changes."""

from collections.abc import Collection
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import pyarrow.compute as pc
import pyarrow.parquet as pq

from asset2sim.catalog.history import history_files
from asset2sim.catalog.stored_tables import RecordedResult, stored_columns
from schemas.asset import AssetRecord
from schemas.finding import warning
from schemas.settings import RunSettings, Settings
from schemas.tables import TABLES
from schemas.vocabulary import FailureMode, Stage

LEFT_ALONE = "left_alone"
"""Code of the finding on an asset that took too long once too often; its value is the time limit, s."""
_COLUMNS = ("asset_id", "method", "model", "started_at", "unchanged", "failure_mode", "content_hash")


@dataclass(frozen=True)
class Timeouts:
    """Runs in a row in which an asset took too long, and the limit, s, under which it was left alone, if it was."""

    count: int
    left_at_s: float | None = None


def timed_out(row: RecordedResult, content: str | None) -> bool:
    """Whether the row is of a refinement of this content that took too long."""
    return row.failure_mode is FailureMode.TIMEOUT and row.content_hash == content


def timeouts_in_a_row(out: Path, settings: Settings, asset_ids: Collection[str]) -> dict[str, Timeouts]:
    """Asset id → its last refinements that all took too long, read from the newest months of the history."""
    wanted, found = set(asset_ids), dict[str, tuple[int, str]]()
    months = groupby(reversed(history_files(out)), key=lambda file: file.parent)
    for _, files in months if wanted else ():
        mine = _is_mine(settings, wanted) & ~pc.field("unchanged")
        tables = [pq.read_table(file, columns=list(_COLUMNS), filters=mine, partitioning=None) for file in files]
        rows = [row for table in tables for row in table.to_pylist()]
        for row in sorted(rows, key=lambda row: row["started_at"], reverse=True):
            asset_id, content = row["asset_id"], row["content_hash"]
            if asset_id not in wanted:
                continue
            count, known = found.get(asset_id, (0, content))
            if row["failure_mode"] == FailureMode.TIMEOUT and content == known:
                found[asset_id] = count, _ = count + 1, known
            else:
                wanted.discard(asset_id)
            if count >= settings.run.max_timeouts:
                wanted.discard(asset_id)
        if not wanted:
            break
    limits = _left_at(out, settings, found)
    return {name: Timeouts(count, limits.get(name)) for name, (count, _) in found.items()}


def is_left(timeouts: Timeouts | None, settings: Settings) -> bool:
    """Whether the asset is left alone: it took too long too often, and has no more time now than then."""
    if timeouts is None or timeouts.left_at_s is None or settings.run.max_timeouts == 0:
        return False
    return timeouts.count >= settings.run.max_timeouts and settings.run.asset_time_limit_s <= timeouts.left_at_s


def with_left_alone(record: AssetRecord, before: int, run: RunSettings) -> AssetRecord:
    """The record of an asset that took too long in ``before`` runs in a row until this one; where that is once too
    often, its reason and a finding say that it is left alone."""
    if record.failure_mode is not FailureMode.TIMEOUT or not 0 < run.max_timeouts <= before + 1:
        return record
    told = (
        f"it took too long in {before + 1} runs in a row, and is left alone until it, the code, the settings or a "
        "longer --asset-timeout change that; --retry-failed tries it all the same"
    )
    said = f"asset {record.ref.asset_id}: {told}"
    finding = warning(Stage.REFINE, LEFT_ALONE, said, value=run.asset_time_limit_s)
    reason = f"{record.reason}; {told}"
    return record.model_copy(update={"reason": reason, "findings": (*record.findings, finding)})


def _left_at(out: Path, settings: Settings, asset_ids: Collection[str]) -> dict[str, float]:
    """Asset id → the time limit, s, of the finding that it is left alone."""
    if not asset_ids:
        return {}
    rows = stored_columns(out, TABLES["findings"], ("asset_id", "method", "model", "code", "value"))
    mine = _is_mine(settings, asset_ids) & (pc.field("code") == LEFT_ALONE)
    return {row["asset_id"]: row["value"] for row in rows.filter(mine).to_pylist()}


def _is_mine(settings: Settings, asset_ids: Collection[str]) -> pc.Expression:
    """Filter for the rows of these assets, of the settings' method and model."""
    same = (pc.field("method") == settings.method.value) & (pc.field("model") == settings.model.model)
    return same & pc.field("asset_id").isin(sorted(asset_ids))
