"""Rows of the CSV files that lie beside their modules: columns, tables, commands, packs, failure modes."""

import csv
from functools import cache
from pathlib import Path


def rows_beside(module: str, name: str) -> tuple[dict[str, str], ...]:
    """The rows, by column, of the CSV file ``name`` beside a module (its ``__file__``)."""
    return rows_of(Path(module).with_name(name))


@cache
def rows_of(file: Path) -> tuple[dict[str, str], ...]:
    """The rows of a CSV file, by column."""
    with file.open(encoding="utf-8", newline="") as stream:
        return tuple(csv.DictReader(stream))
