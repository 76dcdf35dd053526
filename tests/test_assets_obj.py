"""OBJs, with and without their looks, are read as trimesh reads them, and what is not read so is left to it."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from asset2sim.assets.meshes.load import load_mesh
from asset2sim.assets.meshes.obj_file import read_obj
from asset2sim.assets.surfaces import load
from asset2sim.assets.surfaces.load import load_surfaces
from asset2sim.assets.surfaces.surface import Surface
from tests.assets import RAW

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


@pytest.mark.parametrize(
    "text",
    [
        SQUARE + "f 1 2 3\nf 1 3 4\n",
        SQUARE + "f 1 2 3 4\n",
        SQUARE + "f 1 2 3\nf 1 2 3 4\n",
        SQUARE + "v 0 0 1\nvt 0 0\nvt 1 1\nusemtl a\nf 1/1 2/2 3/1\nusemtl b\nf 1/2 3/1 4/1\nusemtl a\nf 1/1 2/1 5/2\n",
        SQUARE + "vn 0 0 1\nvn 0 0 -1\nf 1//1 2//1 3//1\nf 3//2 2//2 1//2\nf -4//1 -2//1 -1//1\n",
    ],
    ids=["triangles", "quad", "mixed", "materials", "normals"],
)
def test_groups_come_in_the_same_order(text: str, tmp_path: Path) -> None:
    file = tmp_path / "mesh.obj"
    file.write_text(text, encoding="utf-8")
    same_as_trimesh(file)


def test_the_samples_are_read_as_before() -> None:
    files = sorted(RAW.rglob("*.obj"))[::7]
    assert files
    assert all(read_obj(file.read_bytes()) is not None for file in files), "none goes the long way"
    for file in files:
        same_as_trimesh(file)


def same_as_trimesh(file: Path) -> None:
    """Check that both ways give the same corners, and merged the same arrays."""
    whole, known = trimesh.load_mesh(str(file), skip_materials=True, process=False), read_obj(file.read_bytes())
    assert isinstance(whole, trimesh.Trimesh)
    if known is not None:
        vertices, faces = known.mesh
        assert np.array_equal(vertices[faces], whole.vertices[whole.faces])
        assert np.array_equal(np.unique(known.points, axis=0), np.unique(vertices, axis=0))
    found = load_mesh(file)
    bare = trimesh.Trimesh(whole.vertices, whole.faces, process=False)
    bare.merge_vertices()
    bare.update_faces(bare.nondegenerate_faces())
    bare.remove_unreferenced_vertices()
    assert np.array_equal(found.vertices, bare.vertices) and np.array_equal(found.faces, bare.faces)


DATA = Path(__file__).resolve().parents[1] / "data" / "raw"
CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvn 0 0 1\nvt 0 0\n"


def corners(surface: Surface) -> np.ndarray:
    """(m, 3, k) all that is known of each corner of each triangle."""
    known = [surface.vertices, surface.normals, surface.uv]
    return np.concatenate([values[surface.faces] for values in known if values is not None], axis=2)


def test_the_samples_are_read_as_trimesh_reads_them(monkeypatch: pytest.MonkeyPatch) -> None:
    files = [file for name in ("Scissors", "Suitcase", "Microwave") for file in sorted((DATA / name).rglob("*.obj"))]
    ours = {file: load_surfaces(file) for file in files}
    assert any(read_obj(file.read_bytes()) is not None for file in files)
    monkeypatch.setattr(load, "read_obj", lambda content: None)
    for file, found in ours.items():
        for one, other in zip(found, load_surfaces(file), strict=True):
            assert one.paint == other.paint and (one.normals is None) is (other.normals is None), file
            assert np.allclose(corners(one), corners(other), rtol=0.0, atol=1e-12), file


def test_materials_and_windows_line_ends(tmp_path: Path) -> None:
    (tmp_path / "two.mtl").write_text("newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\nd 0.5\n")
    text = f"mtllib two.mtl\n# a comment\n{CORNERS}usemtl red\nf 1//1 2//1 3//1\nusemtl blue\nf 2//1 4//1 3//1\n"
    (tmp_path / "two.obj").write_bytes(text.replace("\n", "\r\n").encode())
    assert read_obj((tmp_path / "two.obj").read_bytes()) is not None
    paints = {surface.paint.color for surface in load_surfaces(tmp_path / "two.obj") if surface.paint is not None}
    assert paints == {(1.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 0.5)}


@pytest.mark.parametrize(
    "lines",
    [
        "f 1 2 4 3",  # a polygon
        "f 1 2 3\nf 1 2 4 3",
        "f -4 -3 -2",  # numbers from the end
        "f 1 2 5",  # of which there is none
        "f 1/1/1 2/1/1 3/1/1\nf 1//1 2//1 4//1",  # mixed
        "v 0 0 1 1 0 0\nf 1 2 3",  # coloured
        "v 0 0 one\nf 1 2 3",
        "curv 0 1\nf 1 2 3",
        "",
    ],
)
def test_what_is_not_plain_is_left_to_trimesh(tmp_path: Path, lines: str) -> None:
    file = tmp_path / "odd.obj"
    file.write_text(f"{CORNERS}{lines}\n")
    assert read_obj(file.read_bytes()) is None
