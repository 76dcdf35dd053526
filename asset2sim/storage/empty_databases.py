"""Empty SQLite databases of other programs, kept in the cache and copied: making their tables takes a second of a
core (MLflow) to five (Prefect) each time."""

import os
import sqlite3
import uuid
from contextlib import closing, suppress
from pathlib import Path


def copy_empty(kept: Path, file: Path) -> bool:
    """Make ``file`` as a copy of a kept database, if there is none. Returns whether that was done: not where none is
    kept, or what is kept cannot be read or is not whole."""
    if not kept.is_file():
        return False
    try:
        _copy(kept, file)
    except (OSError, sqlite3.Error):
        return False
    return True


def keep_empty(file: Path, kept: Path, *clear: str) -> None:
    """Keep a copy of a new database, less what the SQL of ``clear`` removes, if that can be done."""
    with suppress(OSError, sqlite3.Error):
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.unlink(missing_ok=True)
        _copy(file, kept, *clear)


def _copy(source: Path, target: Path, *clear: str) -> None:
    """Copy an SQLite database atomically, less what the SQL of ``clear`` removes. Raises OSError where the target is
    there already, and sqlite3.Error where the source is not whole."""
    part = target.with_name(f".{target.name}.part-{uuid.uuid4().hex}")
    try:
        with closing(sqlite3.connect(source)) as opened, closing(sqlite3.connect(part)) as made:
            opened.backup(made)
            # A copy that is read must need no other file beside it.
            made.execute("PRAGMA journal_mode = DELETE")
            for statement in clear:
                made.execute(statement)
            made.commit()
            tables = made.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
            if not tables or made.execute("PRAGMA quick_check").fetchone() != ("ok",):
                raise sqlite3.DatabaseError(f"{source} is not whole")
        os.link(part, target)
    finally:
        for left in target.parent.glob(f"{part.name}*"):
            left.unlink()
