"""Bands of joint positions: for the search, for a model's step, and for what still counts as the requested state."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from asset2sim.engines.contacts import ContactPoint, penetration
from schemas.overlay import JointPhysics, PhysicsOverlay
from schemas.settings import SearchSettings
from schemas.vocabulary import Source

Pose = dict[str, float]
"""Joint → position, rad or m."""


def moved_joints(pose: Pose, start: Pose) -> Pose:
    """The joints that are not where ``start`` has them, at their new positions."""
    return {name: value for name, value in pose.items() if value != start[name]}


STATE_WEIGHT_M = 1e-3
"""λ, m: cost of moving a joint by its whole range from the requested state (objective Φ(q) + λ‖q − q_requested‖²)."""


@dataclass(frozen=True)
class Band:
    """Allowed positions of one joint, rad or m: ``low`` to ``high`` around ``requested``; ``span``: its whole range."""

    requested: float
    low: float
    high: float
    span: float

    def clamp(self, position: float) -> float:
        """The nearest position within the band."""
        return min(max(position, self.low), self.high)


@dataclass
class Evaluator:
    """Evaluates Φ(q) in one engine and counts evaluations."""

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


CLOSED_SHARE = 0.02
"""Share of its range from its closed end within which a joint counts as closed."""
AJAR_SHARE = 0.4
"""How far, as a share of how far it is asked to be open, a part may be moved: what is slightly open is not shut."""


def band_of(joint: JointPhysics, tolerance: float, closed_tolerance: float) -> Band:
    """Band that still counts as the requested state: a share of the range to either side, within the limits; nothing
    beside a position that the user states as a number, and beside an end to which its mechanism snaps it back."""
    position = joint.initial_position
    if joint.exact or (joint.bias is not None and joint.bias.kind == "bistable"):
        span = 1.0 if joint.lower is None or joint.upper is None else joint.upper - joint.lower
        return Band(position, position, position, span)
    if joint.lower is None or joint.upper is None:
        return Band(position, position - tolerance, position + tolerance, 1.0)
    span = joint.upper - joint.lower
    opening = abs(position - joint.closed)
    closed = opening <= CLOSED_SHARE * span
    reach = span * (closed_tolerance if closed else tolerance)
    if not closed and joint.position_source is not Source.RULE:
        reach = min(reach, AJAR_SHARE * opening)
    return Band(position, max(joint.lower, position - reach), min(joint.upper, position + reach), span)


def model_band(joint: JointPhysics, settings: SearchSettings) -> Band:
    """Band in which a model may place a joint: near the requested state if there is one, else all of its limits."""
    near = band_of(joint, settings.state_tolerance, settings.state_tolerance)
    if joint.position_source is not Source.RULE or joint.lower is None or joint.upper is None:
        return near
    return Band(near.requested, joint.lower, joint.upper, near.span)


def reachable_bands(overlay: PhysicsOverlay, settings: SearchSettings) -> dict[str, Band]:
    """Joint name → band in which a model may place it."""
    return {joint.name: model_band(joint, settings) for joint in overlay.joints}
