"""Refine: propose, simulate, and accept only what measures better (paper, "Refine")."""

from dataclasses import dataclass

from asset2sim.assets.folder import Folder
from asset2sim.refinement.refine import refine
from schemas.overlay import PhysicsOverlay
from tasks.apply import Applied
from tasks.progress import AssetJob, StageResult


@dataclass(frozen=True, kw_only=True)
class Refined(StageResult):
    """The overlay that stays written, its folder, and engines' reports on that; None where nothing was refined."""

    overlay: PhysicsOverlay
    folder: Folder | None = None


def refine_written(job: AssetJob, applied: Applied) -> Refined:
    """The asset that ``apply`` wrote, refined; raises AssetError."""
    assert applied.to_refine is not None, "only what our rules wrote is refined"
    done = refine(*applied.to_refine, job.ask)
    return Refined(
        overlay=done.overlay,
        folder=done.folder,
        reports=done.reports,
        trace=done.trace,
        calls=done.calls,
        findings=done.findings,
        measure_s=done.measure_s,
    )
