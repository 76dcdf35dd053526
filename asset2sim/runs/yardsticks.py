"""Yardsticks of a dataset's assets: experts' choices and readers' expectations, on each asset's reference."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from asset2sim.checks.alignment import expectations as expected
from asset2sim.checks.alignment import reference
from asset2sim.intake.fetch import local_file
from schemas.asset import AssetRef
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
    references = reference.read_references(local_file(data.below(reference.FILE)))
    expectations = expected.read_expectations(local_file(data.below(expected.FILE)))
    held = [
        ref.model_copy(
            update={"reference": references.get(ref.asset_id), "expectations": expectations.get(ref.asset_id, ())}
        )
        for ref in refs
    ]
    return Yardsticks(held, expectations)
