"""Sorted tables merged as streams, a few thousand rows at a time, so that memory does not grow with the dataset."""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from asset2sim.catalog.enforce import check_key
from schemas.table import Table

ROW_GROUP = 50_000
"""Rows of a Parquet row group, at least: some 10 MB in memory."""


def whole_assets(tables: Iterable[pa.Table]) -> Iterator[pa.Table]:
    """The same rows, in which asset ids ascend, in tables none of which ends in the middle of an asset."""
    left: pa.Table | None = None
    for table in tables:
        rows = table if left is None else pa.concat_tables([left, table])
        if not rows.num_rows:
            continue
        ids = rows["asset_id"]
        end = pc.index(ids, ids[-1]).as_py()
        left = rows.slice(end)
        if end:
            yield rows.slice(0, end)
    if left is not None:
        yield left


def merged(sources: Sequence[Iterable[pa.Table]], key: Sequence[str]) -> Iterator[pa.Table]:
    """The rows of all sources as tables sorted by ``key``, which begins with ``asset_id``; no later table holds an
    asset of an earlier one. In every source asset ids ascend."""
    waiting = [whole_assets(source) for source in sources]
    heads = [next(source, None) for source in waiting]
    while live := [head for head in heads if head is not None]:
        last = min(head["asset_id"][-1].as_py() for head in live)
        taken = []
        for place, head in enumerate(heads):
            if head is None:
                continue
            count = pc.sum(pc.less_equal(head["asset_id"], last)).as_py()
            taken.append(head.slice(0, count))
            heads[place] = head.slice(count) if count < head.num_rows else next(waiting[place], None)
        yield pa.concat_tables(taken).sort_by([(name, "ascending") for name in key]).combine_chunks()


def write_merged(tables: Iterable[pa.Table], table: Table, path: Path) -> None:
    """Write a Parquet file of these tables, one after the other; each holds all rows of its assets, or of its runs.
    Raises CatalogError where two rows share a key."""
    with pq.ParquetWriter(path, table.schema, compression="zstd") as writer:
        held: list[pa.Table] = []
        for rows in tables:
            check_key(table, rows)
            held.append(rows)
            if sum(item.num_rows for item in held) >= ROW_GROUP:
                writer.write_table(pa.concat_tables(held))
                held = []
        if held:
            writer.write_table(pa.concat_tables(held))


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
