"""Apply: asset and overlay → a self-contained folder; the asset itself is never written to (paper, "Apply")."""

from dataclasses import dataclass
from pathlib import Path

from asset2sim.assets.extract import Extraction
from asset2sim.assets.folder import URDF_NAME, Folder, write_folder
from asset2sim.assets.meshes.shape_cache import PIECE_CACHE
from asset2sim.checks.known_reports import REPORT_CACHE, KnownReports
from asset2sim.refinement.refine import RefinementJob, ShapedFolder, shape_folder
from schemas.authored import kept_share
from schemas.overlay import Overlay, PhysicsOverlay
from schemas.vocabulary import CollisionMode, Keep, Quantity
from tasks.progress import AssetJob, StageResult


@dataclass(frozen=True, kw_only=True)
class Applied(StageResult):
    """The URDF to measure, the folder that was written, and, where our rules are to refine it, the job."""

    urdf: Path
    folder: Folder | None = None
    to_refine: tuple[RefinementJob, ShapedFolder] | None = None


def apply_overlay(
    job: AssetJob,
    extraction: Extraction,
    proposal: Overlay | None,
    overlay: PhysicsOverlay,
    folder: Path | None,
    *,
    rules: bool,
) -> Applied:
    """The overlay written into ``folder``; without one, the asset's own URDF.

    Our rules make collision shapes of their own, unless those of the file are to be kept. A baseline keeps the
    authored ones; references to missing meshes are still dropped, since no engine loads a file with one. Raises
    AssetError where the files cannot be written.
    """
    if folder is None:
        return Applied(urdf=extraction.urdf)
    if not rules or proposal is None:
        written = write_folder(extraction, overlay, {}, folder, job.settings.physics, CollisionMode.KEEP)
        return Applied(urdf=written.urdf, folder=written)
    cache, guidance, settings = job.out / PIECE_CACHE, job.ref.prompt, job.settings
    if kept_share(extraction.features.keep, Quantity.SHAPES) is Keep.ALL:
        collision = settings.collision.model_copy(update={"mode": CollisionMode.KEEP})
        settings = settings.model_copy(update={"collision": collision})
    known = KnownReports(job.out / REPORT_CACHE / f"{job.ref.asset_id}.npz")
    refinement = RefinementJob(
        extraction, proposal, overlay, job.source, folder, cache, settings, guidance=guidance, known=known,
        opened=tuple(name for name, asked in job.guidance.of_joints.items() if asked.state.in_use),
    )  # fmt: skip
    shaped = shape_folder(refinement)
    return Applied(urdf=folder / URDF_NAME, folder=shaped.folder, to_refine=(refinement, shaped))
