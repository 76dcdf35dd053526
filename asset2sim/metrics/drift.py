"""Drift of the root over the test: largest distance and largest rotation from the pose after settling."""

import numpy as np
from scipy.spatial.transform import Rotation

from asset2sim.physics.arrays import Array


def drift(positions: Array, orientations: Array) -> tuple[float, float]:
    """D_pos (m) and D_ori (rad) of (n, 3) root positions and (n, 4) xyzw orientations; row 0 is the reference pose.

    Infinite where any row is not finite: an object that exploded has drifted.
    """
    if not (np.isfinite(positions).all() and np.isfinite(orientations).all()):
        return float("inf"), float("inf")
    distance = float(np.linalg.norm(positions - positions[0], axis=1).max())
    turned = Rotation.from_quat(orientations) * Rotation.from_quat(orientations[0]).inv()
    return distance, float(turned.magnitude().max())
