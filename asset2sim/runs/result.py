"""What a run of the flow hands back to whoever started it."""

from dataclasses import dataclass
from pathlib import Path

from asset2sim.catalog.changes import Changes
from asset2sim.catalog.run import RunRow
from schemas.asset import AssetRecord, Unchanged
from schemas.location import below

INTERRUPTED = "interrupted"
"""Why a run stopped that somebody stopped."""


@dataclass(frozen=True)
class RunResult:
    """A run that is in the catalog. ``stopped`` says why not every asset is; ``warnings`` what else went wrong.

    ``unchanged`` is what there was no need to refine, ``report`` the file that holds the run's report, and ``changes``
    what it changed. ``out`` is the folder in which the run worked; ``place`` is where its user wanted the output, None
    for there.
    """

    out: Path
    run: RunRow
    records: tuple[AssetRecord, ...]
    stopped: str | None
    warnings: tuple[str, ...]
    unchanged: tuple[Unchanged, ...] = ()
    report: Path | None = None
    changes: Changes | None = None
    place: Path | str | None = None

    def shown(self, *parts: str) -> Path | str:
        """Where the output is for its user, or what lies below it."""
        return below(self.place or self.out, *parts)

    @property
    def shown_report(self) -> Path | str | None:
        """Where the report is for its user."""
        return None if self.report is None else self.shown(*self.report.relative_to(self.out).parts)
