"""SQLite file that all workers of a run share: amounts spent and reserved, and when each provider may be asked."""

import contextlib
import sqlite3
from collections.abc import Iterator
from pathlib import Path

FILE = ".cache/ledger.sqlite"
"""Under the output folder."""
BUSY_S = 30.0
"""Longest wait for another process's transaction, s; each takes milliseconds."""

_TABLES = (
    "CREATE TABLE IF NOT EXISTS spent (run_id TEXT, scope TEXT, calls INTEGER NOT NULL, tokens INTEGER NOT NULL, "
    "usd REAL NOT NULL, PRIMARY KEY (run_id, scope)) WITHOUT ROWID",
    "CREATE TABLE IF NOT EXISTS held (ticket TEXT PRIMARY KEY, run_id TEXT, scope TEXT, tokens INTEGER NOT NULL, "
    "usd REAL NOT NULL, most_tokens INTEGER NOT NULL, most_usd REAL NOT NULL, until REAL NOT NULL) WITHOUT ROWID",
    "CREATE TABLE IF NOT EXISTS pace (provider TEXT PRIMARY KEY, next_at REAL NOT NULL) WITHOUT ROWID",
)


@contextlib.contextmanager
def transaction(file: Path) -> Iterator[sqlite3.Connection]:
    """One exclusive transaction over all processes and threads; rolled back where the block raises.

    Each has its own connection, in the default journal mode: WAL is faster but fails on shared file systems. Raises
    ``sqlite3.Error`` or ``OSError`` where the file cannot be used.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    connection = sqlite3.connect(file, timeout=BUSY_S, isolation_level=None)
    try:
        connection.execute("BEGIN IMMEDIATE")
        for table in _TABLES:
            connection.execute(table)
        yield connection
        connection.execute("COMMIT")
    except BaseException:
        with contextlib.suppress(sqlite3.Error):
            connection.execute("ROLLBACK")
        raise
    finally:
        connection.close()
