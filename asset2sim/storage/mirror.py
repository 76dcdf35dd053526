"""Synchronising a local folder and the objects below a URL: changed files are copied, missing ones removed."""

import os
import shutil
import sqlite3
import tempfile
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import astuple, dataclass
from pathlib import Path

from asset2sim.storage.objects import (
    Stored,
    StoreError,
    fetch_objects,
    list_objects,
    object_info,
    reading_folder,
    remove_objects,
    send_objects,
)
from schemas.location import Location

FILE = ".mirror.db"
WAIT_S = 60.0
"""Time that one process waits for another's entry, s: each takes milliseconds."""
AT_ONCE = 500
"""Names in one query: old versions of SQLite take 999."""
INCOMING_PREFIX = ".coming-"
"""Name prefix of the folder into which files are downloaded before they are moved to their places."""
LIST_FOLDER_FROM = 3
"""Number of objects in one folder from which listing the folder is faster than asking for each object."""
ATTEMPTS = 20
"""Attempts to fetch a set of objects while another run writes to it."""

_TABLE = """
CREATE TABLE IF NOT EXISTS copies (name TEXT PRIMARY KEY, version TEXT, size INTEGER, mtime_ns INTEGER) WITHOUT ROWID
"""


@dataclass(frozen=True)
class Copy:
    """A local file when it last equalled its object: the object's version, the file's size and modification time."""

    version: str
    size: int
    mtime_ns: int


def changed_objects(folder: Path, objects: Mapping[str, Stored]) -> list[str]:
    """Names of the objects whose local copy ``folder / name`` is missing or out of date."""
    known = _known(folder, objects)
    return [
        name
        for name, stored in objects.items()
        if (copy := known.get(name)) is None or copy != _copy(folder / name, stored.version)
    ]


def changed_on_disk(folder: Path, names: Iterable[str]) -> list[str]:
    """Those of these local files that changed since they last equalled their object, or never did."""
    chosen = list(names)
    known = _known(folder, chosen)
    return [name for name in chosen if (mark := known.get(name)) is None or mark != _copy(folder / name, mark.version)]


def note_copies(folder: Path, objects: Mapping[str, Stored]) -> None:
    """Record that ``folder / name`` is now a copy of the object, for each of these."""
    copies = [(name, _copy(folder / name, stored.version)) for name, stored in objects.items()]
    rows = [(name, *astuple(copy)) for name, copy in copies if copy is not None]
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


class ObjectsChangedError(StoreError):
    """The objects kept changing while they were being read."""


def look_below(url: str, parts: Iterable[str]) -> dict[str, Stored]:
    """Name → object, of these folders and files below a URL. A part that ends with a slash is a folder."""
    found: dict[str, Stored] = {}
    for part in parts:
        if part.endswith("/"):
            found |= {f"{part}{name}": stored for name, stored in list_objects(f"{url}/{part[:-1]}").items()}
        elif (stored := object_info(f"{url}/{part}")) is not None:
            found[part] = stored
    return found


def pull(url: str, folder: Path, parts: Collection[str]) -> None:
    """Make these parts of a local folder equal to those below the URL. The copy is consistent: objects are listed again
    after each download, until nothing changed meanwhile. Local files without an object are removed. Raises
    ObjectsChangedError where the objects keep changing."""
    there = look_below(url, parts)
    for _ in range(ATTEMPTS):
        names = changed_objects(folder, there)
        if not names:
            break
        try:
            fetch(url, folder, {name: there[name] for name in names})
        except StoreError as error:
            # Removed since it was listed, most likely.
            if not error.missing:
                raise
        there = look_below(url, parts)
    else:
        raise ObjectsChangedError(f"{url} is being written to all the time; try again later")
    remove_others(folder, parts, there)


def local_parts(place: Location, parts: Collection[str]) -> Path:
    """The folder with these parts of an output for readers: its own, or up-to-date copies. Raises StoreError."""
    if not place.is_url:
        return place.folder
    folder = reading_folder(place)
    pull(place, folder, parts)
    return folder


def fetch(url: str, folder: Path, objects: Mapping[str, Stored]) -> None:
    """Download these objects into a local folder, each file in one atomic step, and record their versions."""
    if not objects:
        return
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=INCOMING_PREFIX, dir=folder) as coming:
        arrivals = {name: Path(coming, str(number)) for number, name in enumerate(objects)}
        fetch_objects({f"{url}/{name}": path for name, path in arrivals.items()})
        for name, path in arrivals.items():
            place = folder / name
            place.parent.mkdir(parents=True, exist_ok=True)
            os.replace(path, place)
    note_copies(folder, objects)


def push(url: str, folder: Path, names: Iterable[str]) -> None:
    """Upload those of these local files that changed since they last equalled their objects."""
    going = changed_on_disk(folder, names)
    send_objects({f"{url}/{name}": folder / name for name in going})
    note_copies(folder, _look_for(url, going))


def _look_for(url: str, names: Iterable[str]) -> dict[str, Stored]:
    """Name → object as it is in the store now: asked one by one, or by folder from ``LIST_FOLDER_FROM`` objects on."""
    groups: dict[str, list[str]] = defaultdict(list)
    for name in names:
        groups[name.rpartition("/")[0]].append(name)
    found: dict[str, Stored] = {}
    for folder, inside in groups.items():
        there = look_below(url, inside if len(inside) < LIST_FOLDER_FROM or not folder else [f"{folder}/"])
        found |= {name: there[name] for name in inside if name in there}
    return found


def send_folder(url: str, folder: Path) -> None:
    """Make the objects below a URL equal to a local folder: upload every file, then remove objects without a file."""
    files = {path.relative_to(folder).as_posix(): path for path in sorted(folder.rglob("*")) if path.is_file()}
    send_objects({f"{url}/{name}": path for name, path in files.items()})
    remove_objects([f"{url}/{name}" for name in list_objects(url) if name not in files])


def remove_tree(folder: Path) -> None:
    """Remove a local folder; it is renamed first, so that no reader finds half of it."""
    gone = folder.with_name(f".{folder.name}.gone")
    shutil.rmtree(gone, ignore_errors=True)
    os.replace(folder, gone)
    shutil.rmtree(gone, ignore_errors=True)


def local_names(folder: Path, parts: Iterable[str]) -> list[str]:
    """The names of the files in these parts of a local folder; hidden ones below them are left out."""
    names: list[str] = []
    for part in parts:
        if not part.endswith("/"):
            names += [part] if (folder / part).is_file() else []
            continue
        base = folder / part
        for path in sorted(base.rglob("*")) if base.is_dir() else ():
            inner = path.relative_to(base)
            if path.is_file() and not any(piece.startswith(".") for piece in inner.parts):
                names.append(path.relative_to(folder).as_posix())
    return names


def remove_others(folder: Path, parts: Iterable[str], there: Collection[str]) -> None:
    """Remove local files of the parts that are not ``there``, hidden ones too, and folders that are left empty."""
    for part in parts:
        base = folder / part
        if not part.endswith("/"):
            if part not in there:
                base.unlink(missing_ok=True)
            continue
        for path in sorted(base.rglob("*"), reverse=True) if base.is_dir() else ():
            if path.is_dir() and not path.is_symlink():
                if not any(path.iterdir()):
                    path.rmdir()
            elif path.relative_to(folder).as_posix() not in there:
                path.unlink(missing_ok=True)
        if base.is_dir() and not any(base.iterdir()):
            shutil.rmtree(base)
