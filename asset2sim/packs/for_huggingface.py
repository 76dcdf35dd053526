"""Pack for the Hugging Face Hub: a dataset with a card, and a Parquet table that its viewer shows with pictures."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from asset2sim.packs.declared_pack import OBJECTS, Pack, PackedObject

TABLE = "objects.parquet"
COLUMNS = {
    "name": "string", "asset_id": "string", "category": "string", "mass_kg": "float64", "size_x_m": "float64",
    "size_y_m": "float64", "size_z_m": "float64", "joints": "int64", "support": "string", "urdf": "string",
}  # fmt: skip
"""Columns beside the picture, and their types as the viewer names them."""


def write_table(target: Path, objects: Sequence[PackedObject], given: Mapping[str, Any]) -> None:
    """Write a row an object, with its preview inside."""
    rows = [row_of(item) for item in objects]
    fields = [pa.field("preview", pa.struct([("bytes", pa.binary()), ("path", pa.string())]))]
    fields += [pa.field(name, getattr(pa, kind)()) for name, kind in COLUMNS.items()]
    features: dict[str, dict[str, str]] = {name: {"dtype": kind, "_type": "Value"} for name, kind in COLUMNS.items()}
    told = {"huggingface": json.dumps({"info": {"features": {"preview": {"_type": "Image"}, **features}}})}
    pq.write_table(pa.Table.from_pylist(rows, pa.schema(fields, metadata=told)), target / TABLE)


def row_of(item: PackedObject) -> dict[str, Any]:
    """One object's row."""
    sizes = {f"size_{axis}_m": item.row[f"size_{axis}_m"] for axis in "xyz"}
    return {
        "preview": {"bytes": (item.folder / "preview.png").read_bytes(), "path": f"{item.name}.png"},
        "name": item.name,
        "asset_id": item.asset_id,
        "category": item.row["category"],
        "mass_kg": item.about.mass_kg,
        **sizes,
        "joints": len(item.about.joints),
        "support": item.about.support,
        "urdf": f"{OBJECTS}/{item.name}/mobility.urdf",
    }


PACKS = (
    Pack(
        name="huggingface",
        title="the Hugging Face Hub",
        contents="A dataset repository: `objects.parquet` is what its viewer shows, `objects` the files.",
        opens="hf upload USER/NAME . --repo-type dataset",
        finish=write_table,
    ),
)
