"""Joints as people know them: mechanisms by name, what a hand should need, and what some exert besides a spring."""

import math
from typing import Annotated, Literal

from pydantic import Field

from schemas.base import Finite, Frozen, NonNegative, Positive

MechanismName = Literal[
    "free", "friction", "spring return", "detent", "bistable", "screw", "strut", "seal", "latch", "brake"
]
"""Kinds of a part: it moves freely; stays by friction, detents, a thread or a brake; returns by a spring; snaps between
two ends; has its weight carried by a strut, counterweight or gas spring; or is kept shut by a gasket or catch."""
STAYS: tuple[MechanismName, ...] = ("friction", "detent", "bistable", "screw", "strut", "seal", "latch", "brake")
"""Mechanisms that keep a part where it is left."""
CAUGHT: tuple[MechanismName, ...] = ("seal", "latch")
"""Those that keep a door shut, and say nothing of how it moves once it is open."""


class EffortRange(Frozen):
    """The forces at a part's edge (N) between which a part of its ``kind`` should move, and where that is stated.
    ``braced``: the other hand holds the object meanwhile, so that it neither tips nor slides."""

    kind: str
    least_n: NonNegative
    most_n: Positive
    source: str
    braced: bool = False


class Bias(Frozen):
    """Effort of a ``kind`` of mechanism on its joint, N·m or N: ``slope`` (N·m/rad or N/m) times the way from
    ``none_at`` (rad or m), at least ``least`` and at most ``most``. A gasket presses a door shut over the last
    millimetres, a rocker is pressed to the end that is nearer, a strut lifts a flap. With a ``period`` (rad or m) the
    way is from the nearest of the places that lie so far apart, from ``none_at`` on: the clicks of a selector.

    URDF has no field for it: our engines, ``load.py``, the MJCF and USD's variant for MuJoCo have it; for PhysX USD
    only states it."""

    kind: MechanismName
    slope: Finite
    none_at: Finite
    least: Annotated[Finite, Field(le=0.0)]
    most: NonNegative
    period: NonNegative = 0.0

    def at(self, position: float) -> float:
        """N·m or N at a position, rad or m."""
        off = position - self.none_at
        off = math.remainder(off, self.period) if self.period > 0.0 else off
        return min(max(self.slope * off, self.least), self.most)
