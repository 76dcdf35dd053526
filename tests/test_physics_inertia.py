"""Inertia in closed form, and what becomes of tensors that no body could have."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from asset2sim.assets.meshes.volume import Solid, combined_solid, shape_of
from asset2sim.physics.arrays import Array, inertia_terms
from asset2sim.physics.inertia import box_inertia, make_physical, tensor_of
from schemas.vocabulary import VolumeSource
from tests.builders import cylinder_inertia, is_physical

SMALLEST = 1e-9
numbers = st.floats(-10.0, 10.0, allow_subnormal=False)
positive = st.floats(0.01, 10.0)
directions = st.tuples(*[st.floats(-np.pi, np.pi)] * 3)


def turned(moments: Array, angles: tuple[float, ...]) -> Array:
    """A tensor of these principal moments about turned axes."""
    rotation = trimesh.transformations.euler_matrix(*angles)[:3, :3]
    tensor: Array = rotation @ np.diag(moments) @ rotation.T
    return tensor


def test_box_inertia_is_the_closed_form() -> None:
    # 12 kg, 1 x 2 x 3 m: m (b² + c²) / 12 = 13, 10, 5.
    np.testing.assert_allclose(box_inertia(12.0, np.array([1.0, 2.0, 3.0])), np.diag([13.0, 10.0, 5.0]), rtol=1e-12)


def test_cylinder_inertia_is_the_closed_form() -> None:
    # 12 kg, r = 1, h = 3: m (3 r² + h²) / 12 = 12 across, m r² / 2 = 6 along z.
    np.testing.assert_allclose(cylinder_inertia(12.0, 1.0, 3.0), np.diag([12.0, 12.0, 6.0]), rtol=1e-12)


def test_the_integral_over_a_box_mesh_is_the_closed_form_wherever_it_lies() -> None:
    size, place = np.array([0.3, 0.2, 0.1]), np.array([5.0, -3.0, 2.0])
    mesh = trimesh.creation.box(extents=size)
    mesh.apply_translation(place)
    shape = shape_of(mesh)
    assert shape.source is VolumeSource.SIGNED
    assert shape.solid.volume == pytest.approx(0.006, rel=1e-9)
    np.testing.assert_allclose(shape.solid.center, place, rtol=1e-9)
    np.testing.assert_allclose(shape.solid.inertia, box_inertia(0.006, size), rtol=1e-7, atol=1e-14)


def test_the_integral_over_a_cylinder_mesh_is_the_closed_form() -> None:
    mesh = trimesh.creation.cylinder(radius=0.1, height=0.4, sections=256)
    shape = shape_of(mesh)
    # A polygon of 256 sides has 1 - (2π/256)²/6 = 0.9999 of the circle's area.
    assert shape.solid.volume == pytest.approx(np.pi * 0.1**2 * 0.4, rel=2e-4)
    expected = cylinder_inertia(shape.solid.volume, 0.1, 0.4)
    np.testing.assert_allclose(shape.solid.inertia, expected, rtol=2e-4, atol=1e-10)


def test_a_turned_box_has_the_turned_tensor() -> None:
    size = np.array([0.3, 0.2, 0.1])
    matrix = trimesh.transformations.euler_matrix(0.3, -0.8, 1.1)
    mesh = trimesh.creation.box(extents=size)
    mesh.apply_transform(matrix)
    expected = matrix[:3, :3] @ box_inertia(0.006, size) @ matrix[:3, :3].T
    np.testing.assert_allclose(shape_of(mesh).solid.inertia, expected, rtol=1e-7, atol=1e-14)


def test_two_halves_combine_into_the_whole_box() -> None:
    half = Solid(4.0, np.array([0.5, 1.0, 1.0]), box_inertia(4.0, np.array([1.0, 2.0, 2.0])))
    other = Solid(4.0, np.array([1.5, 1.0, 1.0]), half.inertia)
    whole = combined_solid([half, other])
    assert whole.volume == pytest.approx(8.0)
    np.testing.assert_allclose(whole.center, [1.0, 1.0, 1.0])
    np.testing.assert_allclose(whole.inertia, box_inertia(8.0, np.full(3, 2.0)), rtol=1e-12, atol=1e-12)


def test_two_points_combine_by_the_parallel_axis_theorem() -> None:
    # 1 and 3 units 4 apart along x: reduced mass 3/4, so 12 about y and z and 0 about x; centre at 3.
    nothing = np.zeros((3, 3))
    pair = combined_solid([Solid(1.0, np.zeros(3), nothing), Solid(3.0, np.array([4.0, 0.0, 0.0]), nothing)])
    np.testing.assert_allclose(pair.center, [3.0, 0.0, 0.0])
    np.testing.assert_allclose(pair.inertia, np.diag([0.0, 12.0, 12.0]), atol=1e-12)


def test_a_combination_off_the_axes_has_products_of_inertia() -> None:
    # Two units at ±(1, 1, 0): Ixx = Iyy = 2, Ixy = -2, Izz = 4.
    nothing = np.zeros((3, 3))
    pair = combined_solid([Solid(1.0, np.array([s, s, 0.0]), nothing) for s in (-1.0, 1.0)])
    np.testing.assert_allclose(pair.inertia, [[2.0, -2.0, 0.0], [-2.0, 2.0, 0.0], [0.0, 0.0, 4.0]], atol=1e-12)


@given(moments=st.tuples(positive, positive, positive), angles=directions, shift=st.tuples(numbers, numbers, numbers))
@settings(deadline=None, derandomize=True, max_examples=50)
def test_moving_a_solid_keeps_its_volume_and_principal_moments(
    moments: tuple[float, ...], angles: tuple[float, ...], shift: tuple[float, ...]
) -> None:
    rotation = trimesh.transformations.euler_matrix(*angles)[:3, :3]
    solid = Solid(2.0, np.array([0.1, 0.2, 0.3]), np.diag(moments))
    moved = solid.moved(rotation, np.array(shift))
    assert moved.volume == solid.volume
    np.testing.assert_allclose(np.linalg.eigvalsh(moved.inertia), sorted(moments), rtol=1e-9)
    np.testing.assert_allclose(moved.center - shift, rotation @ solid.center, atol=1e-12)


def test_six_and_tensor_of_are_inverses_in_the_stated_order() -> None:
    tensor = tensor_of((1.0, 2.0, 3.0, 4.0, 5.0, 6.0))
    np.testing.assert_array_equal(tensor, [[1.0, 2.0, 3.0], [2.0, 4.0, 5.0], [3.0, 5.0, 6.0]])
    assert inertia_terms(tensor) == (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)


@given(entries=st.tuples(*[numbers] * 6))
@settings(deadline=None, derandomize=True)
def test_whatever_is_mended_is_physical(entries: tuple[float, float, float, float, float, float]) -> None:
    mended = make_physical(tensor_of(entries), SMALLEST)
    moments = np.linalg.eigvalsh(mended.tensor)
    scale = max(float(moments[2]), SMALLEST)
    np.testing.assert_allclose(mended.tensor, mended.tensor.T, rtol=0.0, atol=1e-12 * scale)
    assert moments[0] > 0.0
    assert moments[2] <= (moments[0] + moments[1]) * (1.0 + 1e-9)
    assert is_physical(mended.tensor)


@given(entries=st.tuples(*[numbers] * 6))
@settings(deadline=None, derandomize=True)
def test_mending_twice_changes_no_more_than_the_hair(entries: tuple[float, float, float, float, float, float]) -> None:
    once = make_physical(tensor_of(entries), SMALLEST).tensor
    twice = make_physical(once, SMALLEST).tensor
    np.testing.assert_allclose(twice, once, rtol=0.0, atol=2e-6 * float(np.abs(once).max()))


@given(size=st.tuples(positive, positive, positive), mass=positive, angles=directions)
@settings(deadline=None, derandomize=True)
def test_the_tensor_of_a_real_box_is_left_alone(
    size: tuple[float, ...], mass: float, angles: tuple[float, ...]
) -> None:
    # Edges within a factor of a thousand: m0 + m1 exceeds m2 by m c² / 6, far above the hair.
    tensor = turned(np.diag(box_inertia(mass, np.array(size))), angles)
    mended = make_physical(tensor, SMALLEST)
    assert mended.changes == ()
    np.testing.assert_allclose(mended.tensor, tensor, rtol=1e-12, atol=1e-12)
    assert is_physical(tensor)


def test_a_broken_off_diagonal_is_dropped_and_the_others_stay() -> None:
    mended = make_physical(tensor_of((1.0, 1.5, 0.1, 1.0, 0.1, 1.0)), SMALLEST)
    assert [change.split()[0] for change in mended.changes] == ["Ixy"]
    np.testing.assert_allclose(mended.tensor, tensor_of((1.0, 0.0, 0.1, 1.0, 0.1, 1.0)), atol=1e-12)


def test_a_lopsided_tensor_meets_the_triangle_inequality() -> None:
    # 1, 2 and 9: the two small ones rise by (9 - 3) / 2 each, to 4 and 5.
    mended = make_physical(np.diag([2.0, 9.0, 1.0]), SMALLEST)
    np.testing.assert_allclose(np.diag(mended.tensor), [5.0, 9.0, 4.0], rtol=1e-5)
    assert "triangle" in " ".join(mended.changes)


@pytest.mark.parametrize("tensor", [np.zeros((3, 3)), -np.eye(3), np.diag([0.0, 1.0, 1.0])])
def test_no_moment_stays_below_the_smallest(tensor: Array) -> None:
    mended = make_physical(tensor, 1e-3)
    assert np.linalg.eigvalsh(mended.tensor)[0] >= 1e-3 * (1.0 - 1e-9)
    assert "raised to 0.001" in mended.changes[0]


def test_what_is_physical_is_told_from_what_is_not() -> None:
    assert is_physical(np.diag([1.0, 1.0, 2.0]))  # a flat plate: equality
    assert not is_physical(np.diag([1.0, 1.0, 2.1]))
    assert not is_physical(np.diag([-1.0, 1.0, 1.0]))
    assert not is_physical(np.diag([0.0, 1.0, 1.0]))
