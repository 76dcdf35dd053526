"""Merging a month's history files into one, so that the number of files stays small."""

import logging
import os
import shutil
from datetime import datetime
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from asset2sim.catalog.enforce import CatalogError, conform
from asset2sim.catalog.history import HISTORY_FOLDER, write_synced
from asset2sim.catalog.switch import replace_folder
from schemas.tables import HISTORY

MAX_FILES = 64
"""Files that the current month may have before they are merged too: two runs a day."""
MERGED = "merged.parquet"
_READY, _OLD = ".ready", ".old"

logger = logging.getLogger(__name__)


def compact_history(out: Path, now: datetime) -> None:
    """Merge the files of every month before ``now``'s, and of ``now``'s own if there are many; needs OUT's lock.

    A month that cannot be merged stays as it is.
    """
    recover_months(out)
    for month in sorted((out / HISTORY_FOLDER).glob("month=*")):
        files = sorted(month.glob("*.parquet"))
        closed = month.name < f"month={now:%Y-%m}"
        if len(files) > (1 if closed else MAX_FILES):
            try:
                _merge(month, files)
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


def _merge(month: Path, files: list[Path]) -> None:
    """Write the merged file to a new folder, and replace the month's folder with it."""
    tables = [conform(HISTORY, pq.read_table(file, partitioning=None), str(file)) for file in files]
    rows = pa.concat_tables(tables).sort_by([("started_at", "ascending"), ("asset_id", "ascending")])
    staging = month.with_name(f".{month.name}")
    ready, old = (month.with_name(f".{month.name}{ending}") for ending in (_READY, _OLD))
    staging.mkdir()
    write_synced(rows, staging / MERGED)
    replace_folder(staging, ready, month, old)
