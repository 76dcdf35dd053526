"""Summary that a run keeps in memory of each asset's record, about a hundredth of it: verdict, cost, and what reports
show."""

from collections.abc import Mapping
from dataclasses import dataclass

from schemas.alignment import Alignment, Expected
from schemas.asset import AssetRef
from schemas.vocabulary import FailureMode, Method, Status


@dataclass(frozen=True, slots=True)
class MotionSummary:
    """The paper's tests in the engine that measured first; joints that oscillate by the run's thresholds."""

    penetration_m: float
    drift_m: float
    drift_rad: float
    finite: bool
    oscillating_joints: int


@dataclass(frozen=True, slots=True)
class AssetSummary:
    """One asset of a run. Fields of ``AssetRecord`` have its names; those of stages not reached are None.

    ``call_costs_usd`` has an entry per call not answered from the cache, as tokens count only those; ``engines`` is how
    many engines passed every check, and how many ran.
    """

    ref: AssetRef
    category: str
    method: Method
    model: str
    status: Status
    failure_mode: FailureMode
    reason: str
    content_hash: str
    seconds: Mapping[str, float]
    total_seconds: float
    call_costs_usd: tuple[float, ...]
    prompt_tokens: int
    completion_tokens: int
    cached_calls: int
    scale: float | None
    mass_kg: float | None
    measurement: MotionSummary | None
    alignment: Alignment | None
    expected: tuple[Expected, ...]
    engines: tuple[int, int] | None
    numbers: tuple[int, int, int] | None = None
    """Numbers of a file in metres that are kept, supplied and mended; None for other files."""

    @property
    def queries(self) -> int:
        """Model calls that were not answered from the cache."""
        return len(self.call_costs_usd)
