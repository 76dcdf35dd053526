"""Collision geometry by mode: what is hollow stays hollow, sheets are walls or looks, budgets hold, and it repeats."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from asset2sim.assets.hulls import Hulls, collision_hulls
from asset2sim.refinement.collision import shapes as module
from asset2sim.refinement.collision.shapes import collision_shapes, piece_limit
from schemas.asset import AssetRef
from schemas.settings import CollisionSettings
from schemas.vocabulary import CollisionMode, Severity
from tests.assets import box_obj, joint, link, mesh, read, robot, written
from tests.marks import OBJECTS, needs_objects

SETTINGS = CollisionSettings()
OPEN_BOX = (
    (1, 4, 3), (1, 3, 2), (1, 2, 6), (1, 6, 5), (4, 8, 7), (4, 7, 3), (1, 5, 8), (1, 8, 4), (2, 3, 7), (2, 7, 6),
)  # fmt: skip


def tub(low: float, high: float, height: float) -> str:
    """The OBJ text of a square tub of sheets without a lid."""
    corners = [(low, low, 0.0), (low, high, 0.0), (high, high, 0.0), (high, low, 0.0)]
    corners += [(x, y, height) for x, y, _ in corners]
    return "\n".join([f"v {x} {y} {z}" for x, y, z in corners] + [f"f {a} {b} {c}" for a, b, c in OPEN_BOX]) + "\n"


def sheet(x: float, low: float, high: float) -> str:
    """The OBJ text of an upright rectangle at x."""
    return f"v {x} {low} 0\nv {x} {high} 0\nv {x} {high} 0.3\nv {x} {low} 0.3\nf 1 2 3\nf 1 3 4\n"


def case(folder: Path) -> Path:
    """A tub with a block that slides along x in it, and a lid that is a plain board with a picture on it."""
    urdf = robot(
        link("base"),
        link("body", mesh("tub.obj")),
        link("block", mesh("block.obj")),
        link("lid", mesh("lid.obj") + mesh("picture.obj")),
        joint("fix", "fixed", "base", "body"),
        joint("slide", "prismatic", "body", "block", axis="1 0 0", limit="0 0.1"),
        joint("hinge", "revolute", "body", "lid", xyz="0 0 0.31", axis="1 0 0", limit="0 1"),
    )
    files = {
        "tub.obj": tub(0.0, 0.4, 0.3),
        "block.obj": box_obj((0.1, 0.1, 0.05), (0.2, 0.2, 0.15)),
        "lid.obj": box_obj((0.0, 0.0, 0.0), (0.4, 0.4, 0.01)),
        "picture.obj": "v 0.1 0.1 0.0101\nv 0.3 0.1 0.0101\nv 0.3 0.3 0.0101\nv 0.1 0.3 0.0101\nf 1 2 3\nf 1 3 4\n",
    }
    return written(folder, urdf, files)


def inside(hulls: Hulls, link_name: str, point: tuple[float, float, float]) -> bool:
    """Whether a point lies in one of a link's pieces."""
    planes = [ConvexHull(piece).equations for piece in hulls[link_name]]
    return any((p[:, :3] @ point + p[:, 3]).max() <= 0.0 for p in planes)


def test_the_modes_keep_repair_and_decompose(tmp_path: Path) -> None:
    item = read(case(tmp_path / "case"))
    assert collision_shapes(item, 1.0, CollisionSettings(mode=CollisionMode.KEEP)) == ({}, ())
    repaired, notes = collision_shapes(item, 1.0, CollisionSettings(mode=CollisionMode.REPAIR))
    assert {name: len(pieces) for name, pieces in repaired.items()} == {"base": 0, "body": 1, "block": 1, "lid": 1}
    assert [(note.code, note.link) for note in notes] == [("sheet_dropped", "lid")]
    hulls, notes = collision_shapes(item, 1.0, SETTINGS)
    assert {name: len(pieces) for name, pieces in hulls.items()} == {"base": 0, "body": 5, "block": 1, "lid": 1}
    assert [(note.code, note.link) for note in notes] == [("collision_decomposed", "body"), ("sheet_dropped", "lid")]
    assert inside(repaired, "body", (0.15, 0.15, 0.1)) and not inside(hulls, "body", (0.15, 0.15, 0.1))
    assert inside(hulls, "body", (0.2, 0.2, 0.0))


