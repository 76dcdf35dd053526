"""What a run of the flow hands back to whoever started it."""

from dataclasses import dataclass
from pathlib import Path

from asset2sim.catalog.changes import Changes
from asset2sim.catalog.run import RunRow
from schemas.asset import AssetRecord, Unchanged

INTERRUPTED = "interrupted"
"""Why a run stopped that somebody stopped."""


@dataclass(frozen=True)
class RunResult:
    """A run that is in the catalog. ``stopped`` says why not every asset is; ``warnings`` what else went wrong.

    ``unchanged`` is what there was no need to refine, ``report`` the file that holds the run's report, and ``changes``
    what it changed.
    """

    out: Path
    run: RunRow
    records: tuple[AssetRecord, ...]
    stopped: str | None
    warnings: tuple[str, ...]
    unchanged: tuple[Unchanged, ...] = ()
    report: Path | None = None
    changes: Changes | None = None
