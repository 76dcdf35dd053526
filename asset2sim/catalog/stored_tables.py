"""OUT's tables as Arrow, each whole or a few columns of it; what a run needs of the runs before it. The caller holds
OUT's lock: no other run switches the tables meanwhile."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from asset2sim.catalog.enforce import CatalogError, conform
from asset2sim.catalog.switch import find_catalog
from schemas.table import Table
from schemas.tables import TABLES
from schemas.vocabulary import FailureMode, Status

ROWS_AT_ONCE = 1_000
"""Rows that are checked at once: some 500 kB of the widest table."""


@dataclass(frozen=True)
class RecordedResult:
    """Status, failure mode, content hash and run of an asset, from its row. ``alone``: no other method or model has a
    row of it, so what lies in its folder is this row's."""

    status: Status
    failure_mode: FailureMode
    content_hash: str
    run_id: str = ""
    alone: bool = True


def recorded_assets(out: Path, method: str, model: str) -> dict[str, RecordedResult]:
    """Asset id → its row of this method and model; empty where OUT has no catalog."""
    own = ["asset_id", "status", "failure_mode", "content_hash", "run_id"]
    table = stored_columns(out, TABLES["assets"], (*own, "method", "model"))
    is_mine = pc.and_(pc.equal(table["method"], method), pc.equal(table["model"], model))
    others = set(table.filter(pc.invert(is_mine))["asset_id"].to_pylist())
    return {
        row["asset_id"]: RecordedResult(
            Status(row["status"]),
            FailureMode(row["failure_mode"]),
            row["content_hash"],
            row["run_id"],
            row["asset_id"] not in others,
        )
        for row in table.filter(is_mine).select(own).to_pylist()
    }


def recorded_run_ids(out: Path) -> frozenset[str]:
    """The ids of all runs in OUT's catalog."""
    return frozenset(stored_columns(out, TABLES["runs"], ("run_id",))["run_id"].to_pylist())


def check_catalog(out: Path) -> None:
    """Raises CatalogError where OUT holds tables that a run could not add to; call it before a long run starts."""
    for table in TABLES.values():
        path = table_path(out, table)
        if path is not None:
            with reading(table, path), pq.ParquetFile(path) as file:
                conform(table, file.schema_arrow.empty_table(), str(path))
            for _ in stored_batches(out, table):
                pass


def table_path(out: Path, table: Table) -> Path | None:
    """The table's file in OUT, if there is one."""
    folder = find_catalog(out)
    path = folder / table.file if folder else None
    return path if path is not None and path.exists() else None


def stored_table(out: Path, table: Table) -> pa.Table:
    """The table as it is in OUT, in today's schema; empty where there is none."""
    path = table_path(out, table)
    if path is None:
        return table.schema.empty_table()
    with reading(table, path):
        found = pq.read_table(path)
    return conform(table, found, str(path))


def stored_batches(out: Path, table: Table) -> Iterator[pa.Table]:
    """The rows of the table in OUT, in today's schema, a few at a time: a large table read at once would set a run's
    peak memory. Raises CatalogError."""
    path = table_path(out, table)
    if path is None:
        return
    with reading(table, path), pq.ParquetFile(path) as file:
        for batch in file.iter_batches(ROWS_AT_ONCE, use_threads=False):
            yield conform(table, pa.Table.from_batches([batch]), str(path))


def stored_by_asset(out: Path, table: Table) -> Iterator[pa.Table]:
    """``stored_batches`` in which asset ids ascend, as they do in every table that a run wrote; a table that somebody
    else wrote may have to be read at once and sorted."""
    path = table_path(out, table)
    if path is None:
        return
    with reading(table, path), pq.ParquetFile(path) as file:
        names = file.iter_batches(10 * ROWS_AT_ONCE, columns=["asset_id"], use_threads=False)
        sorted_already = ascends(batch["asset_id"] for batch in names)
    if sorted_already:
        yield from stored_batches(out, table)
    else:
        yield stored_table(out, table).sort_by("asset_id")


def stored_columns(out: Path, table: Table, names: Sequence[str]) -> pa.Table:
    """The table in OUT, with only those of the columns ``names`` that it has: a fraction of the widest table."""
    path = table_path(out, table)
    wanted = [name for name in table.schema.names if name in names]
    if path is None:
        return table.schema.empty_table().select(wanted)
    with reading(table, path):
        return pq.read_table(path, columns=wanted)


@contextmanager
def reading(table: Table, path: Path) -> Iterator[None]:
    """Raises CatalogError, which names the table and its file, where the block cannot read it."""
    try:
        yield
    except (pa.ArrowException, OSError) as error:
        raise CatalogError(
            f"table '{table.name}': {path} cannot be read ({' '.join(str(error).split())}); restore it or move it away"
        ) from error


def ascends(ids: Iterable[pa.Array]) -> bool:
    """Whether no value is smaller than the one before it; (n,) string each."""
    before: pa.Scalar | None = None
    for part in ids:
        if not len(part):
            continue
        if before is not None and pc.less(part[0], before).as_py():
            return False
        if not pc.all(pc.less_equal(part.slice(0, len(part) - 1), part.slice(1))).as_py() and len(part) > 1:
            return False
        before = part[-1]
    return True
