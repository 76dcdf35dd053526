"""Yardsticks of a dataset's assets: experts' choices (paper, evaluation, section 2) and readers' expectations."""

import csv
import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

from asset2sim.checks.alignment import expectations as expected
from asset2sim.intake.url_files import local_file
from schemas.alignment import Reference
from schemas.asset import AssetRef
from schemas.errors import UsageError
from schemas.location import Location


@dataclass(frozen=True)
class Yardsticks:
    """Assets with the yardsticks of their dataset, and all of its expectations, those of no asset among them."""

    refs: list[AssetRef]
    expectations: expected.Expectations

    def unknown(self, present: Collection[str] | None) -> tuple[str, ...]:
        """A sentence for every expectation of an asset that is not ``present``; none where that is not known."""
        return () if present is None else expected.unknown_assets(self.expectations, present)


def with_yardsticks(data: Location, refs: Sequence[AssetRef]) -> Yardsticks:
    """The assets with what the dataset's files say of each. Raises UsageError for a file that is no such table."""
    references = read_references(local_file(data.below(FILE)))
    expectations = expected.read_expectations(local_file(data.below(expected.FILE)))
    held = [
        ref.model_copy(
            update={"reference": references.get(ref.asset_id), "expectations": expectations.get(ref.asset_id, ())}
        )
        for ref in refs
    ]
    return Yardsticks(held, expectations)


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
