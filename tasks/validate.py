"""Validate: proposal → complete physics, every change of it a finding (paper, "Validate")."""

from dataclasses import dataclass

from asset2sim.assets.authored import authored_overlay
from asset2sim.assets.extract import Extraction
from asset2sim.baselines.as_proposed import as_proposed
from asset2sim.validation.lying import lying_side
from asset2sim.validation.support import forced_support, support_findings, with_support
from asset2sim.validation.validate import contact_friction, validate
from schemas.features import Features
from schemas.finding import Finding
from schemas.overlay import Overlay, PhysicsOverlay
from schemas.support import Support
from schemas.vocabulary import UpAxis
from tasks.extract import lying_asset
from tasks.progress import AssetJob, StageResult


@dataclass(frozen=True, kw_only=True)
class Validated(StageResult):
    """The overlay that is to be written, of the asset as it is set down."""

    overlay: PhysicsOverlay
    extraction: Extraction


def validate_overlay(job: AssetJob, extraction: Extraction, proposal: Overlay | None, *, rules: bool) -> Validated:
    """The proposal completed and bounded by our rules, or unchanged; without a proposal the physics as authored. What
    is put down on any side, and would tip over in the state asked of it, is laid down, unless its up axis is stated
    or it stands in a scene."""
    physics, limits = job.settings.physics, job.settings.thresholds
    forced = forced_support(job.ref.support or job.settings.support, extraction)
    if rules and proposal is not None:
        overlay, findings = completed_proposal(job, extraction, proposal, forced)
        stays = job.ref.up or job.settings.up or job.ref.part is not None
        up, laid = (UpAxis.Z, None) if stays else lying_side(extraction, overlay, limits)
        features = None
        if laid is not None:
            stood = extraction.features
            extraction, features = lying_asset(job, up)
            proposal = as_it_lies(proposal, stood, extraction.features, job)
            overlay, findings = completed_proposal(job, extraction, proposal, forced)
            findings = (laid, *findings)
        return Validated(overlay=overlay, extraction=extraction, features=features, findings=findings)
    if proposal is None:
        overlay = authored_overlay(extraction, physics, asked=job.settings.methods.raw_asked)
    else:
        overlay = as_proposed(extraction, proposal, job.source, job.settings)
    if forced is not None:
        return Validated(overlay=overlay.model_copy(update={"support": forced}), extraction=extraction)
    return Validated(
        overlay=with_support(overlay, extraction, proposal, job.source, job.guidance), extraction=extraction
    )


def as_it_lies(proposal: Overlay, stood: Features, lies: Features, job: AssetJob) -> Overlay:
    """The proposal with the states that words ask of joints whose closed end is the other one since the object lies:
    as far from that; a handle that is folded down is so where it lies."""
    positions, stated = dict(proposal.initial_joint_positions), job.ref.overrides
    own = {} if stated is None else {name: item.unit for name, item in stated.joints.items()}
    for name in positions.keys() & (job.guidance.of_joints.keys() | own.keys()):
        if own.get(name, "share") != "share":
            continue
        before, after = stood.joint(name), lies.joint(name)
        if before.closed != after.closed and after.closed is not None and after.open is not None:
            positions[name] = after.closed + after.open - positions[name]
    return proposal.model_copy(update={"initial_joint_positions": positions})


def completed_proposal(
    job: AssetJob, extraction: Extraction, proposal: Overlay, forced: Support | None
) -> tuple[PhysicsOverlay, tuple[Finding, ...]]:
    """The proposal completed by our rules, with a finding for each change and for what carries the object."""
    physics = job.settings.physics
    friction = proposal.contact_friction or contact_friction(proposal.contact_material, physics)
    overlay, findings = validate(
        extraction, proposal, job.source, friction, physics, forced, guidance=job.guidance,
        limits=job.settings.thresholds,
    )  # fmt: skip
    return overlay, (*findings, *support_findings(overlay.support))
