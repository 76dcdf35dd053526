"""What a ball from outside gets to stays empty, every face stays covered, and the same mesh gives the same pieces."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from asset2sim.assets.meshes.hollow import ALLOWED_DEPTH, Hollow, hollow_of, samples
from asset2sim.assets.meshes.patches import (
    MOST_CORNERS,
    MOST_GROUPS,
    PatchPiece,
    hulls_of_groups,
    join_pieces,
    least_added,
    piece_of,
    piece_of_few_corners,
    pieces_around_hollow,
)
from asset2sim.physics.arrays import Array

RADIUS, THICKNESS = 0.02, 0.002


def one(meshes: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    """Several meshes as one."""
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = np.vstack([mesh.faces + start for mesh, start in zip(meshes, starts[:-1], strict=True)])
    return trimesh.Trimesh(np.vstack([mesh.vertices for mesh in meshes]), faces, process=False)


def boxes(*items: tuple[tuple[float, float, float], tuple[float, float, float]]) -> trimesh.Trimesh:
    """Closed boxes, each of a size and a centre, as one mesh."""
    made = [trimesh.creation.box(extents=size).apply_translation(at) for size, at in items]
    return one(made)


def bin_of_sheets() -> trimesh.Trimesh:
    """A bin of 0.4 x 0.3 x 0.3 m without a lid, of double-sided sheets without a thickness."""
    box = trimesh.creation.box(extents=(0.4, 0.3, 0.3))
    faces = box.faces[box.face_normals[:, 2] < 0.5]
    return trimesh.Trimesh(box.vertices, np.vstack([faces, faces[:, ::-1]]), process=False)


def pail() -> trimesh.Trimesh:
    """A round pail with a bottom: a ring of 0.3 m and a disc, 5 mm thick, of many faces."""
    ring = trimesh.creation.annulus(r_min=0.145, r_max=0.15, height=0.3, sections=48)
    disc = trimesh.creation.cylinder(radius=0.15, height=0.005, sections=48).apply_translation((0, 0, -0.1475))
    return one([ring, disc])


def hollow(mesh: trimesh.Trimesh) -> Hollow:
    return hollow_of(np.asarray(mesh.triangles), RADIUS)


def pieces_of(mesh: trimesh.Trimesh, within: Hollow | None = None) -> list[PatchPiece]:
    return pieces_around_hollow(np.asarray(mesh.vertices), np.asarray(mesh.faces), within or hollow(mesh), THICKNESS)


def depth(points: Array, pieces: list[PatchPiece]) -> Array:
    """How far each (n, 3) point lies within the piece that holds it deepest, m; negative outside all."""
    planes = [ConvexHull(piece.points).equations for piece in pieces]
    deepest: Array = np.max([-(points @ p[:, :3].T + p[:, 3]).max(axis=1) for p in planes], axis=0)
    return deepest


def test_a_ball_gets_into_a_bin_and_not_into_a_closed_box() -> None:
    opened, closed = bin_of_sheets(), boxes(((0.4, 0.3, 0.3), (0, 0, 0)))
    whole = np.asarray(opened.vertices)
    # The ball sweeps all but what its roundness leaves in the edges, and a cell along the walls.
    assert hollow(opened).filled_m3(whole) == pytest.approx(0.4 * 0.3 * 0.3, rel=0.3)
    assert hollow(closed).filled_m3(whole) == 0.0


def money_box() -> trimesh.Trimesh:
    """A box of 0.4 x 0.3 x 0.2 m, walls 1 cm thick, with a slot of 2 cm along each of two sides."""
    return boxes(
        *(((0.4, 0.3, 0.01), (0, 0, z)) for z in (-0.1, 0.1)),
        *(((0.01, 0.3, 0.2), (x, 0, 0)) for x in (-0.2, 0.2)),
        *(((0.4, 0.01, 0.09), (0, y, z)) for y in (-0.15, 0.15) for z in (-0.055, 0.055)),
    )


def test_a_hole_smaller_than_the_ball_lets_nothing_in() -> None:
    slotted = money_box()
    assert hollow(slotted).filled_m3(np.asarray(slotted.vertices)) == 0.0
    assert hollow_of(np.asarray(slotted.triangles), 0.006).filled_m3(np.asarray(slotted.vertices)) > 0.01


@pytest.mark.parametrize("drawn", [bin_of_sheets, pail])
def test_the_hollow_stays_empty_and_every_face_is_covered(drawn) -> None:  # type: ignore[no-untyped-def]
    mesh = drawn()
    pieces = pieces_of(mesh)
    assert 1 < len(pieces) <= 16
    inner = np.ptp(mesh.vertices, axis=0) / 2.0 - 0.035
    if drawn is pail:
        inner[:2] /= np.sqrt(2.0)
    grid = np.stack(np.meshgrid(*(np.linspace(-s, s, 9) for s in inner)), axis=-1).reshape(-1, 3)
    assert depth(grid, pieces).max() < 0.0
    assert sum(hollow(mesh).filled_m3(piece.points) for piece in pieces) < 0.1 * hollow(mesh).filled_m3(mesh.vertices)
    # Cut pieces keep so many corners of a curve that no face stands out by more than 2 % of its radius.
    assert depth(samples(np.asarray(mesh.triangles), 0.01), pieces).min() > -0.02 * 0.15
    assert max(len(piece.points) for piece in pieces) <= MOST_CORNERS


def test_what_no_ball_gets_to_is_joined() -> None:
    """A solid L keeps two arms, both filled."""
    arms = boxes(((0.4, 0.1, 0.1), (0, 0, 0)), ((0.1, 0.1, 0.4), (-0.15, 0, 0.25)))
    pieces = pieces_of(arms)
    assert len(pieces) == 2
    assert depth(np.array([(0.1, 0.0, 0.0), (-0.15, 0.0, 0.3)]), pieces).min() > 0.03
    assert depth(np.array([(0.1, 0.0, 0.2)]), pieces).max() < 0.0


def test_others_keep_a_hollow_clear_that_no_ball_gets_to() -> None:
    slotted = money_box()
    alone = hollow(slotted)
    tray = trimesh.creation.box(extents=(0.3, 0.2, 0.002))
    inside = np.array([(0.1, 0.05, 0.0), (-0.1, 0.0, 0.0)])
    assert depth(inside, pieces_of(slotted, alone)).min() > 0.0
    kept = alone.with_reachable(samples(np.asarray(tray.triangles), 0.01))
    assert depth(inside, pieces_of(slotted, kept)).max() < 0.0
    # What stands in a closed solid stays there: nothing is cut for it.
    solid = hollow(boxes(((0.3, 0.2, 0.2), (0, 0, 0))))
    assert solid.with_reachable(samples(np.asarray(tray.triangles), 0.01)) is solid


@pytest.mark.parametrize("spacing", [0.3, 1.0])
def test_only_samples_that_cannot_matter_are_left_out(spacing: float) -> None:
    """What is looked up for many hulls at once is what all of their samples show."""
    random = np.random.default_rng(7)
    for grid in (hollow(bin_of_sheets()), hollow(pail()), hollow(money_box())):
        low, high = grid.low, grid.low + grid.cell_m * np.array(grid.depth.shape)
        hulls = [piece_of(random.uniform(low, high, (count, 3)), THICKNESS) for count in (2, 4, 9, 40, 4)]
        for hull in hulls:
            points = samples(hull.triangles, spacing * grid.cell_m)
            index = np.unique(grid.cells(points), axis=0)
            open_ = grid.depth[tuple(index.T)] > ALLOWED_DEPTH
            cells, of = grid.open_cells(hull.triangles, spacing * grid.cell_m)
            assert np.array_equal(np.unique(cells), np.ravel_multi_index(tuple(index[open_].T), grid.depth.shape))
            assert len(cells) == len(of) and (not len(of) or of.max() < len(hull.triangles))
        deepest = [grid.at(samples(hull.triangles, grid.cell_m)) for hull in hulls]
        expected = [depth if depth > ALLOWED_DEPTH else 0.0 for depth in deepest]
        assert grid.deepest_each([(hull.points, hull.triangles) for hull in hulls]) == expected


def test_the_same_mesh_gives_the_same_pieces() -> None:
    first, second = pieces_of(pail()), pieces_of(pail())
    assert len(first) == len(second)
    assert all(np.array_equal(a.points, b.points) for a, b in zip(first, second, strict=True))


def test_groups_are_bounded() -> None:
    """A heap of 600 loose sticks: no more groups than allowed, each face still in one."""
    random = np.random.default_rng(1)
    sticks = boxes(*(((0.3, 0.004, 0.004), tuple(random.uniform(-0.5, 0.5, 3))) for _ in range(600)))
    groups = hulls_of_groups(np.asarray(sticks.vertices), np.asarray(sticks.faces), hollow(sticks), THICKNESS)
    assert len(groups) <= MOST_GROUPS
    assert depth(np.asarray(sticks.vertices), groups).min() > -0.005


def test_joining_stops_at_a_share_of_volume_and_goes_on_over_the_budget() -> None:
    row = [
        piece_of(np.asarray(trimesh.creation.box().vertices) + np.array([x, 0, 0]), 0.0) for x in (0.0, 1.0, 1.5, 9.0)
    ]
    joined = join_pieces(row, None, 0.0, added_share=0.1)
    assert sorted(round(piece.volume, 6) for piece in joined) == [1.0, 2.5]
    (one,) = join_pieces(row, None, 0.0, added_share=0.1, most=1)
    assert one.volume == pytest.approx(10.0)


def test_the_wires_of_a_basket_become_its_walls_and_leave_it_open() -> None:
    """Some 80 wires, 25 mm apart, are more than the budget: what two of them span in a wall is filled first."""
    x, y, z = 0.2, 0.15, 0.12
    corners = [(side * x, along) for side in (-1, 1) for along in np.linspace(-y, y, 13)]
    corners += [(along, side * y) for side in (-1, 1) for along in np.linspace(-x, x, 17)]
    ends = [((u, v, 0.0), (u, v, z)) for u, v in corners]
    ends += [((-x, v, 0.0), (x, v, 0.0)) for v in np.linspace(-y, y, 13)]
    ends += [((u, -y, 0.0), (u, y, 0.0)) for u in np.linspace(-x, x, 17)]
    wires = [trimesh.creation.cylinder(radius=0.002, segment=pair, sections=6) for pair in ends]
    open_above = hollow(one(wires))
    pieces = join_pieces(
        [piece_of(np.asarray(wire.vertices), THICKNESS) for wire in wires],
        open_above,
        THICKNESS,
        most=24,
        added_share=0.1,
    )
    assert len(pieces) <= 24
    assert depth(samples(np.asarray(one(wires).triangles), 0.01), pieces).min() > -0.001
    assert sum(open_above.filled_m3(piece.points) for piece in pieces) < 0.02 * 2 * x * 2 * y * z


@pytest.mark.parametrize("points", [np.eye(3), np.eye(3)[:2], np.array([(0.0, 0, 0), (1, 0, 0), (2, 0, 0)])],
                         ids=["triangle", "edge", "line"])  # fmt: skip
def test_what_is_flat_is_made_thick(points: Array) -> None:
    piece = piece_of(points, 0.01)
    assert piece.volume > 0.0
    assert depth(points, [piece]).min() > -1e-9
    assert np.ptp(piece.points, axis=0).max() <= np.ptp(points, axis=0).max() + 0.02


def test_what_joining_adds_is_never_less_than_its_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(3)
    for number in range(400):
        flat = np.array([1.0, 1.0, rng.choice([0.0, 1e-3, 1.0])])
        away = rng.normal(size=3) * rng.choice([0.0, 0.5, 2.0]) * (flat if number % 2 else 1.0)
        a, b = (piece_of(rng.normal(size=(rng.integers(4, 60), 3)) * flat * 0.1 + at, 0.01) for at in (0.0, away))
        added = piece_of_few_corners(np.vstack([a.points, b.points]), 0.01).volume - a.volume - b.volume
        assert least_added(a, b, 0.01) <= added
    monkeypatch.setattr("asset2sim.assets.meshes.patches._joined", None)  # no hull is made that is never joined
    corner = [
        piece_of(np.asarray(boxes((size, (0.0, 0.0, 0.0))).vertices), 0.01) for size in ((1, 1, 0.1), (0.1, 1, 2))
    ]
    assert join_pieces(corner, None, 0.01, most=2, added_share=0.1) == corner
