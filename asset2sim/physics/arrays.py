"""Array types for signatures (docstrings give the shape), and conversions of arrays to the tuples of records."""

import numpy as np
from numpy.typing import NDArray

from schemas.base import Inertia6, Vector3

Array = NDArray[np.float64]
Faces = NDArray[np.int64]


def vector(values: Array) -> Vector3:
    """Three floats of a (3,) array."""
    return (float(values[0]), float(values[1]), float(values[2]))


def six(matrix: Array) -> Inertia6:
    """(ixx, ixy, ixz, iyy, iyz, izz) of a symmetric (3, 3) matrix."""
    m = (np.asarray(matrix) + np.asarray(matrix).T) / 2.0
    return (float(m[0, 0]), float(m[0, 1]), float(m[0, 2]), float(m[1, 1]), float(m[1, 2]), float(m[2, 2]))
