"""Rows of a run's finished assets, which go into files below OUT as the assets come in, and sorted tables merged as
streams, a few thousand rows at a time: memory does not grow with the dataset. The files are scratch: what a killed run
had finished is in its record files (``runs.plan.records``), from which the next run makes the rows anew."""

import logging
import shutil
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import reduce
from pathlib import Path
from typing import TypeAlias

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from asset2sim.catalog.enforce import CatalogError, check_key, to_arrow
from asset2sim.catalog.rows import asset_rows
from asset2sim.catalog.run import RunRow
from asset2sim.catalog.summarize import summarize
from schemas.asset import AssetRecord, AssetSummary
from schemas.table import ASSET_KEY, Row, Table
from schemas.tables import TABLES

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


def merged_tables(sources: Sequence[Iterable[pa.Table]], key: Sequence[str]) -> Iterator[pa.Table]:
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


FOLDER = ".cache/parts"
"""Under the output folder."""
PART_ROWS = 20_000
"""Rows of all tables that wait in memory, as objects of some 1 kB, before they are written: 100 to 200 assets."""
BATCH_ROWS = 1_000
"""Rows of a part that are read at once when the parts are merged."""
MOST_OPEN = 64
"""Parts that are merged at once; more are merged in steps."""

Key = tuple[str, str, str]
"""Asset id, method and model."""
Source: TypeAlias = Path | pa.Table
"""A part: its file, or its rows where the disk had no room for them."""

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Held:
    """``waiting``: rows by asset and table; ``filed``: the assets whose rows are in ``sources``, by table."""

    waiting: dict[Key, Mapping[str, list[Row]]] = field(default_factory=dict)
    filed: frozenset[Key] = frozenset()
    sources: Mapping[str, tuple[Source, ...]] = field(default_factory=dict)
    parts: int = 0


class Parts:
    """The rows of a run, ``run``, so far. What it holds changes in single steps: an interruption may come anywhere, and
    a record that was being added then may be added again."""

    def __init__(self, run: RunRow, folder: Path) -> None:
        self._run, self._folder = run, folder
        self._held = _Held()
        self._error: CatalogError | None = None

    def add(self, record: AssetRecord) -> AssetSummary:
        """Take a record's rows; returns the record in short. Rows that do not fit their tables are an error of
        ``tables``, so that a run goes on; the records stay in their files."""
        key = (record.ref.asset_id, record.method.value, record.model)
        if key not in self._held.filed and self._error is None:
            self._held.waiting[key] = asset_rows(self._run, record)
            if sum(len(rows) for tables in self._held.waiting.values() for rows in tables.values()) >= PART_ROWS:
                with suppress(CatalogError):
                    self._file(self._store)
        return summarize(record, self._run.settings.thresholds)

    @property
    def keys(self) -> frozenset[Key]:
        """The assets whose rows it has."""
        return self._held.filed | self._held.waiting.keys()

    def tables(self, name: str, without: Collection[Key] = ()) -> list[Iterable[pa.Table]]:
        """The rows of a table, a source a part, in each of which asset ids ascend; ``without`` these assets, whose
        record was being added when the run was stopped. Raises CatalogError."""
        if self._error is not None:
            raise self._error
        if self._held.waiting:
            self._file(lambda table, path: table)
        self._merge_some(name)
        return [_read(source, without) for source in self._held.sources.get(name, ())]

    def _file(self, store: Callable[[pa.Table, Path], Source]) -> None:
        held = self._held
        sources = dict(held.sources)
        try:
            for name in next(iter(held.waiting.values())):
                rows = [row for tables in held.waiting.values() for row in tables[name]]
                if rows:
                    table = to_arrow(TABLES[name], rows).sort_by([(column, "ascending") for column in TABLES[name].key])
                    sources[name] = (*sources.get(name, ()), store(table, self._folder / f"{name}.{held.parts}"))
        except CatalogError as error:
            self._error, self._held = error, _Held()
            raise
        self._held = _Held({}, held.filed | held.waiting.keys(), sources, held.parts + 1)

    def _merge_some(self, name: str) -> None:
        """Merge files of a table until no more than ``MOST_OPEN`` are left."""
        while len(files := [item for item in self._held.sources.get(name, ()) if isinstance(item, Path)]) > MOST_OPEN:
            held, some = self._held, files[:MOST_OPEN]
            path = self._folder / f"{name}.{held.parts}"
            with pa.OSFile(str(path), "wb") as file, _writer(file, TABLES[name].schema) as writer:
                for rows in merged_tables([_read(source) for source in some], TABLES[name].key):
                    writer.write_table(rows, max_chunksize=BATCH_ROWS)
            left = (*(item for item in held.sources[name] if not (isinstance(item, Path) and item in some)), path)
            self._held = replace(held, sources={**held.sources, name: left}, parts=held.parts + 1)
            for source in some:
                source.unlink()

    @staticmethod
    def _store(table: pa.Table, path: Path) -> Source:
        """Write a part; returns its file, or the part itself where it cannot be written."""
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with pa.OSFile(str(path), "wb") as file, _writer(file, table.schema) as writer:
                writer.write_table(table, max_chunksize=BATCH_ROWS)
        except OSError as error:
            logger.warning("rows stay in memory, since %s cannot be written (%s)", path.parent, error.strerror or error)
            with suppress(OSError):
                path.unlink(missing_ok=True)
            return table
        return path


@contextmanager
def open_parts(out: Path, run: RunRow) -> Iterator[Parts]:
    """The parts of a run that holds OUT's lock, removed after the block, as are those that a killed run left."""
    folder = out / FOLDER
    shutil.rmtree(folder, ignore_errors=True)
    try:
        yield Parts(run, folder)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _writer(file: pa.NativeFile, schema: pa.Schema) -> pa.RecordBatchStreamWriter:
    return pa.ipc.new_stream(file, schema, options=pa.ipc.IpcWriteOptions(compression="zstd"))


def _read(source: Source, without: Collection[Key] = ()) -> Iterator[pa.Table]:
    if isinstance(source, pa.Table):
        yield _left(source, without)
        return
    with pa.OSFile(str(source), "rb") as file, pa.ipc.open_stream(file) as reader:
        for batch in reader:
            yield _left(pa.Table.from_batches([batch]), without)


def _left(rows: pa.Table, without: Collection[Key]) -> pa.Table:
    for key in without:
        of_asset = [pc.equal(rows[column], value) for column, value in zip(ASSET_KEY, key, strict=True)]
        rows = rows.filter(pc.invert(reduce(pc.and_, of_asset)))
    return rows
