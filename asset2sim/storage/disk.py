"""DiskFullError, one line that names the disk and what to do."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from schemas.errors import Asset2SimError, is_disk_full


class DiskFullError(Asset2SimError):
    """The output folder's disk is full; the message names it."""


@contextmanager
def raise_disk_full(out: Path) -> Iterator[None]:
    """Raise DiskFullError, which names the disk and what to do, where the block fails because a disk is full."""
    try:
        yield
    except Asset2SimError:
        raise
    except Exception as error:
        if not is_disk_full(error):
            raise
        raise DiskFullError(_message(out, error)) from error


def _message(out: Path, error: Exception) -> str:
    try:
        free = f", {shutil.disk_usage(out).free / 1e6:.0f} MB free"
    except OSError:
        free = ""
    return (
        f"the disk of {out} is full{free} ({error}); make room and run the same again: the tables hold the last "
        "complete run, and what has finished since is taken up as far as there was room to keep it"
    )
