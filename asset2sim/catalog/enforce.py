"""Rows to Arrow under a table's schema: a wrong, missing or unknown column is an error that names table and column."""

from collections.abc import Sequence

import pyarrow as pa
import pyarrow.compute as pc

from schemas.errors import Asset2SimError
from schemas.table import Row, Table


class CatalogError(Asset2SimError):
    """Rows, or a file that is already there, do not fit a table's schema."""


def to_arrow(table: Table, rows: Sequence[Row]) -> pa.Table:
    """Rows as an Arrow table of exactly the table's schema. Raises CatalogError for a row with a missing or unknown
    column, a value of another type, a required null, and two rows with one key."""
    expected = set(table.schema.names)
    for row in rows:
        if row.keys() != expected:
            name = min(expected ^ row.keys())
            kind = "unknown" if name in row else "missing"
            raise CatalogError(f"table '{table.name}', column '{name}': {kind} in a row; add it to schemas/columns.csv")
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
