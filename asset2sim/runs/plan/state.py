"""Database ``OUT/.cache/files.db``: hashes of asset files and of refined folders. Losing it costs time only."""

import hashlib
import os
import sqlite3
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import closing, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import TypeVar

from asset2sim.assets.checksums import file_digest
from asset2sim.assets.urdf.references import AllowedFolders
from asset2sim.runs.plan.asset_files import AssetFile, asset_files

FILE = ".cache/files.db"
SETTLED_NS = 2_000_000_000
"""Age from which a changed file has another modification time, ns: file systems count in steps of up to 2 s."""
UNREADABLE = "unreadable"
"""The digest of a file that cannot be read."""
HASHING_THREADS = 2
"""Threads that hash: a disk is seldom faster than two cores are."""

T = TypeVar("T")

_TABLES = """
CREATE TABLE IF NOT EXISTS files (
    asset TEXT, name TEXT, path TEXT, size INTEGER, mtime_ns INTEGER, ctime_ns INTEGER, inode INTEGER, sha256 TEXT,
    PRIMARY KEY (asset, name)
) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS folders (asset_id TEXT PRIMARY KEY, content_hash TEXT) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS outputs (asset_id TEXT PRIMARY KEY, look TEXT) WITHOUT ROWID;
"""


@contextmanager
def open_state(out: Path) -> Iterator[sqlite3.Connection]:
    """OUT's database within the block, committed at its end; the caller holds ``lock_output(out)``.

    A damaged file is replaced; where none can be written, the block gets an empty database in memory.
    """
    connection = _open(out / FILE)
    try:
        yield connection
        connection.commit()
    finally:
        connection.close()


@contextmanager
def read_state(out: Path) -> Iterator[sqlite3.Connection]:
    """A copy of OUT's database in memory, for who writes nothing; empty where there is none, or a damaged one."""
    copy = sqlite3.connect(":memory:")
    try:
        with (
            suppress(sqlite3.Error),
            closing(sqlite3.connect(f"{(out / FILE).absolute().as_uri()}?mode=ro", uri=True)) as stored,
        ):
            stored.backup(copy)
        if copy.execute("PRAGMA quick_check(1)").fetchone() != ("ok",):
            copy.close()
            copy = sqlite3.connect(":memory:")
        copy.executescript(_TABLES)
        yield copy
    finally:
        copy.close()


def changed_inputs(state: sqlite3.Connection, folder: Path, reach: AllowedFolders) -> tuple[str, ...]:
    """Names of an asset's files that are not as they were when they were last hashed; empty where they never were."""
    known = _known(state, str(folder))
    if not known:
        return ()
    now = {file.name: file for file in asset_files(folder, reach)}
    same = {name for name, file in now.items() if name in known and known[name][0] == _seen(file)}
    others = {name for name in now.keys() & known.keys() - same if _digest(now[name]) != known[name][1]}
    return tuple(sorted(others | (now.keys() ^ known.keys())))


def folder_files_hash(
    state: sqlite3.Connection, folder: Path, reach: AllowedFolders, limit_s: float = threading.TIMEOUT_MAX
) -> str:
    """SHA-256 over names and contents of an asset's files within ``reach``; a file is read only if it changed since the
    last time. Raises TimeoutError where that takes over ``limit_s``, s."""
    end = time.monotonic() + limit_s
    files = _started(partial(asset_files, folder, reach)).result(limit_s)
    known = _known(state, str(folder))
    digests = {file.name: known[file.name][1] for file in files if known.get(file.name, ("",))[0] == _seen(file)}
    changed = [file for file in files if file.name not in digests]
    parts = [changed[place::HASHING_THREADS] for place in range(HASHING_THREADS)]
    for part in [_started(partial(_digests, part)) for part in parts if part]:
        digests |= part.result(max(end - time.monotonic(), 0.0))
    _remember(state, str(folder), changed, digests)
    if gone := [(str(folder), name) for name in known if name not in digests]:
        state.executemany("DELETE FROM files WHERE asset = ? AND name = ?", gone)
    whole = hashlib.sha256()
    for file in files:
        whole.update(f"{file.name}\0{digests[file.name]}\n".encode(errors="surrogateescape"))
    return whole.hexdigest()


