"""Oscillation of joints over the test: amplitude and reversals (paper, evaluation, section 1)."""

import numpy as np

from asset2sim.physics.arrays import Array

STILL = 1e-6
"""Change of a joint between two steps below which it counts as still: solvers tremble in the last digits."""


def amplitude(positions: Array) -> float:
    """A = max q − min q of (n,) positions of one joint, rad or m."""
    return float(np.ptp(positions)) if np.isfinite(positions).all() else float("inf")


def sign_changes(positions: Array) -> int:
    """How often Δq changes sign along (n,) positions, steps at which the joint is still left out."""
    steps = np.diff(positions)
    signs = np.sign(steps[np.abs(steps) > STILL])
    return int(np.count_nonzero(signs[1:] != signs[:-1]))
