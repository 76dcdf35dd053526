"""The catalog read as DataFrames or by SQL, from a folder or a URL. A reader never sees half of a run."""

import math
from collections.abc import Callable, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from asset2sim.catalog.enforce import CatalogError, conform
from asset2sim.catalog.history import history_files
from asset2sim.catalog.own_files import read_own_files
from asset2sim.catalog.query import make_views, own_tables, query_error
from asset2sim.catalog.read_remote import local_tables
from asset2sim.catalog.stored_tables import ROWS_AT_ONCE, reading
from asset2sim.catalog.switch import find_catalog, no_catalog_error
from schemas.errors import UnknownChoiceError, UsageError
from schemas.table import ASSET_KEY, Table
from schemas.tables import HISTORY, PUBLISHED, REVIEWS, TABLES

FrameRow = Mapping[str, Any]
"""A row of a table as read: column → value, None where it is missing."""
Result = TypeVar("Result")
Filters = list[tuple[str, str, object]]
"""Conditions on columns, all of which hold, as pyarrow has them: (column, comparison, value)."""


class TableSlice(NamedTuple):
    """Part of a table to read: the columns of these names, and the rows that pass; None for all."""

    columns: Sequence[str] | None = None
    filters: Filters | None = None


WHOLE = TableSlice()
_ATTEMPTS = 20
CHUNK_VECTORS = 2500
"""Most rows of an answer, in what DuckDB hands over at once (2048 rows): 5 million."""
_NULLABLE = {pa.int64(): pd.Int64Dtype(), pa.bool_(): pd.BooleanDtype()}


def read_table(out: Path | str, name: str) -> pd.DataFrame:
    """One table of OUT's catalog, or its history; counts and flags keep their type where some are null. Raises
    UnknownChoiceError for a name that is no table, UsageError where OUT has no catalog."""
    if name not in PUBLISHED:
        raise UnknownChoiceError("table", name, PUBLISHED)
    out = local_tables(out)
    if name == REVIEWS.name:
        oldest = ["reviewed_at", "asset_id"]
        return _read_consistent(out, lambda _: read_own_files(out, REVIEWS).sort_values(oldest, ignore_index=True))
    if name == HISTORY.name:
        return _read_consistent(out, lambda _: _history_frame(out))
    return _read_consistent(out, lambda folder: _frame(folder / TABLES[name].file))


def query(out: Path | str, sql: str, parameters: Sequence[object] = (), *, files: bool = True) -> pd.DataFrame:
    """Result of a DuckDB query over the tables by name; ``?`` stand for ``parameters``. Without ``files`` it touches no
    other file. Raises UsageError where OUT has no catalog or the query is at fault."""
    out = local_tables(out)
    import duckdb  # late: imported while Prefect's threads run, it warns about them at exit

    alone = own_tables(out) if find_catalog(out) is None else None
    try:
        if alone is not None:
            return _answer(out, alone, sql, parameters, files)
        return _read_consistent(out, lambda folder: _answer(out, folder, sql, parameters, files), duckdb.Error)
    except duckdb.Error as error:
        raise query_error(error) from error


def read_asset(out: Path | str, asset_id: str) -> dict[str, pd.DataFrame]:
    """Table name → this asset's rows, of every method and model, and its runs; all from one state of OUT. Raises
    UnknownChoiceError, naming the closest ids, where the catalog has no such asset."""
    return _read_consistent(local_tables(out), lambda folder: _asset_frames(folder, asset_id))


def read_tables(
    out: Path | str, parts: Mapping[str, TableSlice], of_history: Callable[[pd.DataFrame], Sequence[str]]
) -> dict[str, pd.DataFrame]:
    """Table name → the part of it that is asked for, ``runs`` among them; of the history rows of the runs alone that
    ``of_history`` chooses of ``runs``. All from one state of OUT. Raises UsageError where OUT has no catalog."""
    out = local_tables(out)
    columns = parts.get(HISTORY.name, WHOLE).columns

    def read(folder: Path) -> dict[str, pd.DataFrame]:
        frames = {name: _frame(folder / TABLES[name].file, part) for name, part in parts.items() if name in TABLES}
        return frames | {HISTORY.name: _history_frame(out, of_history(frames["runs"]), columns)}

    return _read_consistent(out, read)


