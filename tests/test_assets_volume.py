"""What a mesh weighs: closed, open, doubled, inside out, flat, drawn in loose sides, or several shells in one."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
import yourdfpy
from scipy.spatial import ConvexHull

from asset2sim.assets.meshes.hull import MOST_SHELLS, distinct_faces, hull_of, hull_vertices, solid_moments, used_points
from asset2sim.assets.meshes.load import load_mesh, primitive, scale_vector
from asset2sim.assets.meshes.volume import SLAB_THICKNESS, shape_of, sheet_as_slab
from asset2sim.physics.convex_hull import hull_volume
from asset2sim.physics.inertia import box_inertia
from schemas.vocabulary import VolumeSource
from tests.builders import corners, double_sided, joined, loose_sides, without_top

SIZE = np.array([0.4, 0.3, 0.2])
VOLUME = 0.024


def cuboid(at: tuple[float, float, float] = (0.0, 0.0, 0.0), size: tuple[float, ...] = tuple(SIZE)) -> trimesh.Trimesh:
    made: trimesh.Trimesh = trimesh.creation.box(extents=size)
    made.apply_translation(at)
    return made


def quad(x: float, y: float) -> trimesh.Trimesh:
    """A rectangle in the plane z = 0, its corner at the origin."""
    points = np.array([[0.0, 0.0, 0.0], [x, 0.0, 0.0], [x, y, 0.0], [0.0, y, 0.0]])
    return trimesh.Trimesh(points, [[0, 1, 2], [0, 2, 3]], process=False)


def inside_out(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.faces[:, ::-1], process=False)


@pytest.mark.parametrize(
    ("drawn", "source", "watertight"),
    [
        (cuboid(), VolumeSource.SIGNED, True), (inside_out(cuboid()), VolumeSource.SIGNED, True),
        (without_top(cuboid()), VolumeSource.HULL, False), (double_sided(cuboid()), VolumeSource.HULL, None),
        (double_sided(without_top(cuboid())), VolumeSource.HULL, None),
        (loose_sides(cuboid()), VolumeSource.HULL, False),
    ],
    ids=["closed", "inside out", "open", "double-sided", "open and double-sided", "six loose sides"],
)  # fmt: skip
def test_a_box_is_one_solid_however_its_faces_are_drawn(
    drawn: trimesh.Trimesh, source: VolumeSource, watertight: bool | None
) -> None:
    shape = shape_of(drawn)
    assert shape.source is source and watertight in (None, shape.watertight)
    assert shape.solid.volume == pytest.approx(VOLUME, rel=1e-9)
    np.testing.assert_allclose(shape.solid.center, np.zeros(3), atol=1e-9)
    np.testing.assert_allclose(shape.solid.inertia, box_inertia(VOLUME, SIZE), rtol=1e-7, atol=1e-12)
    assert len(shape.pieces) == 1 and len(shape.pieces[0]) == 8 and not shape.flat
    np.testing.assert_allclose([shape.points.min(axis=0), shape.points.max(axis=0)], [-SIZE / 2, SIZE / 2])


def test_loose_sides_with_a_solid_knob_are_still_one_box() -> None:
    knob = cuboid(at=(0.0, 0.0, 0.11), size=(0.02, 0.02, 0.02))
    shape = shape_of(joined(loose_sides(cuboid()), knob))
    assert len(shape.pieces) == 1  # most of its area is loose: the knob is not all that there is
    assert shape.solid.volume > VOLUME


def test_a_hollow_box_has_only_its_walls() -> None:
    inner = cuboid(size=(0.2, 0.1, 0.1))
    shape = shape_of(joined(cuboid(), inside_out(inner)))
    assert shape.source is VolumeSource.SIGNED
    assert shape.solid.volume == pytest.approx(VOLUME - 0.002, rel=1e-9)
    walls = box_inertia(VOLUME, SIZE) - box_inertia(0.002, np.array([0.2, 0.1, 0.1]))
    np.testing.assert_allclose(shape.solid.inertia, walls, rtol=1e-7, atol=1e-12)


def test_two_separate_shells_are_two_pieces_with_the_gap_left_open() -> None:
    two = joined(cuboid(), cuboid(at=(1.0, 0.0, 0.0)))
    shape = shape_of(two)
    assert [len(piece) for piece in shape.pieces] == [8, 8]
    assert shape.solid.volume == pytest.approx(2.0 * VOLUME)
    assert hull_volume(shape.points) == pytest.approx(1.4 * 0.3 * 0.2)  # what one hull would have filled


def test_two_open_shells_weigh_their_own_hulls() -> None:
    shape = shape_of(joined(without_top(cuboid()), without_top(cuboid(at=(1.0, 0.0, 0.0)))))
    assert shape.source is VolumeSource.HULL
    assert shape.solid.volume == pytest.approx(2.0 * VOLUME)
    np.testing.assert_allclose(shape.solid.center, [0.5, 0.0, 0.0], atol=1e-9)
    # Parallel axis: each box 0.5 m off the middle adds 0.25 of its volume about y and z.
    expected = 2.0 * box_inertia(VOLUME, SIZE) + 2.0 * VOLUME * 0.25 * np.diag([0.0, 1.0, 1.0])
    np.testing.assert_allclose(shape.solid.inertia, expected, rtol=1e-7, atol=1e-12)


def test_a_flat_decal_beside_a_solid_is_no_piece() -> None:
    decal = quad(0.1, 0.1)
    decal.apply_translation((0.0, 0.0, 0.5))
    shape = shape_of(joined(without_top(cuboid()), decal))
    assert len(shape.pieces) == 1
    assert shape.solid.volume == pytest.approx(VOLUME)
    assert shape.points[:, 2].max() == pytest.approx(0.5)  # it still belongs to the box of the link


def test_a_mesh_of_very_many_fragments_is_one_part() -> None:
    few = [cuboid(at=(float(i), 0.0, 0.0)) for i in range(MOST_SHELLS)]
    assert len(shape_of(joined(*few)).pieces) == MOST_SHELLS
    assert len(shape_of(joined(*few, cuboid(at=(99.0, 0.0, 0.0)))).pieces) == 1


def test_a_flat_quad_weighs_as_a_thin_slab() -> None:
    shape = shape_of(quad(2.0, 1.0))
    assert shape.flat and shape.source is VolumeSource.BOX
    size = np.array([2.0, 1.0, 2.0 * SLAB_THICKNESS])
    assert shape.solid.volume == pytest.approx(size.prod())
    np.testing.assert_allclose(shape.solid.center, [1.0, 0.5, 0.0], atol=1e-12)
    np.testing.assert_allclose(shape.solid.inertia, box_inertia(float(size.prod()), size), rtol=1e-9, atol=1e-15)
    assert shape.area == pytest.approx(2.0)


@pytest.mark.parametrize("x", [2.0, 1.0])
@pytest.mark.parametrize("angles", [(0.4, 1.0, -0.7), (0.1, 0.05, -0.1), (0.8, 0.4, -0.8)])
def test_a_tilted_quad_is_the_same_slab_turned(x: float, angles: tuple[float, float, float]) -> None:
    matrix = trimesh.transformations.euler_matrix(*angles)
    turned = quad(x, 1.0)
    turned.apply_transform(matrix)
    flat, tilted = shape_of(quad(x, 1.0)).solid, shape_of(turned).solid
    assert tilted.volume == pytest.approx(x**2 * SLAB_THICKNESS, rel=1e-6)
    np.testing.assert_allclose(tilted.inertia, matrix[:3, :3] @ flat.inertia @ matrix[:3, :3].T, atol=1e-12)


def test_a_lone_triangle_has_a_mass_and_an_inertia() -> None:
    shape = shape_of(trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], process=False))
    assert shape.flat and shape.solid.volume > 0.0
    assert np.linalg.eigvalsh(shape.solid.inertia)[0] > 0.0


def test_a_panel_is_no_sheet_but_a_decal_is() -> None:
    assert not shape_of(cuboid(size=(1.0, 1.0, 2e-3))).flat
    assert shape_of(cuboid(size=(1.0, 1.0, 1e-6))).flat


def test_a_hull_faces_outwards_and_drops_what_lies_inside() -> None:
    points = np.vstack([corners((0.0, 0.0, 0.0), (1.0, 2.0, 3.0)), [[0.5, 1.0, 1.5]]])
    hull = hull_of(points)
    assert hull is not None and len(hull.points) == 8
    volume, center, _ = solid_moments(hull.triangles)
    assert volume == pytest.approx(6.0)  # negative if the triangles faced inwards
    np.testing.assert_allclose(center, [0.5, 1.0, 1.5])
    assert len(hull_vertices(points)) == 8 and hull_volume(points) == pytest.approx(6.0)


def test_coplanar_points_have_no_hull() -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0]])
    assert hull_of(points) is None
    assert hull_of(points[:3]) is None and hull_of(np.zeros((0, 3))) is None and hull_of(np.zeros((9, 3))) is None
    assert hull_volume(points) == 0.0
    np.testing.assert_array_equal(hull_vertices(points), points)


def test_the_integral_keeps_its_digits_far_from_the_origin() -> None:
    near = solid_moments(np.asarray(cuboid().triangles))[2]
    far = solid_moments(np.asarray(cuboid(at=(1e4, 1e4, 1e4)).triangles))[2]
    np.testing.assert_allclose(far, near, rtol=1e-6, atol=1e-9)


def test_a_file_with_a_corner_for_every_face_is_merged_into_a_closed_mesh(tmp_path: Path) -> None:
    loose = cuboid()
    loose.unmerge_vertices()
    path = tmp_path / "box.stl"
    loose.export(path)
    mesh = load_mesh(path)
    assert (len(mesh.vertices), len(mesh.faces), mesh.is_watertight) == (8, 12, True)


def test_a_file_without_usable_triangles_is_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "part.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n")
    with pytest.raises(ValueError, match=r"part\.obj: .*holds no triangle"):
        load_mesh(tmp_path / "part.obj")


def test_primitives_have_their_closed_form_volumes() -> None:
    ball = primitive(yourdfpy.Geometry(sphere=yourdfpy.Sphere(0.1)))
    can = primitive(yourdfpy.Geometry(cylinder=yourdfpy.Cylinder(0.1, 0.3)))
    crate = primitive(yourdfpy.Geometry(box=yourdfpy.Box(SIZE)))
    assert ball is not None and can is not None and crate is not None
    assert shape_of(crate).solid.volume == pytest.approx(VOLUME)
    # Inscribed polyhedra: 3 sub-divisions and 32 sides are within 2 %.
    assert shape_of(ball).solid.volume == pytest.approx(4.0 / 3.0 * np.pi * 1e-3, rel=0.02)
    assert shape_of(can).solid.volume == pytest.approx(np.pi * 0.01 * 0.3, rel=0.02)
    assert primitive(yourdfpy.Geometry()) is None


def test_a_mesh_scale_may_be_absent_or_one_number_or_three() -> None:
    scales: list[tuple[object, list[float]]] = [(None, [1, 1, 1]), (0.5, [0.5] * 3), (np.array([1.0, 2, 3]), [1, 2, 3])]
    for given, expected in scales:
        np.testing.assert_array_equal(scale_vector(yourdfpy.Mesh("m.obj", given)), expected)


def test_a_sheet_with_crowded_vertices_is_the_box_around_its_outline() -> None:
    points = np.array([[0.0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [1.9, 0.95, 0], [1.95, 0.9, 0]])
    solid = sheet_as_slab(points)
    assert solid.volume == pytest.approx(2.0 * 1.0 * 2e-3, rel=1e-6)
    np.testing.assert_allclose(solid.center, [1.0, 0.5, 0.0], atol=1e-9)


def test_corners_of_a_hull_and_distinct_faces_are_those_of_scipy_and_numpy() -> None:
    numbers = np.random.default_rng(3)
    points = numbers.normal(size=(60, 3))
    hull = ConvexHull(points)
    np.testing.assert_array_equal(used_points(points, hull.simplices), points[hull.vertices])
    for most in (9, 1 << 22):  # keys of one number, and rows where that would overflow
        faces = numbers.integers(0, most, size=(200, 3))
        faces = np.vstack([faces, faces[:50, [2, 0, 1]], faces[:7]])
        known = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)[1]
        np.testing.assert_array_equal(distinct_faces(faces), known)
