"""The result that a run of the flow returns to its caller."""

from dataclasses import dataclass
from pathlib import Path

from asset2sim.catalog.changes import Changes
from asset2sim.catalog.run import RunRow
from schemas.asset import Unchanged
from schemas.location import Location
from schemas.summary import AssetSummary

INTERRUPTED = "interrupted"
"""Value of ``RunResult.stopped`` for a run that the user stopped."""


@dataclass(frozen=True)
class RunResult:
    """A run that is in the catalog. ``stopped`` says why not every asset is; ``warnings`` what else went wrong;
    ``unchanged`` are the assets not refined again, ``report`` is the index of the run's report, if it wrote one, and
    ``changes`` the differences from the catalog before it. ``out`` is the folder in which the run worked; ``place`` is
    the output as the user named it, None if that is ``out``; ``removed`` are lines that say what was too old to
    keep."""

    out: Path
    run: RunRow
    records: tuple[AssetSummary, ...]
    stopped: str | None
    warnings: tuple[str, ...]
    unchanged: tuple[Unchanged, ...] = ()
    report: Path | None = None
    changes: Changes | None = None
    place: Location | None = None
    removed: tuple[str, ...] = ()

    def shown(self, *parts: str) -> Location:
        """Path or URL of the output as the user named it, or of ``parts`` below it."""
        return Location(self.place or self.out).below(*parts)

    @property
    def shown_report(self) -> Location | None:
        """Path or URL of the report, below the output as the user named it."""
        return None if self.report is None else self.shown(*self.report.relative_to(self.out).parts)
