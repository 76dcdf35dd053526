"""Verify one refined asset in every engine, and mend its dynamics where a check fails."""

from collections.abc import Sequence

from asset2sim.assets.extract import Extraction
from asset2sim.assets.folder import Folder, write_urdf
from asset2sim.checks.verdict import Verdict, overall_verdict
from asset2sim.checks.verify import Known, cause_for, engines_of, verify_cached
from asset2sim.refinement.dynamics.mend import Mended, mend
from schemas.interaction import EngineReport
from schemas.overlay import PhysicsOverlay
from schemas.settings import Settings
from schemas.vocabulary import Engine, FailureMode


def verify_and_mend(
    extraction: Extraction,
    overlay: PhysicsOverlay,
    folder: Folder,
    settings: Settings,
    known: Known,
    doubts: Sequence[FailureMode] = (),
) -> tuple[Mended, Verdict]:
    """Verify the written asset in every engine and mend its dynamics where a check fails; ``known`` holds past reports.

    The folder is left with the overlay that is returned. ``doubts`` are failures that no change of dynamics mends and
    that other shapes showed: where one is seen here too, no other check runs, and it is the verdict.
    """
    cause = cause_for(extraction, overlay)
    engines = engines_of(settings.engine)

    def again(
        changed: PhysicsOverlay, wanted: Sequence[Engine], only: FailureMode | None = None
    ) -> tuple[EngineReport, ...]:
        write_urdf(extraction, changed, folder, settings.physics)
        return verify_cached(known, wanted, folder, changed, cause, settings, only)

    for doubt in doubts:
        reports = again(overlay, engines, doubt)
        verdict = overall_verdict(reports, overlay, settings.thresholds)
        if verdict.mode is doubt:
            return Mended(overlay, reports, (), ()), verdict
    mended = mend(extraction.features, overlay, again(overlay, engines), settings, again)
    return mended, overall_verdict(mended.reports, mended.overlay, settings.thresholds)
