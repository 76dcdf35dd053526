"""Extract: asset folder → features and geometry (paper, "Extract"). Reads only."""

from dataclasses import dataclass, replace

from asset2sim.assets.extract import Extraction
from asset2sim.assets.meshes.shape_cache import SHAPE_CACHE
from asset2sim.baselines.declared_method import known_methods
from asset2sim.guidance.parts import parts_of, shown_front
from asset2sim.guidance.read import read_guidance
from asset2sim.intake.authored_numbers import stated_findings
from asset2sim.intake.blocked_joints import find_blocked_joints
from asset2sim.intake.guessed_ends import with_likelier_ends, with_told_ends
from asset2sim.intake.origin import extract
from asset2sim.intake.up_axis import find_up
from asset2sim.models.object_facts import rounded_object_info
from asset2sim.validation.support import wall_evidence
from schemas.asset import AssetRef
from schemas.errors import AssetError
from schemas.features import Features
from schemas.finding import Finding
from schemas.guidance import Guidance
from schemas.settings import PhysicsSettings
from schemas.vocabulary import FailureMode, UpAxis
from tasks.progress import AssetJob, StageResult


@dataclass(frozen=True, kw_only=True)
class Extracted(StageResult):
    """The asset as later stages see it, and what its prompt asks of it."""

    extraction: Extraction
    guidance: Guidance


def extract_asset(job: AssetJob, *, correct_joints: bool) -> Extracted:
    """The asset upright, its joints corrected by our rules; for methods without rules as authored, and turned only if
    its up axis is stated. Raises AssetError."""
    if job.ref.fault is not None:
        raise AssetError(FailureMode.UNREADABLE_ASSET, "unreadable_entry", job.ref.fault)
    authored = upright(job, find=correct_joints)
    corrected, told = validate_authored(authored, job.settings.physics)
    extraction = with_shown_front(corrected if correct_joints else authored)
    guidance = guidance_of(job.ref, extraction.features)
    if correct_joints:
        extraction = with_wall_evidence(extraction, guidance.category)
    findings = (*authored.findings, *told)
    return Extracted(extraction=extraction, features=extraction.features, guidance=guidance, findings=findings)


def with_shown_front(extraction: Extraction) -> Extraction:
    """The extraction with the front that its drawers and doors show, where they show one."""
    info = rounded_object_info(extraction.features)
    front = shown_front(info, parts_of(info, info.category))
    if front is None:
        return extraction
    return replace(extraction, features=extraction.features.model_copy(update={"front": (*front, 0.0)}))


def with_wall_evidence(extraction: Extraction, category: str) -> Extraction:
    """The extraction of a thing of this category with what of its shape shows that it hangs on a wall."""
    points = {name: geometry.points for name, geometry in extraction.geometry.items()}
    made_so, below = wall_evidence(extraction.features, points, 1.0, category)
    features = extraction.features.model_copy(update={"hangs": below or made_so})
    return replace(extraction, features=features)


def guidance_of(ref: AssetRef, features: Features) -> Guidance:
    """Guidance of the asset's prompt of an object with these features: the sentence is read here and nowhere else."""
    return read_guidance(ref.prompt or "", rounded_object_info(features))


def upright(job: AssetJob, *, find: bool) -> Extraction:
    """The asset as its file has it, turned where another axis than z is stated or, to ``find``, shown to point up."""
    cache, stated, inputs = job.out / SHAPE_CACHE, job.ref.up or job.settings.up, job.settings.inputs
    # A part of a scene stays as it stands there.
    stated = stated or (UpAxis.Z if job.ref.part is not None else None)
    if stated is not None:
        return extract(job.ref, cache, stated, inputs)
    authored = extract(job.ref, cache, inputs=inputs)
    up, told = find_up(authored) if find else (UpAxis.Z, None)
    if told is None:
        return authored
    if up is not UpAxis.Z:
        authored.triangles.keep()
    extraction = authored if up is UpAxis.Z else extract(job.ref, cache, up, inputs)
    return replace(extraction, findings=(*extraction.findings, told))


def lying_asset(job: AssetJob, up: UpAxis) -> tuple[Extraction, Features]:
    """The asset turned so that this axis of its file points up, its joints corrected, with the front that it shows so,
    as far as the method knows it; and all its features."""
    turned = extract(job.ref, job.out / SHAPE_CACHE, up, job.settings.inputs)
    corrected = validate_authored(turned, job.settings.physics)[0]
    corrected = with_shown_front(with_told_ends(corrected, job.closed_ends))
    return known_methods()[job.settings.method].given(job.ask, corrected)[1], corrected.features


def validate_authored(extraction: Extraction, settings: PhysicsSettings) -> tuple[Extraction, tuple[Finding, ...]]:
    """The extraction with joints corrected where geometry is unambiguous, and a warning for every implausible value.

    To measure an asset as authored use only the findings: its file does not have these corrections.
    """
    corrected, blocked = find_blocked_joints(extraction)
    corrected = with_likelier_ends(corrected, settings.sure_of_closed)
    return corrected, (*stated_findings(extraction, settings), *blocked)
