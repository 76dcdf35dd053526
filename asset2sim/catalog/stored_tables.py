"""OUT's tables as Arrow, each whole or a few columns of it, and rows and files that do not fit a schema. The caller
holds OUT's lock: no other run switches the tables meanwhile."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from asset2sim.catalog.switch import find_catalog
from schemas.errors import Asset2SimError
from schemas.table import Row, Table
from schemas.tables import TABLES
from schemas.vocabulary import FailureMode, Status


class CatalogError(Asset2SimError):
    """Rows, or a file that is already there, do not fit a table's schema."""


def to_arrow(table: Table, rows: Sequence[Row]) -> pa.Table:
    """Rows as an Arrow table of exactly the table's schema. Raises CatalogError where a row lacks a column or has one
    too many, where a value does not fit its column's type, where a required value is null, or where two rows share a
    key."""
    expected = set(table.schema.names)
    for row in rows:
        if row.keys() != expected:
            name = min(expected ^ row.keys())
            kind = "unknown" if name in row else "missing"
            raise CatalogError(f"table '{table.name}', column '{name}': {kind} in a row; add it to schemas/tables.py")
    columns = [_column(table, field, [_storable(row[field.name]) for row in rows]) for field in table.schema]
    built = pa.Table.from_arrays(columns, schema=table.schema)
    check_key(table, built)
    return built


def conform(table: Table, found: pa.Table, where: str) -> pa.Table:
    """A table that was read from the file ``where``, with today's schema. Columns that were added since are null in old
    rows. Raises CatalogError where that is not allowed, where a type cannot be converted, and where the file has
    columns that this version does not know: rewriting it would lose them."""
    remedy = f"in {where}: written by another version; use that one, or another output folder"
    for name in found.schema.names:
        if name not in table.schema.names:
            raise CatalogError(f"table '{table.name}', column '{name}': unknown {remedy}")
    columns = []
    for field in table.schema:
        if field.name not in found.schema.names:
            if not field.nullable:
                raise CatalogError(f"table '{table.name}', column '{field.name}': missing {remedy}")
            columns.append(pa.nulls(found.num_rows, field.type))
            continue
        column = found.column(field.name)
        if column.null_count and not field.nullable:
            raise CatalogError(f"table '{table.name}', column '{field.name}': null values {remedy}")
        try:
            columns.append(column if column.type.equals(field.type) else column.cast(field.type))
        except pa.ArrowException as error:
            raise CatalogError(f"table '{table.name}', column '{field.name}': {error} {remedy}") from error
    return pa.Table.from_arrays(columns, schema=table.schema)


def row_keys(rows: pa.Table, key: Sequence[str]) -> pa.ChunkedArray:
    """(n,) string: the key columns of each row as one value that no two different keys share."""
    # Lengths in front keep ("a", "bc") and ("ab", "c") apart, whatever the names hold.
    parts: list[pa.ChunkedArray] = []
    for name in key:
        text = rows.column(name).cast(pa.string())
        parts += [pc.utf8_length(text).cast(pa.string()), text]
    return pc.binary_join_element_wise(*parts, ":") if rows.num_rows else pa.chunked_array([[]], type=pa.string())


def check_key(table: Table, rows: pa.Table) -> None:
    """Raises CatalogError, naming the first one, where two rows share a key."""
    keys = row_keys(rows, table.key)
    counts = pc.value_counts(keys)
    repeated = counts.filter(pc.greater(counts.field("counts"), 1))
    if len(repeated):
        first = pc.index(keys, repeated[0]["values"]).as_py()
        values = ", ".join(f"{name}={rows.column(name)[first].as_py()!r}" for name in table.key)
        raise CatalogError(f"table '{table.name}', columns {', '.join(table.key)}: more than one row with {values}")


def _storable(value: object) -> object:
    """The value; of a text what no UTF-8 holds (half of a surrogate pair, from JSON or a file's name) is an escape."""
    return value.encode(errors="backslashreplace").decode() if isinstance(value, str) else value


def _column(table: Table, field: pa.Field, values: list[object]) -> pa.Array:
    where = f"table '{table.name}', column '{field.name}'"
    if not field.nullable and any(value is None for value in values):
        raise CatalogError(f"{where}: null in row {values.index(None)}, but it is required")
    if pa.types.is_integer(field.type) and any(isinstance(value, float) for value in values):
        # Arrow would drop the fraction silently.
        raise CatalogError(f"{where} ({field.type}): holds a number that is not whole")
    try:
        return pa.array(values, type=field.type)
    except (pa.ArrowException, TypeError, ValueError, OverflowError) as error:
        raise CatalogError(f"{where} ({field.type}): {error}") from error


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