def test_pieces_are_at_the_final_scale_and_sheets_as_thick_at_any(tmp_path: Path) -> None:
    item = read(case(tmp_path / "case"))
    full, _ = collision_shapes(item, 1.0, SETTINGS)
    double, _ = collision_shapes(item, 2.0, SETTINGS)
    assert np.ptp(np.vstack(full["body"]), axis=0) == pytest.approx([0.4016, 0.4016, 0.3008], abs=1e-3)
    assert np.ptp(np.vstack(double["body"]), axis=0) == pytest.approx([0.802, 0.802, 0.601], abs=1e-6)
    thin = sorted(float(np.ptp(piece, axis=0).min()) for piece in double["body"])
    assert thin == pytest.approx([SETTINGS.sheet_thickness_m] * 5)


def test_a_sheet_that_spans_a_gap_is_a_wall(tmp_path: Path) -> None:
    """A frame of two posts with a pane between them: the pane stops a ball, the sticker on a post is a looks."""
    posts = [box_obj((0.0, y, 0.0), (0.05, y + 0.05, 0.3)) for y in (0.0, 0.35)]
    urdf = robot(link("frame", "".join(mesh(f"{name}.obj") for name in ("left", "right", "pane", "sticker"))))
    files = {
        "left.obj": posts[0],
        "right.obj": posts[1],
        "pane.obj": sheet(0.025, 0.05, 0.35),
        "sticker.obj": sheet(0.0501, 0.0, 0.05),
    }
    hulls, notes = collision_shapes(read(written(tmp_path / "frame", urdf, files)), 1.0, SETTINGS)
    assert inside(hulls, "frame", (0.025, 0.2, 0.15))
    assert len(hulls["frame"]) == 3
    assert {note.code for note in notes} == {"sheet_dropped", "sheet_thickened"}


def test_a_thin_frame_stays_open(tmp_path: Path) -> None:
    """A ring of 4 mm wire around 0.3 m, as a bail or a door frame is: thinner than the hollow's cells."""
    ring = trimesh.creation.annulus(r_min=0.146, r_max=0.15, height=0.004, sections=24)
    urdf = robot(link("ring", mesh("ring.obj")))
    item = read(written(tmp_path / "ring", urdf, {"ring.obj": ring.export(file_type="obj")}))
    hulls, _ = collision_shapes(item, 1.0, SETTINGS)
    assert inside(collision_hulls(item, 1.0), "ring", (0.1, 0.0, 0.0))
    assert not inside(hulls, "ring", (0.1, 0.0, 0.0)) and not inside(hulls, "ring", (0.0, 0.0, 0.0))
    assert 4 <= len(hulls["ring"]) <= 12


def test_the_cache_answers_alike_and_knows_what_it_depends_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    item, cache = read(case(tmp_path / "case")), tmp_path / "cache"
    first = collision_shapes(item, 1.0, SETTINGS, cache)
    assert len(list(cache.iterdir())) == 1
    with monkeypatch.context() as patch:
        patch.setattr(module, "decomposed", lambda *args: pytest.fail("the cache should have answered"))
        second = collision_shapes(item, 1.0, SETTINGS, cache)
    assert first[1] == second[1] and list(first[0]) == list(second[0])
    for name, pieces in first[0].items():
        assert all(np.array_equal(a, b) for a, b in zip(pieces, second[0][name], strict=True))
    collision_shapes(item, 1.1, SETTINGS, cache)
    collision_shapes(item, 1.0, CollisionSettings(hollow_m=0.03), cache)
    (tmp_path / "case" / "block.obj").write_text(box_obj((0.1, 0.1, 0.05), (0.2, 0.2, 0.16)))
    collision_shapes(read(tmp_path / "case"), 1.0, SETTINGS, cache)
    assert len(list(cache.iterdir())) == 4


