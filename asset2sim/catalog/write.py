"""Writing a run into the catalog: merge by key, enforce the schema, switch all tables at once, and keep the history."""

from collections.abc import Collection, Iterable, Iterator, Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from asset2sim.catalog.enforce import check_key, row_keys, to_arrow
from asset2sim.catalog.history import commit_history, history_rows, stage_history
from asset2sim.catalog.own_files import make_own_files
from asset2sim.catalog.parts import Parts, merged_tables, open_parts, write_merged
from asset2sim.catalog.rows import run_row
from asset2sim.catalog.run import RunRow
from asset2sim.catalog.stored_tables import stored_by_asset, stored_columns, stored_table, table_path
from asset2sim.catalog.switch import recover, replace_catalog
from schemas.asset import AssetRecord, AssetSummary, Unchanged
from schemas.table import ASSET_KEY, Table
from schemas.tables import HISTORY, REVIEWS, TABLES

_KEYS = pa.schema([(name, pa.string()) for name in ASSET_KEY])


def write_run(
    out: Path,
    run: RunRow,
    records: Sequence[AssetRecord],
    unchanged: Sequence[Unchanged] = (),
    present: Collection[str] | None = None,
) -> None:
    """Merge records into OUT/catalog and OUT/history as ``write_parts`` does, which has their rows already."""
    with open_parts(out, run) as parts:
        refined = tuple(parts.add(record) for record in records)
        write_parts(out, run, parts, refined, unchanged, present)


def write_parts(
    out: Path,
    run: RunRow,
    parts: Parts,
    refined: Sequence[AssetSummary],
    unchanged: Sequence[Unchanged] = (),
    present: Collection[str] | None = None,
) -> None:
    """Merge a run's ``parts`` into OUT/catalog and OUT/history; the caller holds ``lock_output(out)``. ``refined`` are
    the assets whose rows the parts have. Memory grows with the number of assets, not with their rows.

    An asset's rows replace its earlier ones of the same method and model in every per-asset table; all other rows stay,
    those of the run's ``unchanged`` assets among them. ``present`` holds the ids of all assets in the dataset, None for
    a run over a part of it. With ``present``, rows of other assets that runs over the same dataset wrote are removed.
    ``runs`` gains a row and ``asset_history`` a row per asset; writing the same run again replaces them.
    Raises CatalogError, and leaves the tables as they were, where rows or files that are there do not fit their schema.
    """
    runs = to_arrow(TABLES["runs"], [run_row(run, refined, unchanged)])
    keys = [(item.ref.asset_id, item.method.value, item.model) for item in refined]
    half = parts.keys.difference(keys)
    new = {name: parts.tables(name, half) for name, table in TABLES.items() if table.per_asset}
    own = _keys(keys)
    check_key(TABLES["assets"], own)
    recover(out)
    commit_history(out)
    replaced = _replaced(out, run, own, present)
    with replace_catalog(out) as folder:
        for table in TABLES.values():
            if not table.per_asset:
                pq.write_table(
                    _with_run(table, stored_table(out, table), runs), folder / table.file, compression="zstd"
                )
            elif new[table.name] or not _needs_no_rewrite(out, table, replaced):
                rows = merged_tables([_kept(out, table, replaced), *new[table.name]], table.key)
                write_merged(rows, table, folder / table.file)
        written = folder / TABLES["assets"].file
        if written.is_file():
            names = [name for name in TABLES["assets"].schema.names if name in HISTORY.schema.names]
            assets = pq.read_table(written, columns=names)
        else:
            assets = stored_columns(out, TABLES["assets"], HISTORY.schema.names)
        stage_history(out, run, history_rows(run, assets, _is_of_run(assets, run, own, unchanged)))
    commit_history(out)
    make_own_files(out, REVIEWS)


def _replaced(out: Path, run: RunRow, own: pa.Table, present: Collection[str] | None) -> pa.Array:
    """(n,) string: keys of the assets whose old rows are removed: the run has new ones, or they left the dataset."""
    new = row_keys(own, ASSET_KEY).combine_chunks()
    if present is None:
        return new
    old, runs = stored_columns(out, TABLES["assets"], (*ASSET_KEY, "run_id")), stored_table(out, TABLES["runs"])
    same = runs.filter(pc.equal(runs["dataset"], run.dataset))["run_id"].combine_chunks()
    known = pa.array(sorted(present), type=pa.string())
    gone = pc.and_(pc.is_in(old["run_id"], value_set=same), pc.invert(pc.is_in(old["asset_id"], value_set=known)))
    return pa.concat_arrays([new, row_keys(old.filter(gone), ASSET_KEY).combine_chunks()])


def _is_of_run(assets: pa.Table, run: RunRow, own: pa.Table, unchanged: Sequence[Unchanged]) -> pa.ChunkedArray:
    """(n,) bool: which rows of ``assets`` are of the run's assets."""
    settings = run.settings
    left = _keys((item.asset_id, settings.method.value, settings.model.model) for item in unchanged)
    every = pa.concat_arrays([row_keys(table, ASSET_KEY).combine_chunks() for table in (own, left)])
    return pc.is_in(row_keys(assets, ASSET_KEY), value_set=every)


def _keys(keys: Iterable[tuple[str, str, str]]) -> pa.Table:
    """Keys of assets, a row each."""
    return pa.Table.from_pylist([dict(zip(ASSET_KEY, key, strict=True)) for key in keys], schema=_KEYS)


def _needs_no_rewrite(out: Path, table: Table, replaced: pa.Array) -> bool:
    """Whether the file of a table without new rows needs no rewrite: none is removed, and it has today's schema."""
    path = table_path(out, table)
    if len(replaced) or path is None:
        return False
    return bool(pq.read_schema(path).equals(table.schema, check_metadata=True))


def _kept(out: Path, table: Table, replaced: pa.Array) -> Iterator[pa.Table]:
    """The rows in OUT whose asset is not replaced."""
    for old in stored_by_asset(out, table):
        yield old.filter(pc.invert(pc.is_in(row_keys(old, ASSET_KEY), value_set=replaced)))


def _with_run(table: Table, old: pa.Table, new: pa.Table) -> pa.Table:
    """The rows of ``runs`` with this run's, in the place of one that it has already, sorted by key."""
    gone = pc.is_in(row_keys(old, table.key), value_set=row_keys(new, table.key).combine_chunks())
    every = pa.concat_tables([old.filter(pc.invert(gone)), new])
    check_key(table, every)
    return every.sort_by([(name, "ascending") for name in table.key]).combine_chunks()
