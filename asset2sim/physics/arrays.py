"""Array types for signatures (docstrings give the shape), and conversions of arrays to the tuples of records."""

import numpy as np
from numpy.typing import NDArray

from schemas.base import Inertia6, Vector3

Array = NDArray[np.float64]
Faces = NDArray[np.int64]


def floats_of(values: Array) -> Vector3:
    """Three floats of a (3,) array."""
    return (float(values[0]), float(values[1]), float(values[2]))


def inertia_terms(matrix: Array) -> Inertia6:
    """(ixx, ixy, ixz, iyy, iyz, izz) of a symmetric (3, 3) matrix."""
    m = (np.asarray(matrix) + np.asarray(matrix).T) / 2.0
    return (float(m[0, 0]), float(m[0, 1]), float(m[0, 2]), float(m[1, 1]), float(m[1, 2]), float(m[2, 2]))


def cross(first: Array, second: Array) -> Array:
    """(..., 3) cross products of (..., 3) vectors, bit for bit NumPy's, which takes five times as long for a few."""
    (a, b, c), (x, y, z) = first.T, second.T
    found = np.empty(first.shape)
    found.T[0], found.T[1], found.T[2] = b * z - c * y, c * x - a * z, a * y - b * x
    return found


def norms(vectors: Array) -> Array:
    """(...) lengths of (..., 3) vectors."""
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    found: Array = np.sqrt(x * x + y * y + z * z)
    return found


def box_of(points: Array) -> tuple[Array, Array]:
    """(3,) lowest and highest coordinates of (n, 3) points; NumPy's ``min(axis=0)`` takes up to 30 times as long."""
    rows = np.ascontiguousarray(points.T)
    return rows.min(axis=1), rows.max(axis=1)


def boxes_of(triangles: Array) -> tuple[Array, Array]:
    """(k, 3) lowest and highest coordinates of (k, 3, 3) triangles; ``min(axis=1)`` takes five times as long."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)


def corners_of_box(points: Array) -> Array:
    """(8, 3) corners of the box around (n, 3) points along the axes of their frame, x varying fastest."""
    ends = np.array([points.min(axis=0), points.max(axis=0)])
    return np.array([[ends[(i >> axis) & 1][axis] for axis in range(3)] for i in range(8)])
