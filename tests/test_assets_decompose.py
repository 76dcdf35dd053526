"""Convex decomposition keeps hollows empty, stays within the hull, repeats itself, and ends when it is told to."""

import subprocess

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from asset2sim.assets.meshes.decompose import DecomposeSettings, decompose, surface_of
from asset2sim.assets.meshes.decompose_pieces import clip, merge
from asset2sim.assets.meshes.load import load_mesh
from asset2sim.physics.arrays import Array
from tests.marks import OBJECTS, needs_objects

pytestmark = pytest.mark.system

SETTINGS = DecomposeSettings(cpu_limit_s=60.0)


def channel() -> trimesh.Trimesh:
    """A closed U along x: 1 m long, 0.4 m wide, 0.2 m high, walls of 0.02 m."""
    section = [(-0.2, 0.0), (0.2, 0.0), (0.2, 0.2), (0.18, 0.2), (0.18, 0.02), (-0.18, 0.02), (-0.18, 0.2), (-0.2, 0.2)]
    low, high = (np.array([(x, y, z) for y, z in section]) for x in (-0.5, 0.5))
    cap = np.array([(0, 1, 4), (0, 4, 5), (1, 2, 3), (1, 3, 4), (0, 5, 6), (0, 6, 7)])
    sides = [(i, (i + 1) % 8, i + 8) for i in range(8)] + [((i + 1) % 8, (i + 1) % 8 + 8, i + 8) for i in range(8)]
    return trimesh.Trimesh(np.vstack([low, high]), np.vstack([cap, cap[:, ::-1] + 8, sides]), process=False)


def double_sided(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, np.vstack([mesh.faces, mesh.faces[:, ::-1]]), process=False)


def open_bin() -> trimesh.Trimesh:
    """A bin of 1 x 0.7 x 0.5 m without a lid, of double-sided sheets without thickness."""
    box = trimesh.creation.box(extents=(1.0, 0.7, 0.5))
    return double_sided(trimesh.Trimesh(box.vertices, box.faces[box.face_normals[:, 2] < 0.5], process=False))


def depth(points: Array, pieces: tuple[Array, ...]) -> Array:
    """How far each (n, 3) point lies within the piece that holds it deepest, m; negative outside all."""
    planes = [ConvexHull(piece).equations for piece in pieces]
    deepest: Array = np.max([-(points @ p[:, :3].T + p[:, 3]).max(axis=1) for p in planes], axis=0)
    return deepest


def grid(size: tuple[float, float, float], centre: tuple[float, float, float]) -> Array:
    axes = [np.linspace(-s / 2, s / 2, 9) + c for s, c in zip(size, centre, strict=True)]
    return np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3)


def check_within_hull(mesh: trimesh.Trimesh, pieces: tuple[Array, ...], most: int) -> None:
    hull = ConvexHull(mesh.vertices)
    over = np.vstack(pieces) @ hull.equations[:, :3].T + hull.equations[:, 3]
    assert over.max() < 1e-5 * float(np.ptp(mesh.vertices))
    assert len(pieces) <= most
    assert sum(ConvexHull(piece).volume for piece in pieces) <= 1.02 * hull.volume


def run(mesh: trimesh.Trimesh, settings: DecomposeSettings = SETTINGS) -> tuple[Array, ...] | None:
    return decompose(np.asarray(mesh.vertices), np.asarray(mesh.faces), settings)


@pytest.mark.parametrize("drawn", [channel, lambda: double_sided(channel())], ids=["closed", "double-sided"])
def test_a_box_laid_in_a_channel_touches_no_piece(drawn) -> None:  # type: ignore[no-untyped-def]
    mesh = drawn()
    pieces = run(mesh)
    assert pieces is not None
    check_within_hull(mesh, pieces, 4)
    assert depth(grid((1.0, 0.356, 0.176), (0.0, 0.0, 0.11)), pieces).max() < 0.0
    # The walls are solid where they were: 0.02 thick, and cut exactly.
    assert depth(np.array([(0.0, 0.19, 0.1), (0.0, -0.19, 0.1), (0.0, 0.0, 0.01)]), pieces).min() > 0.005
    solid = 1.0 * (0.4 * 0.02 + 2 * 0.18 * 0.02)
    assert sum(ConvexHull(piece).volume for piece in pieces) == pytest.approx(solid, rel=0.02)


def test_a_ring_stays_open() -> None:
    mesh = trimesh.creation.annulus(r_min=0.04, r_max=0.05, height=0.03, sections=24)
    pieces = run(mesh)
    assert pieces is not None
    check_within_hull(mesh, pieces, SETTINGS.max_hulls)
    angle = np.linspace(0.0, 2 * np.pi, 48, endpoint=False)
    neck = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(48)])
    assert depth(0.034 * neck, pieces).max() < 0.0
    assert depth(0.045 * neck, pieces).min() > -1e-5  # some lie on the cut between two pieces


