"""No inertia is more than a part's own reach allows; a sheet beside solids is a panel or a decal."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from asset2sim.assets.meshes.volume import shape_of
from asset2sim.assets.solids import PlacedShape, shapes_with_mass
from asset2sim.physics.arrays import Array, floats_of
from asset2sim.physics.inertia import box_inertia
from asset2sim.validation.mass_bounds import bounded_inertia
from tests.builders import corners, is_physical

edges = st.floats(1e-3, 1.0)


def cube_points(size: Array) -> Array:
    """The eight corners of a box of edge lengths ``size`` about the origin."""
    return corners(floats_of(-size / 2.0), floats_of(size / 2.0))


def test_a_solid_box_is_left_as_it_is_and_a_placeholder_is_lowered_to_the_faces() -> None:
    size = np.array([0.2, 0.1, 0.05])
    assert bounded_inertia(box_inertia(2.0, size), 2.0, cube_points(size), 1e-4) is None
    lowered = bounded_inertia(np.eye(3), 2.0, cube_points(size), 1e-4)
    assert lowered is not None
    moments = 2.0 * (size / 2.0) ** 2
    np.testing.assert_allclose(lowered, np.diag(moments.sum() - moments), rtol=1e-9)


def test_a_sheet_keeps_the_thickness_that_it_is_given() -> None:
    flat = cube_points(np.array([0.2, 0.2, 0.0]))
    lowered = bounded_inertia(np.eye(3), 1.0, flat, 1e-3)
    assert lowered is not None
    assert lowered[0, 0] == pytest.approx(0.1**2 + 1e-3**2) and is_physical(lowered)


@settings(max_examples=60, deadline=None)
@given(st.tuples(edges, edges, edges), st.floats(0.1, 50.0))
def test_whatever_comes_out_is_an_inertia_that_a_body_can_have(size: tuple[float, ...], factor: float) -> None:
    box = np.array(size)
    bounded = bounded_inertia(factor * box_inertia(1.0, box), 1.0, cube_points(box), 1e-4)
    if bounded is None:
        assert factor <= 3.0 * (1.0 + 1e-5), "a shell has three times the second moments of a solid box"
    else:
        assert is_physical(bounded)


def placed(size: tuple[float, float, float], at: tuple[float, float, float]) -> PlacedShape:
    """A box, flat where an edge is zero, at a place."""
    mesh = trimesh.creation.box(extents=size)
    mesh.apply_translation(at)
    return PlacedShape(shape_of(mesh), np.eye(3), np.zeros(3), None)


def test_a_pane_beside_its_handle_has_a_mass_and_a_sticker_has_none() -> None:
    handle, pane = placed((0.02, 0.1, 0.02), (0.0, 0.0, 0.0)), placed((0.5, 0.4, 0.0), (0.25, 0.0, 0.0))
    sticker = placed((0.01, 0.05, 0.0), (0.0, 0.0, 0.01))
    assert shapes_with_mass([handle, pane, sticker]) == [handle, pane]
    assert shapes_with_mass([pane]) == [pane]
