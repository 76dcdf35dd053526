"""Replacing all tables at once: a folder of new files is swapped with the old one in a single step.

The new files are written to ``.catalog.staging`` and synced; the folder is renamed to ``.catalog.ready``, a name that
only a complete folder has; then it is swapped with ``catalog``. Where the system can exchange two names (Linux) there
is no moment without ``catalog``; elsewhere two renames leave a short one, in which ``find_catalog`` returns the other
folder.
"""

import ctypes
import errno
import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from schemas.errors import UsageError

CATALOG = "catalog"
STAGING = ".catalog.staging"
READY = ".catalog.ready"
OLD = ".catalog.old"

_AT_FDCWD = -100
_RENAME_EXCHANGE = 2
_CANNOT_EXCHANGE = (errno.ENOSYS, errno.EINVAL, errno.ENOTSUP, errno.EPERM)


def find_catalog(out: Path) -> Path | None:
    """The folder that holds OUT's last complete set of tables; None if there is none. Changes nothing."""
    return next((out / name for name in (CATALOG, READY, OLD) if (out / name).is_dir()), None)


def no_catalog_error(out: Path | str) -> UsageError:
    """UsageError for an OUT without a catalog."""
    return UsageError(f"no catalog in {out}: run 'asset2sim refine DATA --out {out}' first, or name another --out")


def recover(out: Path) -> None:
    """Clean up after a killed run: make the last complete set ``catalog``, remove the rest. Needs the lock of OUT."""
    found = find_catalog(out)
    if found is not None and found.name != CATALOG:
        os.rename(found, out / CATALOG)
        sync(out)
    for name in (STAGING, READY, OLD):
        if (out / name).is_dir():
            shutil.rmtree(out / name)


@contextmanager
def replace_catalog(out: Path) -> Iterator[Path]:
    """Yields an empty folder for the new tables; on exit without an exception it becomes ``catalog``. Other files in
    ``catalog`` are copied to the new folder. Needs the output's lock; call ``recover`` first."""
    staging = out / STAGING
    staging.mkdir(parents=True)
    try:
        yield staging
        _carry_over(out / CATALOG, staging)
        for path in [*sorted(staging.rglob("*")), staging]:
            sync(path)
    except BaseException:
        shutil.rmtree(staging, ignore_errors=True)
        raise
    os.rename(staging, out / READY)
    sync(out)
    if not (out / CATALOG).exists():
        os.rename(out / READY, out / CATALOG)
    elif swap_names(out / READY, out / CATALOG):
        os.rename(out / READY, out / OLD)
    else:
        os.rename(out / CATALOG, out / OLD)
        os.rename(out / READY, out / CATALOG)
    sync(out)
    shutil.rmtree(out / OLD, ignore_errors=True)


def swap_names(first: Path, second: Path) -> bool:
    """Swaps two names in one step; False where the system or the file system cannot."""
    if not sys.platform.startswith("linux"):
        return False
    rename = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if rename is None:
        return False
    if rename(_AT_FDCWD, os.fsencode(first), _AT_FDCWD, os.fsencode(second), _RENAME_EXCHANGE) == 0:
        return True
    code = ctypes.get_errno()
    if code in _CANNOT_EXCHANGE:
        return False
    raise OSError(code, os.strerror(code), str(first), None, str(second))


def _carry_over(source: Path, staging: Path) -> None:
    if not source.is_dir():
        return
    for entry in source.iterdir():
        target = staging / entry.name
        if target.exists():
            continue
        if entry.is_dir() and not entry.is_symlink():
            shutil.copytree(entry, target, symlinks=True)
        else:
            shutil.copy2(entry, target, follow_symlinks=False)


def sync(path: Path) -> None:
    """Bring a file's content, or the names in a folder, to the disk, so that they survive a power loss."""
    if path.is_symlink():
        return
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def replace_file(staged: Path, place: Path) -> None:
    """Rename a file that is written to its place; a power loss leaves the old file or the whole new one."""
    sync(staged)
    os.replace(staged, place)
    sync(place.parent)