def test_an_open_bin_of_sheets_is_walls_and_no_block() -> None:
    mesh = open_bin()
    pieces = run(mesh)
    assert pieces is not None
    check_within_hull(mesh, pieces, SETTINGS.max_hulls)
    assert depth(grid((0.97, 0.67, 0.48), (0.0, 0.0, 0.015)), pieces).max() < 0.0
    assert depth(np.array([(0.499, 0.0, 0.0), (0.0, -0.349, 0.0), (0.0, 0.0, -0.249)]), pieces).min() > 0.0


def test_what_is_no_surface_goes_to_voxels_and_stays_hollow() -> None:
    """Sheets that meet three to an edge have no inside: the bin with a partition."""
    box = trimesh.creation.box(extents=(1.0, 0.7, 0.5))
    vertices = np.vstack([box.vertices, [(0, -0.35, -0.25), (0, 0.35, -0.25), (0, 0.35, 0.25), (0, -0.35, 0.25)]])
    walls = box.faces[box.face_normals[:, 2] < 0.5]
    corner = (walls[0][0], walls[0][1], 10)
    faces = np.vstack([walls, [(8, 9, 10), (8, 10, 11), corner]])
    mesh = double_sided(trimesh.Trimesh(vertices, faces, process=False))
    assert surface_of(np.asarray(mesh.vertices), np.asarray(mesh.faces), 0.004) is None
    pieces = run(mesh)
    assert pieces is not None
    check_within_hull(mesh, pieces, SETTINGS.max_hulls)
    assert depth(np.array([(-0.25, 0.2, 0.1)]), pieces).max() < 0.0


def test_a_convex_mesh_is_one_piece_and_a_flat_one_none(monkeypatch: pytest.MonkeyPatch) -> None:
    pieces = run(double_sided(trimesh.creation.box(extents=(0.3, 0.2, 0.1))))
    assert pieces is not None and len(pieces) == 1
    assert ConvexHull(pieces[0]).volume == pytest.approx(0.006)
    none = "asset2sim.assets.meshes.decompose._attempt"
    monkeypatch.setattr(none, lambda *args: pytest.fail("a flat mesh needs no process"))
    assert run(trimesh.creation.box(extents=(0.3, 0.2, 1e-5))) is None
    assert decompose(np.eye(3), np.array([[0, 1, 2]]), SETTINGS) is None


def test_the_same_mesh_gives_the_same_pieces() -> None:
    mesh = trimesh.creation.annulus(r_min=0.03, r_max=0.05, height=0.04, sections=12)
    for settings in (SETTINGS, SETTINGS.model_copy(update={"max_faces": 0})):  # CoACD, then V-HACD
        first, second = run(mesh, settings), run(mesh, settings)
        assert first is not None and second is not None and len(first) == len(second) > 1
        assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))


def test_the_time_limit_holds_and_leaves_no_process() -> None:
    ball = trimesh.creation.icosphere(subdivisions=3)
    rough = trimesh.Trimesh(ball.vertices * (1 + 0.4 * np.sin(9 * ball.vertices[:, :1])), ball.faces)
    assert run(rough, DecomposeSettings(cpu_limit_s=1.0, wall_limit_s=0.3)) is None
    listed = subprocess.run(["ps", "-eo", "args"], capture_output=True, text=True, check=True).stdout
    assert not [line for line in listed.splitlines() if "decompose_worker" in line and '"wall_limit_s":0.3' in line]


def test_clipping_cuts_off_what_sticks_out() -> None:
    hull = ConvexHull(trimesh.creation.box(extents=(2.0, 2.0, 2.0)).vertices)
    piece = trimesh.creation.box(extents=(2.0, 1.0, 1.0)).apply_translation((1.0, 0.0, 0.0))
    cut = clip(np.asarray(piece.vertices), hull)
    assert cut is not None and ConvexHull(cut).volume == pytest.approx(1.0)
    assert clip(np.asarray(trimesh.creation.box().vertices) + 5.0, hull) is None


def test_merging_joins_the_pieces_that_fill_least() -> None:
    boxes = [np.asarray(trimesh.creation.box().vertices) + offset for offset in ((0, 0, 0), (1, 0, 0), (9, 0, 0))]
    merged = merge(boxes, 2)
    assert sorted(round(ConvexHull(piece).volume, 6) for piece in merged) == [1.0, 2.0]


@needs_objects
@pytest.mark.parametrize("name", ["original-3", "original-4", "original-7"])
def test_double_sided_thin_parts_are_not_fattened(name: str) -> None:
    mesh = load_mesh(OBJECTS / "Stapler" / "103275" / "textured_objs" / f"{name}.obj")
    pieces = run(mesh)
    assert pieces is not None
    check_within_hull(mesh, pieces, SETTINGS.max_hulls)
