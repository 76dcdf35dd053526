"""Reading the tables behind a URL: local copies, brought up to date each time."""

import logging
import time
from pathlib import Path

import pyarrow.compute as pc
import pyarrow.parquet as pq

from asset2sim.catalog.history import HISTORY_FOLDER, history_files
from asset2sim.catalog.stored_tables import recorded_run_ids
from asset2sim.catalog.switch import CATALOG, find_catalog, no_catalog_error
from asset2sim.storage.lock import lock_output
from asset2sim.storage.mirror import pull
from asset2sim.storage.objects import StoreError, reading_folder, store_usage_error
from schemas.location import Location
from schemas.tables import REVIEWS, TABLES

PARTS = (f"{CATALOG}/", f"{HISTORY_FOLDER}/", f"{REVIEWS.name}/")
UPLOAD_WAIT_S = 5.0
"""Longest wait for a run that is uploading its tables, s: they are a few MB."""
UPLOAD_POLL_S = 0.5
"""Time between two checks whether the upload is done, s."""

logger = logging.getLogger(__name__)


def local_tables(out: Path | str) -> Path:
    """The folder with OUT's tables and history: OUT itself, or up-to-date local copies for a URL. Raises UsageError for
    a store that cannot be read, and where a URL has no catalog."""
    place = Location(out)
    if not place.is_url:
        return place.folder
    folder = reading_folder(place)
    # Other processes on this machine may be updating the same copies.
    with lock_output(folder, wait=True):
        try:
            _bring(place, folder)
        except StoreError as error:
            raise store_usage_error(error) from error
    if find_catalog(folder) is None:
        raise no_catalog_error(place)
    return folder


def _bring(url: str, folder: Path) -> None:
    until = time.monotonic() + UPLOAD_WAIT_S
    while True:
        pull(url, folder, PARTS)
        if not has_unfinished_run(folder):
            break
        if time.monotonic() > until:
            logger.warning(
                "%s: a run was killed while it sent its tables, so `assets` is ahead of `runs`; the next run mends it",
                url,
            )
            break
        time.sleep(UPLOAD_POLL_S)
    repair_history(folder)


def repair_history(folder: Path) -> None:
    """Remove history files of runs that are not in ``runs``."""
    runs = recorded_run_ids(folder)
    for file in history_files(folder):
        # Another version's file may hold several runs.
        if file.stem not in runs and not _runs_of(file) <= runs:
            file.unlink()


def has_unfinished_run(folder: Path) -> bool:
    """Whether ``assets`` has rows of a run that is not in ``runs``: its upload is under way, or was killed."""
    assets = folder / CATALOG / TABLES["assets"].file
    return assets.is_file() and not _runs_of(assets) <= recorded_run_ids(folder)


def _runs_of(file: Path) -> set[str]:
    return set(pc.unique(pq.read_table(file, columns=["run_id"], partitioning=None)["run_id"]).to_pylist())
