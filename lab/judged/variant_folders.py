"""The output folders that hold variants of the same assets: those that are named, or all of a comparison."""

from collections.abc import Sequence
from pathlib import Path

from asset2sim.catalog.switch import find_catalog
from schemas.errors import UsageError
from schemas.location import Location


def variant_folders(outs: Sequence[Path | str]) -> tuple[Path | str, ...]:
    """Every output folder with a catalog among these and, where one is the folder of a comparison (``make compare``:
    METHOD/MODEL below it), inside it. A URL counts as an output folder. Raises UsageError where there is none."""
    found: dict[Path | str, None] = {}
    for out in outs:
        if Location(out).is_url:
            found[out] = None
            continue
        folder = Path(out)
        below = [path for path in sorted(folder.glob("*/*/")) if find_catalog(path)]
        inside = [folder] if find_catalog(folder) else below
        if not inside:
            raise UsageError(f"{out}: no catalog in it, nor in METHOD/MODEL below it; name a run's output folder")
        found |= dict.fromkeys(inside)
    return tuple(found)
