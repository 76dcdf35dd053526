"""Context, log, trace steps and findings of one asset's refinement loop."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial

from asset2sim.assets.extract import Extraction
from asset2sim.assets.hulls import Hulls
from asset2sim.assets.urdf.document import known_robot
from asset2sim.assets.urdf.read import passing_pairs
from asset2sim.refinement.collision.trim import PlaneCut
from asset2sim.validation.validate import validate
from schemas.finding import Finding, TraceStep
from schemas.overlay import Overlay, PhysicsOverlay
from schemas.settings import Settings
from schemas.vocabulary import Severity, Source, Stage

info = partial(Finding, stage=Stage.REFINE, severity=Severity.INFO)
"""A finding of this stage that only informs ..."""
warning = partial(Finding, stage=Stage.REFINE, severity=Severity.WARNING)
"""... and one that warns."""


def trace_step(
    proposer: str,
    before_m: float,
    after_m: float,
    accepted: bool,
    reason: str,
    moved: Mapping[str, float] | None = None,
    evaluations: int = 1,
) -> TraceStep:
    """A step with Φ (m) before and after it; the log gives it its number."""
    return TraceStep(
        step=0, proposer=proposer, phi_before_m=before_m, phi_after_m=after_m, moved=dict(moved or {}),
        accepted=accepted, evaluations=evaluations, reason=reason,
    )  # fmt: skip


@dataclass
class Log:
    """Trace steps and findings of the loop, and every plane by which hulls were cut, those of other attempts too."""

    trace: list[TraceStep] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    planes: list[PlaneCut] = field(default_factory=list)

    def step(self, step: TraceStep) -> None:
        """Add a step under the next number."""
        self.trace.append(step.model_copy(update={"step": len(self.trace)}))


@dataclass(frozen=True)
class RefinementContext:
    """Inputs of all steps of one asset's loop; ``overlay`` has the requested state, ``guidance`` the user's words."""

    extraction: Extraction
    proposal: Overlay
    overlay: PhysicsOverlay
    source: Source
    hulls: Hulls
    settings: Settings
    log: Log
    guidance: str | None = None

    @property
    def passing(self) -> tuple[tuple[str, str], ...]:
        """The pairs of links that the asset's URDF, or the overlay, lets pass through each other."""
        return (*passing_pairs(known_robot(self.extraction.urdf)), *self.overlay.passing)

    def validated_at(
        self, overlay: PhysicsOverlay, placed: Mapping[str, float], *, keep_terms: bool = True
    ) -> PhysicsOverlay:
        """The proposal validated again with the overlay's support, friction, passing pairs and these joints (rad or m)
        placed: loads depend on positions. ``keep_terms``: whether the file's dynamics may stay."""
        made, _ = validate(
            self.extraction, self.proposal, self.source, overlay.contact_friction, self.settings.physics,
            overlay.support, placed=placed, keep_terms=keep_terms, contact_source=overlay.contact_source,
        )  # fmt: skip
        return made.model_copy(update={"passing": overlay.passing})
