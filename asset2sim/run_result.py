"""What a run of the flow hands back to whoever started it."""

from dataclasses import dataclass
from pathlib import Path

from asset2sim.catalog.run import RunRow
from schemas.asset import AssetRecord, Unchanged

INTERRUPTED = "interrupted"
"""Why a run stopped that somebody stopped."""


@dataclass(frozen=True)
class RunResult:
    """A run that is in the catalog. ``stopped`` says why not every asset is; ``warnings`` what else went wrong;
    ``unchanged`` what there was no need to refine."""

    out: Path
    run: RunRow
    records: tuple[AssetRecord, ...]
    stopped: str | None
    warnings: tuple[str, ...]
    unchanged: tuple[Unchanged, ...] = ()
