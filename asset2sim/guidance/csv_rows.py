"""Reading the data files of this room, with a category left out where a study asks for it."""

import csv
import os
import re
from pathlib import Path

_FOLDER = Path(__file__).parent / "csv_tables"
LEFT_OUT_VARIABLE = "ASSET2SIM_LEFT_OUT"
"""Environment variable that names a category whose rows no table has: for the study of what they are worth."""


def csv_rows(name: str) -> list[dict[str, str]]:
    """The rows of ``csv_tables/NAME.csv``, by column; without those of a category that is left out."""
    with (_FOLDER / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    left_out = os.environ.get(LEFT_OUT_VARIABLE)
    if not left_out:
        return rows
    # A row of what carries an object has the category in plain words.
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", left_out).lower()
    return [
        row for row in rows if row.get("category") != left_out and not (name == "supports" and row["phrase"] == words)
    ]
