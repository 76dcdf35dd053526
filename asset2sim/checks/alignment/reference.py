"""An expert's choice of scale and of the position of the joint of interest (paper, evaluation, section 2)."""

import csv
import math
from pathlib import Path

from schemas.alignment import Reference
from schemas.errors import UsageError

FILE = "reference.csv"
COLUMNS = ("asset_id", "gensim2_task", "scale", "joint", "joint_position")
NOT_ARTICULATING = ("_move", "_lift")
"""Endings of tasks that carry the whole object: where there is another task, that one states the joint of interest."""


def read_references(file: Path) -> dict[str, Reference]:
    """Asset id → its reference; of several tasks the one that articulates the object. Empty where there is no file.
    Raises UsageError where the file is there and cannot be read as such a table."""
    if not file.is_file():
        return {}
    try:
        with file.open(encoding="utf-8-sig", newline="") as stream:
            rows = list(csv.DictReader(stream))
        # Tasks that articulate come last, so that they replace those that carry.
        rows.sort(key=lambda row: not row["gensim2_task"].endswith(NOT_ARTICULATING))
        return {row["asset_id"]: _reference(row) for row in rows}
    except (KeyError, ValueError, AttributeError, TypeError, csv.Error) as error:
        raise UsageError(f"{file}: not a table with the columns {', '.join(COLUMNS)} ({error!r})") from error


def _reference(row: dict[str, str]) -> Reference:
    found = Reference(float(row["scale"]), row["joint"], float(row["joint_position"]))
    if not (math.isfinite(found.scale) and found.scale > 0.0 and math.isfinite(found.position)):
        raise ValueError(f"asset {row['asset_id']}: scale {found.scale}, joint position {found.position}")
    return found
