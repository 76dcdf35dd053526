"""Damping, friction and stiffness of one joint with their sources, and the loads that they are derived from."""

from dataclasses import dataclass

from asset2sim.physics.mass_matrix import Pull
from schemas.vocabulary import Source


@dataclass(frozen=True)
class Term:
    """One number, where it came from, and the number it replaced if a bound changed it."""

    value: float
    source: Source
    replaced: float | None = None


@dataclass(frozen=True)
class UnmetWish:
    """A wish of the proposal (``closes_s``, ``stops_within``, ``returns_s``) that cannot be met: what was asked, what
    the joint does instead (None: nothing of the kind), and why."""

    wish: str
    asked: float
    achieved: float | None
    why: str


@dataclass(frozen=True)
class JointTerms:
    """Damping, friction and stiffness of one joint, its spring's relaxed position, the wishes that were not met, and
    the armature (kg·m² or kg) with which the time step bears the spring."""

    damping: Term
    friction: Term
    stiffness: Term
    spring_reference: float
    unmet: tuple[UnmetWish, ...] = ()
    armature: float = 0.0


@dataclass(frozen=True)
class JointLoad:
    """Inertia and gravity load of one joint, and its limits (rad or m; None where it has none).

    ``inertia`` (kg·m² or kg) is the effective one, the base free, at the initial pose; ``least`` the smallest over its
    range, which bounds the explicit terms; ``held`` what it moves while the base and all other joints stay, from which
    times and distances follow. ``hold_friction`` (N·m or N) is what a joint that must stay somewhere
    needs; 0 for one that need not.
    """

    prismatic: bool
    inertia: float
    least: float
    held: float
    pull: Pull
    lower: float | None
    upper: float | None
    closed: float
    open: float
    rest: float
    """Position to which a spring returns it, within the limits, rad or m."""
    hold_friction: float = 0.0
    reach: float = 1.0
    """Distance from the axis to the far edge of what a hinge moves, where a hand presses it, m; 1 for a slider."""

    @property
    def rest_load(self) -> float:
        """Gravity's signed pull at ``rest``, N·m or N."""
        return float(self.pull.at(self.rest))

    @property
    def far(self) -> float:
        """Signed way from ``rest`` to the end of the range that is further from it, rad or m."""
        if self.upper is None or self.lower is None:
            return UNLIMITED_FAR
        up, down = self.upper - self.rest, self.rest - self.lower
        return -down if down > up else up

    @property
    def backed(self) -> bool:
        """Whether a stop is behind ``rest``, against which a spring can be preloaded."""
        if self.upper is None or self.lower is None:
            return False
        span = self.upper - self.lower
        return abs(self.far) >= (1.0 - STOP_SHARE) * span

    @property
    def stopped(self) -> bool:
        """Whether ``rest`` is the stop towards which a spring against gravity presses the joint."""
        stop = self.upper if self.rest_load < 0.0 else self.lower
        if stop is None or self.upper is None or self.lower is None:
            return False
        return abs(self.rest - stop) <= STOP_SHARE * (self.upper - self.lower)


UNLIMITED_FAR = 0.5
"""Where a joint without limits is let go, rad or m from its spring's rest."""
STOP_SHARE = 1e-3
"""Share of its range from a limit within which a joint is at its stop."""
