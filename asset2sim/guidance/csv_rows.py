"""Reading the data files of this room, with a category left out where a study asks for it."""

import os
import re
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

from pydantic import TypeAdapter

from schemas.csv_rows import rows_of

Kind = TypeVar("Kind")
_FOLDER = Path(__file__).parent / "csv_tables"
LEFT_OUT_VARIABLE = "ASSET2SIM_LEFT_OUT"
"""Environment variable that names a category whose rows no table has: for the study of what they are worth."""


def csv_rows(name: str) -> list[dict[str, str]]:
    """The rows of ``csv_tables/NAME.csv``, by column; without those of a category that is left out."""
    rows = list(rows_of(_FOLDER / f"{name}.csv"))
    left_out = os.environ.get(LEFT_OUT_VARIABLE)
    if not left_out:
        return rows
    # A row of what carries an object has the category in plain words.
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", left_out).lower()
    return [
        row for row in rows if row.get("category") != left_out and not (name == "supports" and row["phrase"] == words)
    ]


@lru_cache
def typed_rows(name: str, kind: type[Kind]) -> list[tuple[dict[str, str], Kind]]:
    """The rows of ``csv_tables/NAME.csv``, each as it is and as a ``kind``: a dataclass whose fields, or their aliases,
    are named as columns, with a default where cells may be empty. Raises ValidationError for a wrong cell."""
    rows = csv_rows(name)
    filled = [{column: cell for column, cell in row.items() if cell} for row in rows]
    return list(zip(rows, TypeAdapter(list[kind]).validate_python(filled), strict=True))  # type: ignore[valid-type]
