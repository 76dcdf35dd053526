"""One step of refinement."""

from schemas.base import Frozen


class TraceStep(Frozen):
    """A proposal over joint positions and what the simulator said of it. Φ in metres; ``moved`` maps joint →
    new position."""

    step: int
    proposer: str
    phi_before_m: float
    phi_after_m: float
    moved: dict[str, float]
    accepted: bool
    evaluations: int
    reason: str
