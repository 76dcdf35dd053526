"""The history of all runs: ``OUT/history/month=YYYY-MM/RUN_ID.parquet``, a file a run, merged month by month. A file is
written under a hidden name before the catalog changes and gets its own after that, so that a run is in both or in
neither, whenever it is killed."""

import logging
import os
import re
import shutil
from collections.abc import Collection, Iterator
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from asset2sim.catalog.enforce import CatalogError, check_key, conform
from asset2sim.catalog.parts import ROW_GROUP
from asset2sim.catalog.run import RunRow
from asset2sim.catalog.stored_tables import recorded_run_ids, stored_columns
from asset2sim.catalog.switch import replace_file, replace_folder, sync
from schemas.table import ASSET_KEY, TIME
from schemas.tables import COST_COLUMNS, HISTORY, TABLES

HISTORY_FOLDER = "history"
PATTERN = f"{HISTORY_FOLDER}/month=*/*.parquet"
"""The files, relative to OUT; unfinished ones are hidden and have another suffix."""
MAX_FILES = 64
"""Files that the current month may have before they are merged too: two runs a day."""
MERGED = "merged.parquet"
_READY, _OLD = ".ready", ".old"
_PART = re.compile(r"^\.(?P<run_id>.+)\.parquet\.part$")

_NO_TIME = datetime.min.replace(tzinfo=UTC)

logger = logging.getLogger(__name__)


def history_files(out: Path) -> list[Path]:
    """The files of the history, oldest month first."""
    return sorted(out.glob(PATTERN))


def history_rows(run: RunRow, assets: pa.Table, chosen: pa.ChunkedArray) -> pa.Table:
    """Rows of ``asset_history`` for a run. ``assets`` is the table after the run, and ``chosen`` (n,) bool marks the
    rows of the run's assets. A row that an earlier run wrote is of an unchanged asset, whose cost in this run is 0."""
    rows = assets.filter(chosen)
    unchanged = pc.not_equal(rows["run_id"], run.run_id)
    made: dict[str, pa.ChunkedArray | pa.Array] = {name: rows[name] for name in rows.schema.names}
    made["run_id"] = pa.repeat(pa.scalar(run.run_id), rows.num_rows)
    made["started_at"] = pa.repeat(pa.scalar(run.started_at, type=TIME), rows.num_rows)
    made["unchanged"] = unchanged
    for name in COST_COLUMNS:
        made[name] = pc.if_else(unchanged, pa.scalar(0, type=rows[name].type), rows[name])
    columns = [made[field.name].cast(field.type) for field in HISTORY.schema]
    built = pa.Table.from_arrays(columns, schema=HISTORY.schema)
    check_key(HISTORY, built)
    return built.sort_by([(name, "ascending") for name in ASSET_KEY])


def stage_history(out: Path, run: RunRow, rows: pa.Table) -> None:
    """Write a run's file under its hidden name."""
    folder = out / HISTORY_FOLDER / f"month={run.started_at:%Y-%m}"
    folder.mkdir(parents=True, exist_ok=True)
    sync(folder.parent)
    write_synced(rows, folder / f".{run.run_id}.parquet.part")


def commit_history(out: Path) -> None:
    """Rename the staged files of the catalog's runs to their final names; remove those of other runs."""
    runs = recorded_run_ids(out)
    for part in sorted((out / HISTORY_FOLDER).glob("month=*/.*.parquet.part")):
        match = _PART.match(part.name)
        if match is not None and match["run_id"] in runs:
            replace_file(part, part.with_name(f"{match['run_id']}.parquet"))
        else:
            part.unlink()


def write_synced(rows: pa.Table, path: Path) -> None:
    """Write a Parquet file, and sync it and its folder so that it survives a power loss."""
    pq.write_table(rows, path, compression="zstd")
    sync(path)
    sync(path.parent)


def compact_history(out: Path, now: datetime) -> None:
    """Merge the files of every month before ``now``'s, and of ``now``'s own if there are many; needs OUT's lock. A
    month that cannot be merged stays as it is."""
    recover_months(out)
    for month in sorted((out / HISTORY_FOLDER).glob("month=*")):
        files = sorted(month.glob("*.parquet"))
        closed = month.name < f"month={now:%Y-%m}"
        if len(files) > (1 if closed else MAX_FILES):
            try:
                _merge_month(month, files)
            except (CatalogError, pa.ArrowException, OSError) as error:
                logger.warning("the history in %s stays in %d files (%s)", month, len(files), error)


