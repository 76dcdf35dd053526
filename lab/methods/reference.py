"""Human baseline: an expert's scale and state, engine defaults for the rest, no model call."""

from pathlib import Path

from asset2sim.assets.extract import Extraction, folder_of
from asset2sim.baselines.declared_method import DOTTED, DeclaredMethod, ProposalJob, Proposed
from asset2sim.intake.url_files import LEVELS
from asset2sim.runs.check_request import FILE, read_references
from schemas.alignment import Reference
from schemas.asset import AssetRef
from schemas.errors import AssetError, UsageError
from schemas.features import Features
from schemas.finding import Finding
from schemas.overlay import Overlay
from schemas.vocabulary import FailureMode, Method, Severity, Source, Stage


def propose_reference(ref: AssetRef, features: Features) -> tuple[Overlay, tuple[Finding, ...]]:
    """The expert's overlay: a scale, and the position of the joint of interest (rad, or m at scale 1).

    Raises AssetError ``no_valid_estimate`` where no reference file is found or readable, or it lacks the asset.
    """
    file, reference = reference_of(ref)
    movable = [joint.name for joint in features.movable_joints]
    known = reference.joint in movable
    message = (
        f"{file.name} states a position of joint '{reference.joint}', which asset '{ref.asset_id}' does not have or "
        f"cannot move; it is left out: movable joints are {', '.join(movable[:40]) or 'none'}"
    )
    code = "reference_joint_unknown"
    unknown = Finding(stage=Stage.SYNTHESIZE, severity=Severity.WARNING, code=code, message=message)
    overlay = Overlay(
        scale=reference.scale,
        initial_joint_positions={reference.joint: reference.position} if known else {},
        asked=("scale", reference.joint) if known else ("scale",),
        notes=(f"scale and state from {file.name}",),
    )
    return overlay, () if known else (unknown,)


def reference_of(ref: AssetRef) -> tuple[Path, Reference]:
    """The dataset's reference file and the asset's row in it."""
    file = reference_file(folder_of(Path(ref.path)))
    if file is None:
        raise no_estimate(
            f"there is no {FILE} beside asset '{ref.asset_id}' or in the {LEVELS} folders above; --method reference "
            "needs an expert's choice for every asset"
        )
    try:
        found = read_references(file).get(ref.asset_id)
    except (OSError, UsageError) as error:
        raise no_estimate(f"{file.name} cannot be read as a table of references: {error}") from None
    if found is None:
        raise no_estimate(f"{file.name} has no row for asset '{ref.asset_id}': add one, or leave the asset out")
    return file, found


def reference_file(folder: Path) -> Path | None:
    """The nearest reference file: in the asset's folder or one of the ``LEVELS`` above it."""
    files = (place / FILE for place in (folder, *list(folder.parents)[:LEVELS]))
    return next((file for file in files if file.is_file()), None)


def no_estimate(message: str) -> AssetError:
    """The error for an asset without a usable reference."""
    return AssetError(FailureMode.NO_VALID_ESTIMATE, "no_reference", message)


def propose(job: ProposalJob, extraction: Extraction) -> Proposed:
    """An expert's scale and state. Raises AssetError."""
    proposal, findings = propose_reference(job.ref, extraction.features)
    return proposal, (), findings


METHOD = DeclaredMethod(
    Method.REFERENCE,
    "human reference",
    "an expert's scale and state, an engine's defaults for the rest",
    propose,
    place=10,
    asks=False,
    source=Source.USER,
    reads_above=FILE,
    colour="#009E73",
    dashes=DOTTED,
)
