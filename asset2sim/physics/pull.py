"""Gravity's pull on one joint as it alone moves: constant along a slider, a wave of the angle about a hinge."""

import math
from dataclasses import dataclass

import numpy as np

from asset2sim.arrays import Array


@dataclass(frozen=True)
class Pull:
    """Gravity's generalised force (N·m or N, positive towards larger positions) at ``position`` (rad or m), and its
    slope there."""

    position: float
    force: float
    slope: float = 0.0
    prismatic: bool = False

    def at(self, positions: Array | float) -> Array:
        """(n,) the force at these positions: F cos δ + F' sin δ about a hinge, δ the angle from ``position``."""
        if self.prismatic:
            constant: Array = np.full(np.shape(positions), self.force)
            return constant
        angle = np.asarray(positions, dtype=float) - self.position
        wave: Array = self.force * np.cos(angle) + self.slope * np.sin(angle)
        return wave

    def largest(self, lower: float | None, upper: float | None) -> float:
        """The largest magnitude between these positions (None: anywhere), N·m or N."""
        if self.prismatic:
            return abs(self.force)
        amplitude = math.hypot(self.force, self.slope)
        if lower is None or upper is None:
            return amplitude
        crest = self.position + math.atan2(self.slope, self.force)
        # Crests and troughs are half a turn apart.
        if math.floor((upper - crest) / math.pi) >= math.ceil((lower - crest) / math.pi):
            return amplitude
        return float(np.abs(self.at(np.array([lower, upper]))).max())
