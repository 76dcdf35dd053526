"""Convert: an asset of any format as a URDF folder, with MJCF and USD beside it, its numbers as they are."""

from pathlib import Path

from asset2sim.assets.extract import Extraction
from asset2sim.assets.folder import staged_folder, write_folder
from schemas.asset import AssetRecord, AssetRef
from schemas.errors import AssetError
from schemas.finding import warning
from schemas.overlay import PhysicsOverlay
from schemas.request import ModelAsk
from schemas.settings import Settings
from schemas.verdict import Verdict
from schemas.vocabulary import CollisionMode, FailureMode, Stage
from tasks.check import overlay_as_it_is
from tasks.extract import extract_asset
from tasks.progress import AssetJob, Progress, StageResult
from tasks.publish import publish_folder


def convert_asset(ref: AssetRef, out: Path, settings: Settings, ask: ModelAsk) -> AssetRecord:
    """Record of one asset converted into ``out/assets/<asset_id>``, with exports; ``ask`` is never called."""
    progress, job = Progress(), AssetJob(ref, out, settings, ask)
    verdict = Verdict(FailureMode.NONE, "")
    try:
        extraction = progress.run(Stage.EXTRACT, extract_asset, job, correct_joints=False).extraction
        overlay = progress.run(Stage.VALIDATE, overlay_as_it_is, job, extraction).overlay
        with staged_folder(out / "assets" / ref.asset_id) as folder:
            progress.run(Stage.APPLY, write_as_it_is, job, extraction, overlay, folder)
            progress.run(Stage.PUBLISH, publish_folder, job, folder, overlay, ())
        progress.written = True
    except AssetError as error:
        verdict = progress.failed(error)
    return progress.record(ref, settings, verdict)


def write_as_it_is(job: AssetJob, extraction: Extraction, overlay: PhysicsOverlay, folder: Path) -> StageResult:
    """URDF and meshes in the folder; a finding that names the links whose mass no file states."""
    write_folder(extraction, overlay, {}, folder, job.settings.physics, CollisionMode.KEEP)
    links = [link.name for link in extraction.features.links if link.inertial is None and link.meshes]
    if not links:
        return StageResult()
    said = f"no mass is stated for {', '.join(links[:5])}{' and others' if len(links) > 5 else ''}; they have 1 kg and "
    said += "1 kg·m², as PyBullet would give them: asset2sim refine finds theirs"
    return StageResult(findings=(warning(Stage.APPLY, "mass_invented", said),))