def recover_months(out: Path) -> None:
    """Clean up after a killed compaction: put a complete merged month in its place, and remove the rest."""
    for folder in sorted((out / HISTORY_FOLDER).glob(".month=*")):
        month = folder.with_name(folder.name.removesuffix(_READY).removesuffix(_OLD)[1:])
        if not month.exists() and folder.name.endswith((_READY, _OLD)):
            os.rename(folder, month)
        else:
            shutil.rmtree(folder, ignore_errors=True)


def _merge_month(month: Path, files: list[Path], without: Collection[str] = ()) -> None:
    """Write the merged file, without the runs ``without``, to a new folder, and replace the month's folder with it."""
    staging = month.with_name(f".{month.name}")
    ready, old = (month.with_name(f".{month.name}{ending}") for ending in (_READY, _OLD))
    staging.mkdir()
    removed = pa.array(sorted(without), type=pa.string())
    try:
        with pq.ParquetWriter(staging / MERGED, HISTORY.schema, compression="zstd") as writer:
            for rows in _by_start(files):
                writer.write_table(rows.filter(pc.invert(pc.is_in(rows["run_id"], value_set=removed))))
        sync(staging / MERGED)
        sync(staging)
    except BaseException:
        shutil.rmtree(staging, ignore_errors=True)
        raise
    replace_folder(staging, ready, month, old)


def _by_start(files: list[Path]) -> Iterator[pa.Table]:
    """The rows of files by start of the run and asset, some at a time: each file holds them in this order, and one's
    runs began after the other's. Where they did not, all rows at once."""
    spans = sorted((*_span(file), file) for file in files)
    if any(later[0] <= earlier[1] for earlier, later in pairwise(spans)):
        tables = [conform(HISTORY, pq.read_table(file, partitioning=None), str(file)) for file in files]
        yield pa.concat_tables(tables).sort_by([("started_at", "ascending"), ("asset_id", "ascending")])
        return
    for *_, file in spans:
        with pq.ParquetFile(file) as stored:
            for batch in stored.iter_batches(ROW_GROUP, use_threads=False):
                yield conform(HISTORY, pa.Table.from_batches([batch]), str(file))


def _span(file: Path) -> tuple[datetime, datetime]:
    """When the first and the last run in a file began; the earliest of times where it is empty."""
    starts = pq.read_table(file, columns=["started_at"], partitioning=None)["started_at"]
    ends = pc.min_max(starts).as_py()
    return (ends["min"] or _NO_TIME, ends["max"] or _NO_TIME)


def remove_old_history(out: Path, now: datetime, days: int) -> str | None:
    """Remove the rows of runs that began over ``days`` days before ``now``; needs OUT's lock. The newest run over each
    dataset and subset with its method and model stays. Returns a line that says what was removed, None for nothing."""
    recover_months(out)
    limit, newest = now - timedelta(days=days), newest_runs(out)
    rows, runs = 0, set[str]()
    for month in sorted((out / HISTORY_FOLDER).glob("month=*")):
        files = sorted(month.glob("*.parquet"))
        if month.name > f"month={limit:%Y-%m}" or not files:
            continue
        found = pa.concat_tables(
            pq.read_table(file, columns=["run_id", "started_at"], partitioning=None) for file in files
        )
        old = found.filter(pc.less(found["started_at"], pa.scalar(limit, type=TIME)))["run_id"]
        old = old.filter(pc.invert(pc.is_in(old, value_set=pa.array(sorted(newest), type=pa.string()))))
        if not len(old):
            continue
        gone = set(pc.unique(old).to_pylist())
        if len(old) == found.num_rows:
            shutil.rmtree(month)
        else:
            _merge_month(month, files, gone)
        rows, runs = rows + len(old), runs | gone
    return f"history: removed {rows} rows of {len(runs)} runs from before {limit:%Y-%m-%d}" if runs else None


def newest_runs(out: Path) -> frozenset[str]:
    """Ids of the last run over each dataset and subset with its method and model."""
    same = ("dataset", "subset", "method", "model")
    rows = stored_columns(out, TABLES["runs"], ("run_id", "started_at", *same)).sort_by("started_at").to_pylist()
    return frozenset({tuple(row[name] for name in same): row["run_id"] for row in rows}.values())
