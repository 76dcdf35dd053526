"""An OBJ read without its looks is the mesh that trimesh makes of it."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from asset2sim.assets.meshes.load import load_mesh
from asset2sim.assets.meshes.obj_file import read_obj
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