def read_assets(out: Path | str, asset_ids: Sequence[str]) -> dict[str, pd.DataFrame]:
    """Table name → the rows of these assets, in every table that has rows of assets; all from one state of OUT. Raises
    UsageError where OUT has no catalog."""
    mine = TableSlice(filters=[("asset_id", "in", list(asset_ids))])
    tables = [table for table in TABLES.values() if table.per_asset]
    return _read_consistent(
        local_tables(out), lambda folder: {table.name: _frame(folder / table.file, mine) for table in tables}
    )


def _asset_frames(folder: Path, asset_id: str) -> dict[str, pd.DataFrame]:
    path = folder / TABLES["assets"].file
    with reading(TABLES["assets"], path):
        known = pq.read_table(path, columns=["asset_id"]).column("asset_id").unique().to_pylist()
    if asset_id not in known:
        raise UnknownChoiceError("asset", asset_id, get_close_matches(asset_id, known, n=8, cutoff=0.5) or known)
    mine = TableSlice(filters=[("asset_id", "==", asset_id)])
    frames = {table.name: _frame(folder / table.file, mine) for table in TABLES.values() if table.per_asset}
    runs = _frame(folder / TABLES["runs"].file)
    return frames | {"runs": runs[runs["run_id"].isin(frames["assets"]["run_id"])]}


def _frame(path: Path, part: TableSlice = WHOLE) -> pd.DataFrame:
    # A catalog that an earlier version wrote may lack a table that was added since.
    if not path.exists() and path.with_name(TABLES["runs"].file).exists():
        return _pandas(TABLES[path.stem].schema.empty_table())
    with reading(TABLES[path.stem], path):
        own = pq.read_schema(path).names
        columns = [name for name in own if part.columns is None or name in part.columns]
        whole = part.filters is None
        found = pq.read_table(path, columns=columns) if whole else _passing(path, columns, part.filters or [])
    return _pandas(_with_columns_of_today(found, TABLES[path.stem], part))


def _with_columns_of_today(found: pa.Table, table: Table, part: TableSlice) -> pa.Table:
    """The rows with a null in each column that an earlier version did not write."""
    for column in table.schema:
        if column.name not in found.column_names and (part.columns is None or column.name in part.columns):
            found = found.append_column(column.name, pa.nulls(len(found), column.type))
    return found


def _passing(path: Path, columns: Sequence[str], filters: Filters) -> pa.Table:
    """The rows that pass, read a few at a time: Arrow's own filter holds many times as many rows as pass it."""
    passes = pq.filters_to_expression(filters)
    with pq.ParquetFile(path) as file:
        groups = [group for group in range(file.num_row_groups) if _may_hold(file.metadata.row_group(group), filters)]
        batches = file.iter_batches(ROWS_AT_ONCE, row_groups=groups, columns=columns, use_threads=False)
        found = [pa.Table.from_batches([batch]).filter(passes) for batch in batches]
        return pa.concat_tables([file.schema_arrow.empty_table().select(columns), *found])


def _may_hold(group: pq.RowGroupMetaData, filters: Filters) -> bool:
    """Whether a row group may hold rows of the assets that are asked for, by its least and its greatest id."""
    asked = next((of for name, _, of in filters if name == "asset_id"), None)
    ids = [asked] if isinstance(asked, str) else asked
    found = next(
        (group.column(n) for n in range(group.num_columns) if group.column(n).path_in_schema == "asset_id"), None
    )
    if (
        not isinstance(ids, list)
        or not ids
        or found is None
        or not found.is_stats_set
        or not found.statistics.has_min_max
    ):
        return True
    return bool(found.statistics.min <= max(ids) and min(ids) <= found.statistics.max)


