"""SQL over the catalog and its history: a DuckDB connection in which every table goes by its name.

from asset2sim.catalog.query import connect
tables = connect("data/refined")
tables.sql("SELECT failure_mode, count(*) FROM assets GROUP BY ALL").df()
"""

import re
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

import pyarrow as pa
import pyarrow.parquet as pq
from pyarrow import dataset

from asset2sim.catalog.history import PATTERN, history_files
from asset2sim.catalog.own_files import own_files, own_pattern
from asset2sim.catalog.read_remote import local_tables
from asset2sim.catalog.stored_tables import reading
from asset2sim.catalog.switch import CATALOG, find_catalog, no_catalog_error
from schemas.errors import UsageError
from schemas.extensions import further_tables, missing
from schemas.table import Table
from schemas.tables import HISTORY, PUBLISHED, REVIEWS, TABLES

if TYPE_CHECKING:
    import duckdb

_LEFT_OUT = re.compile(r"^(LINE \d+:|\s*\^)")
_NO_TABLE = re.compile(r"Table with name (\S+) does not exist")


def connect(out: Path | str) -> "duckdb.DuckDBPyConnection":
    """A connection with a view per table of OUT, its history and those of extensions among them, with comments on all
    columns; times are in UTC. The views read the files at each query; for a URL they read copies made now. Close the
    connection after use. Raises UsageError where OUT has no catalog."""
    import duckdb  # late: writing the catalog does not need it

    place = local_tables(out)
    folder = find_catalog(place) or own_tables(place)
    if folder is None:
        raise no_catalog_error(place)
    connection = duckdb.connect(":memory:")
    make_views(connection, place, folder)
    for table in (PUBLISHED | further_tables()).values():
        _comment(connection, table)
    return connection


def own_tables(out: Path) -> Path | None:
    """Where the tables of runs would be, in a folder with tables of experiments alone (OUT of ``learn``), else None."""
    there = any(own_files(out, table) for table in (REVIEWS, *further_tables().values()))
    return out / CATALOG if there else None


def make_views(connection: "duckdb.DuckDBPyConnection", out: Path, folder: Path, *, files: bool = True) -> None:
    """A view for every published table, empty where it has no file; ``folder`` holds OUT's tables. Without ``files`` (a
    connection that may open none) Arrow reads them. Raises CatalogError for one that cannot be read."""
    connection.execute("SET TimeZone = 'UTC'")
    places = (
        *((table, folder / table.file, [folder / table.file]) for table in TABLES.values()),
        (HISTORY, out / PATTERN, history_files(out)),
        *((table, out / own_pattern(table), own_files(out, table)) for table in (REVIEWS, *further_tables().values())),
    )
    for table, pattern, paths in places:
        schemas = []
        for path in (path for path in paths if path.exists()):
            with reading(table, path):
                schemas.append(pq.read_schema(path))
        if not schemas:
            connection.register(table.name, table.schema.empty_table())
            continue
        # Files of older versions may lack columns.
        whole = pa.unify_schemas(schemas, promote_options="permissive")
        source = f"read_parquet({_text(pattern)}, union_by_name = true, hive_partitioning = false)"
        if files:
            connection.execute(f"CREATE VIEW {table.name} AS SELECT * FROM {source}")
        else:
            connection.register(table.name, dataset.dataset(paths, schema=whole))


def _comment(connection: "duckdb.DuckDBPyConnection", table: Table) -> None:
    """Say what the table and its columns are, with units, in DuckDB's comments, where its files have the columns."""
    connection.execute(f"COMMENT ON VIEW {table.name} IS {_text(f'{table.description}: {table.grain}')}")
    there = {name for name, *_ in connection.execute(f"DESCRIBE {table.name}").fetchall()}
    for field in table.schema:
        if field.name in there:
            unit = field.metadata[b"unit"].decode()
            said = field.metadata[b"description"].decode() + (f" [{unit}]" if unit else "")
            connection.execute(f'COMMENT ON COLUMN {table.name}."{field.name}" IS {_text(said)}')


def packaged_sql(name: str) -> str:
    """The text of ``<name>.sql`` beside this module."""
    return resources.files("asset2sim.catalog").joinpath(f"{name}.sql").read_text(encoding="utf-8")


def query_error(error: "duckdb.Error") -> UsageError:
    """UsageError for a failed query: one line that lists the valid tables or columns."""
    import duckdb

    lines = [line.strip() for line in str(error).splitlines() if line.strip() and not _LEFT_OUT.match(line)]
    unknown = _NO_TABLE.search(str(error))
    if unknown is not None:
        # DuckDB's own suggestion may be a table of its own.
        choices = f"choose from: {', '.join(sorted(PUBLISHED | further_tables()))}"
        lines = [lines[0], missing(unknown[1]) or choices]
    if isinstance(error, duckdb.PermissionException):
        lines = [lines[0], "it may read OUT's tables alone; --allow-files lets it read and write files"]
    if not lines:
        lines = [type(error).__name__]
    return UsageError(f"the query failed: {'; '.join(line.rstrip('!;') for line in lines)}")


def _text(value: Path | str) -> str:
    return "'" + str(value).replace("'", "''") + "'"
