"""Which version of each object a local folder holds: a SQLite file in it. Losing it costs time only."""

import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

from asset2sim.remote.store import Stored

FILE = ".mirror.db"
WAIT_S = 60.0
"""Time that one process waits for another's entry, s: each takes milliseconds."""
AT_ONCE = 500
"""Names in one question: SQLite takes 999 in its oldest versions."""

_TABLE = """
CREATE TABLE IF NOT EXISTS copies (name TEXT PRIMARY KEY, version TEXT, size INTEGER, mtime_ns INTEGER) WITHOUT ROWID
"""


@dataclass(frozen=True)
class Copy:
    """A local file as it was when it was the same as an object: the object's version, the file's size and time."""

    version: str
    size: int
    mtime_ns: int


def changed(folder: Path, objects: Mapping[str, Stored]) -> list[str]:
    """The names of the objects of which ``folder / name`` is no copy."""
    known = _known(folder, objects)
    return [
        name
        for name, stored in objects.items()
        if (copy := known.get(name)) is None or copy != _copy(folder / name, stored.version)
    ]


def touched(folder: Path, names: Iterable[str]) -> list[str]:
    """The names of the local files that are not what they were when they were last the same as an object."""
    chosen = list(names)
    known = _known(folder, chosen)
    return [name for name in chosen if (mark := known.get(name)) is None or mark != _copy(folder / name, mark.version)]


def note(folder: Path, objects: Mapping[str, Stored]) -> None:
    """``folder / name`` is now a copy of the object, for all of these."""
    rows = []
    for name, stored in objects.items():
        copy = _copy(folder / name, stored.version)
        if copy is not None:
            rows.append((name, copy.version, copy.size, copy.mtime_ns))
    with _open(folder) as index:
        index.executemany("INSERT OR REPLACE INTO copies VALUES (?, ?, ?, ?)", rows)


def _known(folder: Path, names: Iterable[str]) -> dict[str, Copy]:
    chosen = list(names)
    found: dict[str, Copy] = {}
    with _open(folder) as index:
        for start in range(0, len(chosen), AT_ONCE):
            some = chosen[start : start + AT_ONCE]
            marks = ", ".join("?" * len(some))
            rows = index.execute(f"SELECT name, version, size, mtime_ns FROM copies WHERE name IN ({marks})", some)
            found.update((row[0], Copy(*row[1:])) for row in rows)
    return found


def _copy(file: Path, version: str) -> Copy | None:
    try:
        status = file.stat()
    except OSError:
        return None
    return Copy(version, status.st_size, status.st_mtime_ns)


@contextmanager
def _open(folder: Path) -> Iterator[sqlite3.Connection]:
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / FILE
    for last in (False, True):
        try:
            connection = sqlite3.connect(file, timeout=WAIT_S)
            connection.execute(_TABLE)
            break
        except sqlite3.OperationalError:
            raise
        except sqlite3.DatabaseError:
            # Damaged: everything is fetched once more.
            if last:
                raise
            file.unlink(missing_ok=True)
    with closing(connection), connection:
        yield connection