def _history_frame(out: Path, runs: Sequence[str] | None = None, columns: Sequence[str] | None = None) -> pd.DataFrame:
    """The history's rows, of all runs or of these."""
    mine = None if runs is None else pc.field("run_id").isin(pa.array(list(runs), type=pa.string()))
    whole = HISTORY.schema.empty_table()
    for path in history_files(out):
        with reading(HISTORY, path):
            found = pq.read_table(path, partitioning=None, filters=mine, use_threads=False)
        whole = pa.concat_tables([whole, conform(HISTORY, found, str(path))])
    return _pandas(whole.select(columns or whole.schema.names))


def _pandas(table: pa.Table) -> pd.DataFrame:
    frame: pd.DataFrame = table.to_pandas(types_mapper=_NULLABLE.get)
    return frame


def _answer(out: Path, folder: Path, sql: str, parameters: Sequence[object], files: bool) -> pd.DataFrame:
    import duckdb

    with duckdb.connect(":memory:", config={"enable_external_access": files}) as connection:
        make_views(connection, out, folder, files=files)
        done: duckdb.DuckDBPyConnection | None = connection.execute(sql, list(parameters))
        if done is None:
            raise UsageError("the query failed: there is nothing in it")
        found = done.fetch_df_chunk(CHUNK_VECTORS)
        if len(found) >= CHUNK_VECTORS * duckdb.__standard_vector_size__:
            raise UsageError(f"the query failed: its answer has {len(found)} rows and more; state a LIMIT, or count")
        return found


def _read_consistent(out: Path, read: Callable[[Path], Result], *retried: type[Exception]) -> Result:
    """Result of ``read`` on one consistent set of tables; retried where another run switched them meanwhile."""
    caught: tuple[type[Exception], ...] = (OSError, CatalogError, *retried)
    for attempt in range(_ATTEMPTS):
        folder = find_catalog(out)
        if folder is None:
            raise no_catalog_error(out)
        before = _identity(out, folder)
        try:
            result = read(folder)
        except caught:
            if _identity(out, folder) == before or attempt == _ATTEMPTS - 1:
                raise
            continue
        if _identity(out, folder) == before:
            return result
    raise UsageError(f"the catalog in {out} is being rewritten all the time; try again when no run is writing to it")


def _identity(out: Path, folder: Path) -> tuple[int, int, tuple[Path, ...]] | None:
    """Identity of OUT's current tables: inode and time of the folder, and the history files; None without a folder."""
    try:
        stat = folder.stat()
    except FileNotFoundError:
        return None
    return stat.st_ino, stat.st_mtime_ns, tuple(history_files(out))


def latest_rows(out: Path | str, *names: str) -> tuple[pd.DataFrame, ...]:
    """Rows of these per-asset tables for the assets of the latest run; unchanged assets have rows of earlier runs.
    Raises UsageError where OUT has no run."""
    runs, history = "runs", HISTORY.name

    def latest(found: pd.DataFrame) -> Sequence[str]:
        return list(found.sort_values("started_at")["run_id"].tail(1))

    found = read_tables(out, dict.fromkeys((runs, *names), WHOLE) | {history: TableSlice(ASSET_KEY)}, latest)
    if found[runs].empty:
        raise UsageError(f"{out}: its catalog has no run; refine a dataset into it first")
    tables = [found[name] for name in names]
    if found[history].empty:
        # Its history was removed: the rows that the run itself wrote are left.
        (run_id,) = latest(found[runs])
        return tuple(table[table["run_id"] == run_id] for table in tables)
    return tuple(table.merge(found[history], on=list(ASSET_KEY), how="inner") for table in tables)


def rows(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """Rows as mappings, with None for every missing value and for what is not finite."""
    return [{str(name): _value(value) for name, value in row.items()} for row in frame.to_dict("records")]


def _value(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return None if value is pd.NA or value is pd.NaT else value
