"""Context and log of one asset's refinement loop."""

from dataclasses import dataclass, field

from asset2sim.assets.extract import Extraction
from asset2sim.assets.hulls import Hulls
from schemas.finding import Finding, TraceStep
from schemas.overlay import Overlay, PhysicsOverlay
from schemas.settings import Settings
from schemas.vocabulary import Source


@dataclass
class Log:
    """Trace steps and findings of the loop."""

    trace: list[TraceStep] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)

    def step(self, step: TraceStep) -> None:
        """Add a step under the next number."""
        self.trace.append(step.model_copy(update={"step": len(self.trace)}))


@dataclass(frozen=True)
class RefinementContext:
    """Inputs shared by all steps of one asset's loop; ``overlay`` holds the requested state."""

    extraction: Extraction
    proposal: Overlay
    overlay: PhysicsOverlay
    source: Source
    hulls: Hulls
    settings: Settings
    log: Log
