"""A published table: an Arrow schema with units and a description in every field, its grain and its key."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa

from schemas.csv_rows import rows_of
from schemas.vocabulary import Stage

Column = tuple[str, pa.DataType, str, str]
"""Name, type, unit, description. A name that ends in ``!`` may not be null."""

Row = dict[str, object]
"""Column → value; a number that was never measured is None, never 0."""

TYPES = {
    "text": pa.string(), "number": pa.float64(), "count": pa.int64(), "flag": pa.bool_(),
    "time": pa.timestamp("ms", tz="UTC"), "texts": pa.list_(pa.string()), "numbers": pa.list_(pa.float64()),
}  # fmt: skip
COLUMNS = Path(__file__).with_name("columns.csv")
"""Columns of the catalog's tables, a row each. A column ``*NAME`` stands for all columns of NAME, and one with a word
of ``EACH`` in braces for one each."""
EACH: Mapping[str, Sequence[str]] = {
    "stage": [stage.value for stage in Stage], "axis": "xyz", "axes": ("xx", "xy", "xz", "yy", "yz", "zz")
}  # fmt: skip


@dataclass(frozen=True)
class Table:
    """One published table. ``key`` names the columns that make a row unique; ``grain`` says what a row is."""

    name: str
    grain: str
    key: tuple[str, ...]
    description: str
    schema: pa.Schema

    @property
    def file(self) -> str:
        """The table's file name in the catalog folder."""
        return f"{self.name}.parquet"

    @property
    def per_asset(self) -> bool:
        """Whether rows belong to one asset, method and model, and are replaced when that asset is refined again."""
        return "asset_id" in self.key


def make_table(
    name: str, grain: str, key: tuple[str, ...], description: str, columns: Iterable[Column] | None = None
) -> Table:
    """A table of these columns, or those that ``COLUMNS`` lists; one with ``!`` after its name may not hold null."""
    fields = [
        pa.field(
            column.removesuffix("!"),
            kind,
            nullable=not column.endswith("!"),
            metadata={"description": text, "unit": unit},
        )
        for column, kind, unit, text in columns or columns_of(name)
    ]
    metadata = {"table": name, "grain": grain, "key": ",".join(key), "description": description}
    return Table(name, grain, key, description, pa.schema(fields, metadata=metadata))


def columns_of(
    table: str, file: Path = COLUMNS, further: Mapping[str, Sequence[Column]] | None = None
) -> Iterator[Column]:
    """The columns that a file lists of a table, in its order; ``further``: NAME → columns that no file has."""
    for row in (row for row in rows_of(file) if row["table"] == table):
        name, kind, unit, text = (row[key] for key in ("column", "type", "unit", "description"))
        if name.startswith("*"):
            part = name.removeprefix("*")
            yield from further[part] if further and part in further else columns_of(part, file)
            continue
        word = next((word for word in EACH if f"{{{word}}}" in name), "")
        for each in EACH.get(word, ("",)):
            yield name.replace(f"{{{word}}}", each), TYPES[kind], unit, text.replace(f"{{{word}}}", each)


ASSET_KEY = ("asset_id", "method", "model")
"""Key columns of a refinement: a re-run replaces its rows."""
