"""The history of all runs: ``OUT/history/month=YYYY-MM/RUN_ID.parquet``, a file a run, merged month by month. A file is
written under a hidden name before the catalog changes and gets its own after that, so that a run is in both or in
neither, whenever it is killed."""

import logging
import os
import re
import shutil
from datetime import datetime
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from asset2sim.catalog.enforce import CatalogError, check_key, conform
from asset2sim.catalog.run import RunRow
from asset2sim.catalog.stored_tables import recorded_run_ids
from asset2sim.catalog.switch import replace_file, replace_folder, sync
from schemas.table import ASSET_KEY, TIME
from schemas.tables import COST_COLUMNS, HISTORY

HISTORY_FOLDER = "history"
PATTERN = f"{HISTORY_FOLDER}/month=*/*.parquet"
"""The files, relative to OUT; unfinished ones are hidden and have another suffix."""
MAX_FILES = 64
"""Files that the current month may have before they are merged too: two runs a day."""
MERGED = "merged.parquet"
_READY, _OLD = ".ready", ".old"
_PART = re.compile(r"^\.(?P<run_id>.+)\.parquet\.part$")

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


def _merge_month(month: Path, files: list[Path]) -> None:
    """Write the merged file to a new folder, and replace the month's folder with it."""
    tables = [conform(HISTORY, pq.read_table(file, partitioning=None), str(file)) for file in files]
    rows = pa.concat_tables(tables).sort_by([("started_at", "ascending"), ("asset_id", "ascending")])
    staging = month.with_name(f".{month.name}")
    ready, old = (month.with_name(f".{month.name}{ending}") for ending in (_READY, _OLD))
    staging.mkdir()
    write_synced(rows, staging / MERGED)
    replace_folder(staging, ready, month, old)
