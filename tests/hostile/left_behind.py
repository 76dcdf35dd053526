"""What a command left behind: texts that must not be in its output, and changes to what is none of its business."""

import hashlib
import os
import sqlite3
import stat
from collections.abc import Iterator, Sequence
from pathlib import Path

import pyarrow.parquet as pq

MOST_READ = 64 * 1024 * 1024
"""Bytes of a file that are looked at."""


def listing(folder: Path, besides: Sequence[Path] = ()) -> dict[str, str]:
    """Path → what is there, of everything below a folder but some folders in it; contents of files as digests."""
    found = {}
    left = [str(folder)]
    while left:
        try:
            entries = list(os.scandir(left.pop()))
        except OSError:
            continue
        for entry in entries:
            if Path(entry.path) in besides:
                continue
            found[os.fsencode(entry.path).decode(errors="backslashreplace")] = _look(entry)
            if entry.is_dir(follow_symlinks=False):
                left.append(entry.path)
    return found


def _look(entry: os.DirEntry[str]) -> str:
    status = entry.stat(follow_symlinks=False)
    if stat.S_ISLNK(status.st_mode):
        return f"link to {os.readlink(entry.path)!r}"
    if not stat.S_ISREG(status.st_mode):
        return oct(status.st_mode)
    if status.st_size > MOST_READ:
        return f"{status.st_size} bytes of {status.st_mtime_ns}"
    return hashlib.sha256(Path(entry.path).read_bytes()).hexdigest()


def holding(folder: Path, text: str) -> list[str]:
    """The files of an output that hold a text, in what they are or in what they decode to."""
    return sorted(
        {str(path.relative_to(folder)) for path in _files(folder) if any(text in part for part in _texts(path))}
    )


def _files(folder: Path) -> Iterator[Path]:
    for place, folders, names in os.walk(folder):
        for name in (*names, *folders):
            path = Path(place, name)
            if path.is_symlink() or path.is_file():
                yield path


def _texts(path: Path) -> Iterator[str]:
    yield path.name
    if path.is_symlink():
        yield os.readlink(path)
        return
    with path.open("rb") as stream:
        content = stream.read(MOST_READ)
    yield content.decode("utf-8", errors="replace")
    yield content.decode("utf-16-le", errors="replace")
    try:
        if content.startswith(b"PAR1"):
            yield str(pq.read_table(path).to_pylist())
        elif content.startswith(b"SQLite format 3"):
            connection = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
            try:
                yield from connection.iterdump()
            finally:
                connection.close()
    except (OSError, sqlite3.Error, ValueError):
        return
