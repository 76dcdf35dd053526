"""The state being searched: where joints may go without leaving what was requested, and how good a pose is."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from asset2sim.engines.contacts import ContactPoint, penetration

STATE_WEIGHT_M = 1e-3
"""λ: what leaving the requested state by a joint's whole range costs, m of Φ (objective Φ(q) + λ‖q − q_requested‖²)."""


@dataclass(frozen=True)
class Band:
    """Where one joint may go: ``low`` to ``high`` around its requested position, rad or m; ``span`` is its
    whole range."""

    requested: float
    low: float
    high: float
    span: float

    def clamp(self, position: float) -> float:
        """The nearest position within the band."""
        return min(max(position, self.low), self.high)


@dataclass
class Evaluator:
    """Counts and evaluates Φ(q) through one engine."""

    contacts: Callable[[Mapping[str, float]], list[ContactPoint]]
    budget: int
    evaluations: int = 0

    def points(self, positions: Mapping[str, float]) -> list[ContactPoint]:
        """The contact points at these positions."""
        self.evaluations += 1
        return self.contacts(positions)

    def phi(self, positions: Mapping[str, float]) -> float:
        """Φ at these positions, m."""
        return penetration(self.points(positions))

    @property
    def spent(self) -> bool:
        """Whether the budget of evaluations is used up."""
        return self.evaluations >= self.budget


def objective(phi: float, positions: Mapping[str, float], bands: Mapping[str, Band]) -> float:
    """Φ(q) + λ‖q − q_requested‖², the distance as shares of each joint's range, m."""
    away = sum(((positions[name] - band.requested) / band.span) ** 2 for name, band in bands.items() if band.span > 0.0)
    return phi + STATE_WEIGHT_M * away