def test_a_damaged_cache_file_is_made_again(tmp_path: Path) -> None:
    item, cache = read(case(tmp_path / "case")), tmp_path / "cache"
    first, _ = collision_shapes(item, 1.0, SETTINGS, cache)
    (file,) = cache.iterdir()
    file.write_bytes(file.read_bytes()[:80])
    again, _ = collision_shapes(item, 1.0, SETTINGS, cache)
    assert all(np.array_equal(a, b) for a, b in zip(first["body"], again["body"], strict=True))
    assert file.stat().st_size > 80


def test_budgets_hold_and_what_they_cost_is_said(tmp_path: Path) -> None:
    item = read(case(tmp_path / "case"))
    hulls, notes = collision_shapes(item, 1.0, CollisionSettings(max_link_hulls=2))
    assert len(hulls["body"]) <= 2
    (fallback,) = [note for note in notes if note.code == "collision_fallback"]
    assert fallback.link == "body" and fallback.severity is Severity.WARNING
    assert fallback.value is not None and fallback.limit is not None and fallback.value > fallback.limit
    hulls, _ = collision_shapes(item, 1.0, CollisionSettings(max_asset_hulls=4))
    assert sum(len(pieces) for pieces in hulls.values()) <= 4


def test_the_cap_leaves_every_link_a_piece() -> None:
    assert piece_limit([40, 2, 1], 43) == 40
    assert piece_limit([40, 30, 1], 41) == 20
    assert piece_limit([5, 5, 5], 1) == 1
    assert piece_limit([], 5) == 1


@needs_objects
@pytest.mark.parametrize(
    ("path", "scale", "body"), [("TrashCan/102181", 0.2, "link_2"), ("Microwave/7221", 0.3, "link_1")]
)
def test_real_bodies_are_hollow_within_few_pieces(path: str, scale: float, body: str) -> None:
    ref = AssetRef(asset_id="real", path=str(OBJECTS / path))
    item = read(Path(ref.path))
    plain, (hulls, notes) = collision_hulls(item, scale), collision_shapes(item, scale, SETTINGS)
    volume = [sum(float(trimesh.convex.convex_hull(piece).volume) for piece in which[body]) for which in (plain, hulls)]
    assert volume[1] < 0.7 * volume[0]
    assert len(hulls[body]) <= 24
    assert not [note for note in notes if note.code == "collision_fallback"]


def test_convex_pieces_that_stand_over_a_floor_are_cut_at_it_where_no_piece_is_hollow(tmp_path: Path) -> None:
    """An oven whose file states a board and two walls, the board 6 mm thicker than the floor that is seen."""
    board, walls = (-0.2, -0.15, -0.02), [((x, -0.15, 0.0), (x + 0.01, 0.15, 0.2)) for x in (-0.2, 0.19)]
    files = {
        "floor.obj": box_obj(board, (0.2, 0.15, 0.0)), "thick.obj": box_obj(board, (0.2, 0.15, 0.006)),
        **{f"wall{number}.obj": box_obj(*corners) for number, corners in enumerate(walls)},
    }  # fmt: skip
    shown = mesh("floor.obj", "visual") + mesh("thick.obj", "collision") + mesh("wall0.obj") + mesh("wall1.obj")
    hulls, _ = collision_shapes(read(written(tmp_path, robot(link("body", shown)), files)), 1.0, SETTINGS)
    tops = sorted(float(piece[:, 2].max()) for piece in hulls["body"])
    assert tops == pytest.approx([0.0, 0.2, 0.2], abs=1e-6)
