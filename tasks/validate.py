"""Validate: proposal → complete physics, every change of it a finding (paper, "Validate")."""

from dataclasses import dataclass

from asset2sim.assets.authored import authored_overlay
from asset2sim.assets.extract import Extraction
from asset2sim.baselines.as_proposed import as_proposed
from asset2sim.validation.support import carried, forced_support, support_findings
from asset2sim.validation.validate import contact_friction, validate
from schemas.overlay import Overlay, PhysicsOverlay
from tasks.job import AssetJob
from tasks.progress import StageResult


@dataclass(frozen=True, kw_only=True)
class Validated(StageResult):
    """The overlay that is to be written."""

    overlay: PhysicsOverlay


def validate_overlay(job: AssetJob, extraction: Extraction, proposal: Overlay | None, *, rules: bool) -> Validated:
    """The proposal completed and bounded by our rules, or unchanged; without a proposal the physics as authored."""
    physics, guidance = job.settings.physics, job.guidance
    forced = forced_support(job.ref.support or job.settings.support, extraction)
    if rules and proposal is not None:
        friction = proposal.contact_friction or contact_friction(proposal.contact_material, physics)
        overlay, findings = validate(extraction, proposal, job.source, friction, physics, forced, guidance=guidance)
        return Validated(overlay=overlay, findings=(*findings, *support_findings(overlay.support)))
    if proposal is None:
        overlay = authored_overlay(extraction, physics, asked=job.settings.methods.raw_asked)
    else:
        overlay = as_proposed(extraction, proposal, job.source, job.settings)
    if forced is not None:
        return Validated(overlay=overlay.model_copy(update={"support": forced}))
    return Validated(overlay=carried(overlay, extraction, proposal, job.source, guidance))
