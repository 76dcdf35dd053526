"""Full disks: recognising the error, and a one-line message."""

import errno
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from schemas.errors import Asset2SimError

FULL = (errno.ENOSPC, errno.EDQUOT)
"""Error numbers of a full disk and of an exhausted quota."""


class DiskFullError(Asset2SimError):
    """The output folder's disk is full; the message names it."""


def is_disk_full(error: BaseException) -> bool:
    """Whether an error, or one in its chain of causes, is due to a full disk."""
    seen: set[int] = set()
    step: BaseException | None = error
    while step is not None and id(step) not in seen:
        if isinstance(step, OSError) and step.errno in FULL:
            return True
        if isinstance(step, sqlite3.Error) and getattr(step, "sqlite_errorcode", None) == sqlite3.SQLITE_FULL:
            return True
        seen.add(id(step))
        step = step.__cause__ or step.__context__
    return False


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
