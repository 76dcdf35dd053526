"""Objects as they are, with nothing proposed or changed: checked, or converted to a URDF with exports beside it."""

from dataclasses import replace
from pathlib import Path

from pydantic import ValidationError

from asset2sim.assets.authored import REFINED_NAME, authored_overlay, read_overlay, with_refined_state
from asset2sim.assets.checksums import changed_files
from asset2sim.assets.extract import Extraction, folder_of
from asset2sim.assets.folder import staged_folder, write_folder
from asset2sim.validation.support import forced_support, with_support
from schemas.asset import AssetRecord, AssetRef
from schemas.errors import AssetError
from schemas.finding import Finding, remark, warning
from schemas.overlay import PhysicsOverlay
from schemas.request import ModelAsk
from schemas.settings import Settings
from schemas.verdict import Verdict
from schemas.vocabulary import CollisionMode, FailureMode, Source, Stage
from tasks.extract import extract_asset
from tasks.measure import measure_written
from tasks.progress import AssetJob, Progress, StageResult
from tasks.publish import publish_folder
from tasks.validate import Validated

STATE_READ = "refined_state"
"""Code of the finding that says that the state is that of the folder's ``overlay.json``."""


def check_asset(ref: AssetRef, out: Path, settings: Settings, ask: ModelAsk) -> AssetRecord:
    """Record of one folder as it is; ``out`` takes what is computed on the way, and ``ask`` is never called."""
    progress = Progress()
    job = AssetJob(ref, out, settings, ask)
    try:
        verdict = _run_checks(job, progress)
    except AssetError as error:
        verdict = progress.failed(error)
    return progress.record(ref, settings, verdict)


def _run_checks(job: AssetJob, progress: Progress) -> Verdict:
    progress.run(Stage.EXTRACT, compare_with_checksums, folder_of(Path(job.ref.path)))
    extracted = progress.run(Stage.EXTRACT, extract_asset, job, correct_joints=False)
    job, extraction = replace(job, guidance=extracted.guidance), extracted.extraction
    overlay = progress.run(Stage.VALIDATE, overlay_as_it_is, job, extraction).overlay
    return progress.run(Stage.MEASURE, measure_written, job, extraction, extraction.urdf, overlay, None).verdict


def compare_with_checksums(folder: Path) -> StageResult:
    """A finding for each file of a refined folder that is not as it was written."""
    changed = changed_files(folder) or ()
    return StageResult(
        findings=tuple(warning(Stage.VALIDATE, "changed_by_hand", f"not as it was refined: {text}") for text in changed)
    )


def overlay_as_it_is(job: AssetJob, extraction: Extraction) -> Validated:
    """Overlay of what the URDF states, in the state, with the friction and on the support that a refined folder's
    ``overlay.json``
    adds; without one, joints at zero or their nearest limit, and the support that is found."""
    overlay = authored_overlay(extraction, job.settings.physics)
    told = list[Finding]()
    refined, problem = read_refined(folder_of(Path(job.ref.path)))
    if problem:
        told.append(warning(Stage.VALIDATE, "refined_state_unread", problem))
    forced = forced_support(job.ref.support or job.settings.support)
    if refined is None:
        overlay = with_support(overlay, extraction, None, Source.RULE, job.guidance)
    else:
        overlay, unknown = with_refined_state(overlay, refined)
        told += [warning(Stage.VALIDATE, "refined_joint_unknown", text) for text in unknown]
        told.append(
            remark(Stage.VALIDATE, STATE_READ, f"initial state, friction and support are those of {REFINED_NAME}")
        )
    overlay = overlay if forced is None else overlay.model_copy(update={"support": forced})
    return Validated(overlay=overlay, extraction=extraction, findings=tuple(told))


def read_refined(folder: Path) -> tuple[PhysicsOverlay | None, str]:
    """The overlay of a refined folder, None without one, and why it cannot be read, empty where it can."""
    file = folder / REFINED_NAME
    if not file.is_file():
        return None, ""
    try:
        return read_overlay(folder), ""
    except (OSError, ValueError, ValidationError) as error:
        first = str(error).splitlines()[0]
        return None, f"{REFINED_NAME} cannot be read ({first}): joints start at zero or their nearest limit"


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
