"""What a wall along a mesh's faces weighs and where: drawn once, drawn twice, open, flat, or as a wire."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from asset2sim.assets.meshes.volume import SheetSurface, joined_surfaces, surface_of
from asset2sim.intake.origin import extract
from schemas.asset import AssetRef
from schemas.features import LinkFeatures
from tests.builders import double_sided, without_top

A, B, C = 0.4, 0.3, 0.2
AREA = 2.0 * (A * B + B * C + A * C)


def box(extents: tuple[float, float, float] = (A, B, C)) -> trimesh.Trimesh:
    made: trimesh.Trimesh = trimesh.creation.box(extents=extents)
    return made


def surface(mesh: trimesh.Trimesh) -> SheetSurface:
    return surface_of(np.asarray(mesh.vertices), np.asarray(mesh.faces))


def shell_moments(a: float, b: float, c: float) -> list[float]:
    """Closed form: second moments of the six plates of a box about its middle, per unit of area."""
    edges, found = (a, b, c), [0.0, 0.0, 0.0]
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        x, y, z = edges[i], edges[j], edges[k]
        pair = 2.0 * x * y / (2.0 * (a * b + b * c + a * c))
        found[i] += pair * (y * y / 12.0 + z * z / 4.0)
        found[j] += pair * (x * x / 12.0 + z * z / 4.0)
        found[k] += pair * (x * x + y * y) / 12.0
    return found


def test_a_closed_box_has_its_six_plates_and_no_opening() -> None:
    found = surface(box())
    assert found.area == pytest.approx(AREA) and found.opening == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(np.diag(found.inertia) / found.area, shell_moments(A, B, C), rtol=1e-9)
    np.testing.assert_allclose(found.center, np.zeros(3), atol=1e-12)


def test_a_face_drawn_for_either_side_counts_once() -> None:
    once, twice = surface(without_top(box())), surface(double_sided(without_top(box())))
    assert twice.area == pytest.approx(once.area) and once.area < AREA
    np.testing.assert_allclose(twice.inertia, once.inertia, rtol=1e-9)


def test_an_open_box_is_heavier_below_and_open_by_its_lid() -> None:
    found = surface(without_top(box()))
    assert found.area + found.opening == pytest.approx(AREA)
    assert found.center[2] == pytest.approx(-(A * B) * C / 2.0 / found.area)


def test_surfaces_join_by_the_parallel_axis_theorem() -> None:
    left, right = box(), box()
    right.apply_translation((1.0, 0.0, 0.0))
    whole = joined_surfaces([surface(left), surface(right)])
    both: trimesh.Trimesh = trimesh.util.concatenate([left, right])  # type: ignore[assignment]
    np.testing.assert_allclose(whole.inertia, surface(both).inertia, rtol=1e-9, atol=1e-12)
    turned = surface(left).moved(np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), np.ones(3))
    np.testing.assert_allclose(np.diag(turned.inertia), np.diag(surface(left).inertia)[[1, 0, 2]], rtol=1e-9)


def read_mesh(folder: Path, mesh: trimesh.Trimesh) -> LinkFeatures:
    folder.mkdir()
    mesh.export(folder / "part.obj")
    visual = '<visual><geometry><mesh filename="part.obj"/></geometry></visual>'
    (folder / "r.urdf").write_text(f'<robot name="r"><link name="a">{visual}</link></robot>')
    return extract(AssetRef(asset_id="r", path=str(folder))).features.links[0]


def test_the_outer_area_is_the_same_however_often_walls_are_drawn(tmp_path: Path) -> None:
    """A bin drawn with one wall, with both sides of it, and with an inner wall beside."""
    bin_, inner = without_top(box()), without_top(box((0.96 * A, 0.96 * B, 0.98 * C)))
    both: trimesh.Trimesh = trimesh.util.concatenate([double_sided(bin_), double_sided(inner)])  # type: ignore[assignment]
    drawn = (bin_, double_sided(bin_), both)
    found = [read_mesh(tmp_path / str(index), mesh).outer_m2 for index, mesh in enumerate(drawn)]
    np.testing.assert_allclose(found, AREA, rtol=1e-6)


def test_a_plate_shows_both_sides_and_a_frame_less_than_its_hull(tmp_path: Path) -> None:
    plate = trimesh.Trimesh(
        np.array([[0.0, 0.0, 0.0], [A, 0.0, 0.0], [A, B, 0.0], [0.0, B, 0.0]]), [[0, 1, 2], [0, 2, 3]], process=False
    )
    assert read_mesh(tmp_path / "plate", plate).outer_m2 == pytest.approx(2.0 * A * B)
    ring = trimesh.creation.annulus(r_min=0.15, r_max=0.155, height=0.005)
    assert read_mesh(tmp_path / "ring", ring).outer_m2 == pytest.approx(float(ring.area), rel=1e-6)
