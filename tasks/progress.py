"""Results of one asset so far, collected while its stages run."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from time import perf_counter

from asset2sim.refinement.judge import Verified
from asset2sim.refinement.refine import RefinedFolder
from schemas.features import Features
from schemas.finding import Finding, TraceStep
from schemas.interaction import EngineReport, OverlapPair
from schemas.overlay import PhysicsOverlay
from schemas.request import ModelCall
from schemas.vocabulary import Stage


@dataclass
class Progress:
    """Results of one asset so far; they reach the record even if a later stage fails."""

    features: Features | None = None
    overlay: PhysicsOverlay | None = None
    reports: tuple[EngineReport, ...] = ()
    overlaps: tuple[OverlapPair, ...] = ()
    calls: list[ModelCall] = field(default_factory=list)
    trace: list[TraceStep] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)
    stage: Stage = Stage.EXTRACT

    def refined(self, shaped: RefinedFolder) -> None:
        """Add the results of refinement and verification."""
        self.findings.extend(shaped.findings)
        self.trace.extend(shaped.refined.trace)
        self.calls.extend(shaped.refined.calls)
        self.findings.extend(shaped.refined.findings)
        self.judged(shaped.judged)

    def judged(self, judged: Verified) -> None:
        """Add the results of verification."""
        self.overlay, self.reports, self.overlaps = judged.overlay, judged.reports, judged.overlaps
        self.trace.extend(judged.trace)
        self.findings.extend(judged.findings)

    @contextmanager
    def timed(self, stage: Stage) -> Iterator[None]:
        """Set the current stage and add its wall time, s."""
        self.stage, start = stage, perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + perf_counter() - start
