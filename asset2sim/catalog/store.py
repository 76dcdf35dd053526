"""Writing a run into the catalog: merge by key, enforce the schema, switch all tables at once."""

from collections.abc import Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from asset2sim.catalog.enforce import CatalogError, check_key, conform, key_of, to_arrow
from asset2sim.catalog.rows import table_rows
from asset2sim.catalog.run import RunRow
from asset2sim.catalog.switch import find_catalog, recover, replace_catalog
from schemas.asset import AssetRecord
from schemas.table import ASSET_KEY, Table
from schemas.tables import TABLES


def write_run(out: Path, run: RunRow, records: Sequence[AssetRecord]) -> None:
    """Merges a run's records into OUT/catalog; the caller holds ``lock_output(out)``.

    An asset's rows replace its earlier ones of the same method and model in every per-asset table; all other rows stay.
    ``runs`` gains a row; writing the same run again replaces it. Raises CatalogError, and leaves the tables as they
    were, where rows or files that are there do not fit their schema.
    """
    new = {name: to_arrow(TABLES[name], rows) for name, rows in table_rows(run, records).items()}
    recover(out)
    merged = {name: _merge(TABLES[name], _existing(out, TABLES[name]), new[name], new["assets"]) for name in TABLES}
    with replace_catalog(out) as folder:
        for name, rows in merged.items():
            pq.write_table(rows, folder / TABLES[name].file, compression="zstd")


def check_catalog(out: Path) -> None:
    """Raises CatalogError where OUT holds tables that a run could not add to; call it before a long run starts."""
    for table in TABLES.values():
        _existing(out, table)


def _existing(out: Path, table: Table) -> pa.Table:
    """The table as it is in OUT, in today's schema; empty where there is none."""
    folder = find_catalog(out)
    path = folder / table.file if folder else None
    if path is None or not path.is_file():
        return table.schema.empty_table()
    try:
        found = pq.read_table(path)
    except (pa.ArrowException, OSError) as error:
        raise CatalogError(
            f"table '{table.name}': {path} cannot be read ({error}); restore it or move it away"
        ) from error
    return conform(table, found, str(path))


def _merge(table: Table, old: pa.Table, new: pa.Table, assets: pa.Table) -> pa.Table:
    """Old rows whose asset (or run) is not in this run, and the new rows, sorted by key."""
    if table.per_asset:
        replaced = pc.is_in(key_of(old, ASSET_KEY), value_set=key_of(assets, ASSET_KEY).combine_chunks())
    else:
        replaced = pc.is_in(key_of(old, table.key), value_set=key_of(new, table.key).combine_chunks())
    merged = pa.concat_tables([old.filter(pc.invert(replaced)), new])
    check_key(table, merged)
    return merged.sort_by([(name, "ascending") for name in table.key]).combine_chunks()
