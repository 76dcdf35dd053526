"""Apply: asset and overlay → a self-contained folder; the asset itself is never written to (paper, "Apply")."""

from dataclasses import dataclass
from pathlib import Path

from asset2sim.assets.extract import Extraction
from asset2sim.assets.folder import URDF_NAME, write_folder
from asset2sim.assets.meshes.shape_cache import PIECE_CACHE
from asset2sim.refinement.refine import RefinementJob, ShapedFolder, shape_folder
from schemas.overlay import Overlay, PhysicsOverlay
from schemas.vocabulary import CollisionMode
from tasks.job import AssetJob
from tasks.progress import StageResult


@dataclass(frozen=True, kw_only=True)
class Applied(StageResult):
    """The URDF to measure and, where our rules are to refine it, the job and its folder."""

    urdf: Path
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

    Our rules make collision shapes of their own. A baseline keeps the authored ones; references to missing meshes are
    still dropped, since no engine loads a file with one. Raises AssetError where the files cannot be written.
    """
    if folder is None:
        return Applied(urdf=extraction.urdf)
    if not rules or proposal is None:
        written = write_folder(extraction, overlay, {}, folder, job.settings.physics, CollisionMode.KEEP)
        return Applied(urdf=written.urdf)
    cache, guidance = job.out / PIECE_CACHE, job.ref.prompt
    refinement = RefinementJob(extraction, proposal, overlay, job.source, folder, cache, job.settings, guidance)
    return Applied(urdf=folder / URDF_NAME, to_refine=(refinement, shape_folder(refinement)))