def _started(work: Callable[[], T]) -> Future[T]:
    """The future of work in a thread of its own, which does not keep the process from ending: reading from a disk that
    does not answer cannot be interrupted."""
    future: Future[T] = Future()

    def run() -> None:
        try:
            future.set_result(work())
        except BaseException as error:
            future.set_exception(error)

    threading.Thread(target=run, name="asset2sim-hash", daemon=True).start()
    return future


def _digests(files: Sequence[AssetFile]) -> dict[str, str]:
    return {file.name: _digest(file) for file in files}


def refined_folders(state: sqlite3.Connection) -> dict[str, str]:
    """Asset id → the content hash of the refinement that lies in ``assets/<asset_id>``."""
    return dict(state.execute("SELECT asset_id, content_hash FROM folders"))


def note_folders(state: sqlite3.Connection, hashes: Mapping[str, str]) -> None:
    """Remember which refinements lie in the folders of these assets."""
    state.executemany("INSERT OR REPLACE INTO folders VALUES (?, ?)", hashes.items())


def forget_folders(state: sqlite3.Connection, asset_ids: Iterable[str]) -> None:
    """Forget what lies in the folders of these assets, which are about to be refined, and their looks. Commits."""
    gone = [(asset_id,) for asset_id in asset_ids]
    for table in ("folders", "outputs"):
        state.executemany(f"DELETE FROM {table} WHERE asset_id = ?", gone)
    state.commit()


def _open(file: Path) -> sqlite3.Connection:
    for attempt in range(2):
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            connection = sqlite3.connect(file)
            connection.executescript(_TABLES)
            # Reads every page: a damaged one must not end a run in its middle.
            if connection.execute("PRAGMA quick_check(1)").fetchone() == ("ok",):
                return connection
            connection.close()
            if attempt == 0:
                file.unlink(missing_ok=True)
        except sqlite3.OperationalError:
            break
        except (sqlite3.DatabaseError, OSError):
            if attempt == 0 and os.access(file.parent, os.W_OK):
                file.unlink(missing_ok=True)
    connection = sqlite3.connect(":memory:")
    connection.executescript(_TABLES)
    return connection


def _known(state: sqlite3.Connection, asset: str) -> dict[str, tuple[tuple[object, ...], str]]:
    """File name → what was seen of the file, and its digest."""
    columns = "name, path, size, mtime_ns, ctime_ns, inode, sha256"
    rows = state.execute(f"SELECT {columns} FROM files WHERE asset = ?", (asset,))
    return {row[0]: (row[1:6], row[6]) for row in rows}


def _seen(file: AssetFile) -> tuple[object, ...]:
    return (file.path, file.size, file.mtime_ns, file.ctime_ns, file.inode)


def _remember(state: sqlite3.Connection, asset: str, files: Iterable[AssetFile], digests: Mapping[str, str]) -> None:
    # A file that was just written may be written again within the same tick of its clock.
    settled = time.time_ns() - SETTLED_NS
    rows = [
        (asset, file.name, *_seen(file), digests[file.name])
        for file in files
        if max(file.mtime_ns, file.ctime_ns) < settled and digests[file.name] != UNREADABLE and _is_text(file.path)
    ]
    state.executemany("INSERT OR REPLACE INTO files VALUES (?, ?, ?, ?, ?, ?, ?, ?)", rows)


def _is_text(path: str) -> bool:
    """Whether a path is UTF-8, as what SQLite keeps must be."""
    return path.isascii() or path == path.encode(errors="replace").decode()


def _digest(file: AssetFile) -> str:
    if file.size < 0:
        return UNREADABLE
    try:
        return file_digest(Path(file.path))
    except OSError:
        return UNREADABLE
