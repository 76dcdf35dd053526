"""A published table: an Arrow schema with units and a description in every field, its grain and its key."""

from collections.abc import Sequence
from dataclasses import dataclass

import pyarrow as pa

Column = tuple[str, pa.DataType, str, str]
"""Name, type, unit, description. A name that ends in ``!`` may not be null."""

Row = dict[str, object]
"""Column → value; a number that was never measured is None, never 0."""

TEXT = pa.string()
REAL = pa.float64()
COUNT = pa.int64()
FLAG = pa.bool_()
TIME = pa.timestamp("ms", tz="UTC")
TEXTS = pa.list_(TEXT)
REALS = pa.list_(REAL)

BY_TYPE = "hinge / slider"
POSITION = f"rad / m ({BY_TYPE})"


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


def make_table(name: str, grain: str, key: tuple[str, ...], description: str, columns: Sequence[Column]) -> Table:
    """A table of these columns; a column whose name ends in ``!`` may not hold null."""
    fields = [
        pa.field(
            column.removesuffix("!"),
            kind,
            nullable=not column.endswith("!"),
            metadata={"description": text, "unit": unit},
        )
        for column, kind, unit, text in columns
    ]
    metadata = {"table": name, "grain": grain, "key": ",".join(key), "description": description}
    return Table(name, grain, key, description, pa.schema(fields, metadata=metadata))


ASSET_KEY = ("asset_id", "method", "model")
"""Key columns of a refinement: a re-run replaces its rows."""

ASSET_COLUMNS: tuple[Column, ...] = (
    ("run_id!", TEXT, "", "Run that wrote the row; see the table runs"),
    ("asset_id!", TEXT, "", "The asset, as the manifest names it"),
    ("method!", TEXT, "", "How the asset was refined"),
    ("model!", TEXT, "", "Model that the run asked for"),
)
