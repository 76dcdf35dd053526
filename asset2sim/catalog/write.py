"""Writing a run into the catalog: merge by key, enforce the schema, switch all tables at once, and keep the history."""

from collections.abc import Collection, Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from asset2sim.catalog.enforce import check_key, row_keys, to_arrow
from asset2sim.catalog.history import commit_history, compact_history, history_rows, recover_months, stage_history
from asset2sim.catalog.rows import table_rows
from asset2sim.catalog.run import RunRow
from asset2sim.catalog.stored_tables import stored_columns, stored_table, table_path
from asset2sim.catalog.switch import recover, replace_catalog
from schemas.asset import AssetRecord, Unchanged
from schemas.table import ASSET_KEY, Table
from schemas.tables import HISTORY, TABLES

_KEYS = pa.schema([(name, pa.string()) for name in ASSET_KEY])


def write_run(
    out: Path,
    run: RunRow,
    records: Sequence[AssetRecord],
    unchanged: Sequence[Unchanged] = (),
    present: Collection[str] | None = None,
    *,
    compact: bool = True,
) -> None:
    """Merge a run's records into OUT/catalog and OUT/history; the caller holds ``lock_output(out)``.

    An asset's rows replace its earlier ones of the same method and model in every per-asset table; all other rows stay,
    those of the run's ``unchanged`` assets among them. ``present`` holds the ids of all assets in the dataset, None for
    a run over a part of it. With ``present``, rows of other assets that runs over the same dataset wrote are removed.
    ``runs`` gains a row and ``asset_history`` a row per asset; writing the same run again replaces them.
    Without ``compact`` the files of the history are not merged.
    Raises CatalogError, and leaves the tables as they were, where rows or files that are there do not fit their schema.
    """
    new = {name: to_arrow(TABLES[name], rows) for name, rows in table_rows(run, records, unchanged).items()}
    recover(out)
    recover_months(out)
    commit_history(out)
    replaced = _replaced(out, run, new["assets"], present)
    with replace_catalog(out) as folder:
        for table in TABLES.values():
            if _needs_no_rewrite(out, table, new[table.name], replaced):
                merged = stored_columns(out, table, HISTORY.schema.names) if table.name == "assets" else None
            else:
                merged = _merge(table, stored_table(out, table), new[table.name], replaced)
                pq.write_table(merged, folder / table.file, compression="zstd")
            if table.name == "assets" and merged is not None:
                stage_history(out, run, history_rows(run, merged, _is_of_run(merged, run, new["assets"], unchanged)))
    commit_history(out)
    if compact:
        compact_history(out, run.started_at)


def _replaced(out: Path, run: RunRow, assets: pa.Table, present: Collection[str] | None) -> pa.Array:
    """(n,) string: keys of the assets whose old rows are removed: the run has new ones, or they left the dataset."""
    new = row_keys(assets, ASSET_KEY).combine_chunks()
    if present is None:
        return new
    old, runs = stored_columns(out, TABLES["assets"], (*ASSET_KEY, "run_id")), stored_table(out, TABLES["runs"])
    own = runs.filter(pc.equal(runs["dataset"], run.dataset))["run_id"].combine_chunks()
    known = pa.array(sorted(present), type=pa.string())
    gone = pc.and_(pc.is_in(old["run_id"], value_set=own), pc.invert(pc.is_in(old["asset_id"], value_set=known)))
    return pa.concat_arrays([new, row_keys(old.filter(gone), ASSET_KEY).combine_chunks()])


def _is_of_run(assets: pa.Table, run: RunRow, new: pa.Table, unchanged: Sequence[Unchanged]) -> pa.ChunkedArray:
    """(n,) bool: which rows of ``assets`` are of the run's assets."""
    settings = run.settings
    same = {"method": settings.method.value, "model": settings.model.model}
    left = pa.Table.from_pylist([{"asset_id": item.asset_id} | same for item in unchanged] or [], schema=_KEYS)
    own = pa.concat_arrays([row_keys(table, ASSET_KEY).combine_chunks() for table in (new, left)])
    return pc.is_in(row_keys(assets, ASSET_KEY), value_set=own)


def _needs_no_rewrite(out: Path, table: Table, new: pa.Table, replaced: pa.Array) -> bool:
    """Whether the table's file needs no rewrite: no row is added or removed, and it has today's schema."""
    path = table_path(out, table)
    if new.num_rows or len(replaced) or path is None:
        return False
    return bool(pq.read_schema(path).equals(table.schema, check_metadata=True))


def _merge(table: Table, old: pa.Table, new: pa.Table, replaced: pa.Array) -> pa.Table:
    """Old rows whose asset (or run) is not replaced, and the new rows, sorted by key."""
    if table.per_asset:
        gone = pc.is_in(row_keys(old, ASSET_KEY), value_set=replaced)
    else:
        gone = pc.is_in(row_keys(old, table.key), value_set=row_keys(new, table.key).combine_chunks())
    merged = pa.concat_tables([old.filter(pc.invert(gone)), new])
    check_key(table, merged)
    return merged.sort_by([(name, "ascending") for name in table.key]).combine_chunks()
