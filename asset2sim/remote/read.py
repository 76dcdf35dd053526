"""The tables behind a URL, for whoever reads: copies on this machine, brought up to date each time."""

import fcntl
import logging
import os
import time
from pathlib import Path

from asset2sim.catalog.switch import CATALOG, find_catalog, no_catalog
from asset2sim.remote.cache import reading_folder
from asset2sim.remote.mended import is_torn, mend_history
from asset2sim.remote.mirror import pull
from asset2sim.remote.store import StoreError, usage_error
from schemas.location import is_url, location_of

PARTS = (f"{CATALOG}/", "history/")
SENDING_S = 5.0
"""Time in which a run that is sending its tables is waited for, s: they are a few MB ..."""
ASK_EVERY_S = 0.5
"""... and how often it is asked whether it is done, s."""

logger = logging.getLogger(__name__)


def local_tables(out: str | os.PathLike[str]) -> Path:
    """The folder with OUT's tables and history: OUT itself, or copies of what lies behind its URL now.

    Raises UsageError for a store that cannot be read, and where a URL has no catalog.
    """
    place = location_of(out)
    if not is_url(place):
        return place
    folder = reading_folder(place)
    folder.mkdir(parents=True, exist_ok=True)
    handle = os.open(folder / ".lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    try:
        # Others on this machine may bring the same copies up to date.
        fcntl.flock(handle, fcntl.LOCK_EX)
        _bring(place, folder)
    except StoreError as error:
        raise usage_error(error) from error
    finally:
        os.close(handle)
    if find_catalog(folder) is None:
        raise no_catalog(place)
    return folder


def _bring(url: str, folder: Path) -> None:
    until = time.monotonic() + SENDING_S
    while True:
        pull(url, folder, PARTS)
        if not is_torn(folder):
            break
        if time.monotonic() > until:
            logger.warning(
                "%s: a run was killed while it sent its tables, so `assets` is ahead of `runs`; the next run mends it",
                url,
            )
            break
        time.sleep(ASK_EVERY_S)
    mend_history(folder)
