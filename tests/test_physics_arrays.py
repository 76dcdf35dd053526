"""Boxes of points and of triangles, and cross products: to the bit what NumPy finds, in less time."""

import numpy as np
import pytest

from asset2sim.physics.arrays import box_of, boxes_of, cross


@pytest.mark.parametrize("count", [1, 2, 1000])
def test_boxes_are_those_that_numpy_finds(count: int) -> None:
    triangles = np.random.default_rng(count).normal(size=(count, 3, 3))
    points = triangles.reshape(-1, 3)
    np.testing.assert_array_equal(box_of(points), (points.min(axis=0), points.max(axis=0)))
    np.testing.assert_array_equal(boxes_of(triangles), (triangles.min(axis=1), triangles.max(axis=1)))


@pytest.mark.parametrize("shape", [(3,), (1, 3), (1000, 3), (0, 3)])
def test_cross_products_are_those_that_numpy_finds(shape: tuple[int, ...]) -> None:
    first, second = np.random.default_rng(3).normal(size=(2, *shape))
    np.testing.assert_array_equal(cross(first, second), np.cross(first, second))
