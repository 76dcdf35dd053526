"""Tables beside the catalog that people and judges write: ``OUT/TABLE/NAME.parquet``, a file of each writer.

No run touches these files, and no two writers write the same one: no lock is needed, also while a run is going on, and
also where OUT is a URL. OUT needs no catalog.
"""

import tempfile
import uuid
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from asset2sim.catalog.enforce import conform, to_arrow
from asset2sim.catalog.switch import replace_file
from asset2sim.storage.mirror import local_parts
from asset2sim.storage.objects import StoreError, send_objects, store_usage_error
from schemas.errors import UsageError
from schemas.location import Location
from schemas.table import Row, Table

EMPTY = "none.parquet"
"""The file without rows, by which readers know the columns before anybody has written any."""


def own_pattern(table: Table) -> str:
    """The files of a table, relative to OUT."""
    return f"{table.name}/*.parquet"


def own_files(out: Path, table: Table) -> list[Path]:
    """The files of a table in a folder."""
    return sorted(out.glob(own_pattern(table)))


def make_own_files(out: Path, table: Table) -> None:
    """Write the table's file without rows, where there is none."""
    if not (out / table.name / EMPTY).exists():
        write_own_file(Location(out), table, EMPTY, table.schema.empty_table())


class OwnFile:
    """One writer's file of a table in OUT, a folder or a URL; written anew, in one step, whenever rows are added."""

    def __init__(self, out: Path | str, table: Table) -> None:
        self.out, self.table = Location(out), table
        self.name = f"{datetime.now(UTC):%Y%m%dT%H%M%S}-{uuid.uuid4().hex[:8]}.parquet"
        self.rows: tuple[Row, ...] = ()

    def add(self, rows: Sequence[Row]) -> None:
        """Store more rows. Raises CatalogError for rows that do not fit the table, and UsageError where OUT cannot be
        written to; then none of them is kept."""
        every = (*self.rows, *rows)
        write_own_file(self.out, self.table, self.name, to_arrow(self.table, every))
        self.rows = every


def write_own_file(out: Location, table: Table, name: str, rows: pa.Table) -> None:
    """Write a file of a table in one step. Raises UsageError where OUT cannot be written to."""
    try:
        if out.is_url:
            with tempfile.TemporaryDirectory() as folder:
                staged = Path(folder, name)
                pq.write_table(rows, staged, compression="zstd")
                send_objects({f"{out}/{table.name}/{name}": staged})
            return
        place = out.folder / table.name / name
        place.parent.mkdir(parents=True, exist_ok=True)
        staged = place.with_name(f".{name}.part")
        pq.write_table(rows, staged, compression="zstd")
        replace_file(staged, place)
    except StoreError as error:
        raise store_usage_error(error) from error
    except OSError as error:
        raise UsageError(f"{table.name}: nothing is stored, {out} cannot be written to ({error})") from error


def read_own_files(out: Path | str, table: Table) -> pd.DataFrame:
    """All rows of a table in OUT, in today's schema and in the order of their files; empty where there is none. Raises
    CatalogError for a file of another version, UsageError where OUT's store cannot be read."""
    try:
        files = own_files(local_parts(Location(out), (f"{table.name}/",)), table)
    except StoreError as error:
        raise store_usage_error(error) from error
    found = [conform(table, pq.read_table(path, partitioning=None), str(path)) for path in files]
    whole = pa.concat_tables(found) if found else table.schema.empty_table()
    frame: pd.DataFrame = whole.to_pandas(types_mapper={pa.int64(): pd.Int64Dtype()}.get)
    return frame
