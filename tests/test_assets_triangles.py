"""Triangles and shapes kept between extractions: the same in every bit, and never those of another file."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh

from asset2sim.assets.extract import Extraction
from asset2sim.assets.meshes import triangles
from asset2sim.assets.meshes.load import load_mesh
from asset2sim.assets.meshes.shape_cache import CachedMesh, mesh_key, read_shapes, write_shapes
from asset2sim.assets.meshes.triangles import Triangles, file_key, read_triangles, write_triangles
from asset2sim.intake.origin import extract
from schemas.asset import AssetRef
from schemas.errors import AssetError
from tests.assets import RAW, box_obj
from tests.marks import OBJECTS, needs_objects

BIN = RAW / "TrashCan" / "trashcan_pedal"


def files_of(folder: Path) -> list[Path]:
    return sorted(folder.rglob("*.obj"))


def as_parsed(kept: Triangles, file: Path) -> bool:
    vertices, faces = kept.of(file)
    mesh = load_mesh(file)
    kinds = vertices.dtype == mesh.vertices.dtype and faces.dtype == mesh.faces.dtype
    return kinds and np.array_equal(vertices, mesh.vertices) and np.array_equal(faces, mesh.faces)


def through(store: Path, folder: Path) -> Triangles:
    """All meshes of a folder, asked for and kept."""
    kept = Triangles(store)
    for file in files_of(folder):
        kept.of(file)
    kept.keep()
    return kept


def nobody_parses(path: Path) -> None:
    pytest.fail(f"{path.name} is parsed again")


def assert_kept(store: Path, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    through(store, folder)
    again = Triangles(store)
    with monkeypatch.context() as patch:
        patch.setattr(triangles, "load_mesh", nobody_parses)
        for file in files_of(folder):
            again.of(file)
    assert files_of(folder) and all(as_parsed(again, file) for file in files_of(folder))


def test_what_is_read_from_disk_is_what_was_parsed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert_kept(tmp_path / "store.npz", BIN, monkeypatch)


@needs_objects
@pytest.mark.parametrize("name", ["Stapler/103275", "TrashCan/102155", "Laptop/10040"])
def test_real_meshes_come_back_in_every_bit(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert_kept(tmp_path / "store.npz", OBJECTS / name, monkeypatch)


def test_a_file_is_parsed_once_without_a_store_too(monkeypatch: pytest.MonkeyPatch) -> None:
    file, kept = files_of(BIN)[0], Triangles()
    first = kept.of(file)
    monkeypatch.setattr(triangles, "load_mesh", nobody_parses)
    assert kept.of(file) is first
    kept.keep()


def test_a_changed_file_is_parsed_anew_and_what_has_gone_leaves_the_store(tmp_path: Path) -> None:
    folder, store = tmp_path / "bin", tmp_path / "store.npz"
    shutil.copytree(BIN, folder)
    through(store, folder)
    changed, gone, *others = files_of(folder)
    changed.write_text(box_obj((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)))
    gone.unlink()
    kept = Triangles(store)
    for file in files_of(folder):  # as extraction does, which may know a mesh's shape and not ask for its triangles
        kept.key(file)
    assert as_parsed(kept, changed)
    kept.keep()
    assert set(read_triangles(store)) == {file_key(file) for file in (changed, *others)}


def test_nobody_changes_what_others_are_given() -> None:
    vertices, faces = Triangles().of(files_of(BIN)[0])
    for array in (vertices, faces):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04 cut short", b"no archive at all"])
def test_a_damaged_store_is_no_loss(tmp_path: Path, damage: bytes) -> None:
    store = tmp_path / "store.npz"
    store.write_bytes(damage)
    through(store, BIN)
    assert len(read_triangles(store)) == len({file_key(file) for file in files_of(BIN)})


def test_a_store_of_another_version_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = tmp_path / "store.npz"
    through(store, BIN)
    monkeypatch.setattr(triangles, "FORMAT", "another")
    assert read_triangles(store) == {}


def test_a_store_of_nothing_and_one_that_cannot_be_written(tmp_path: Path) -> None:
    write_triangles(tmp_path / "none.npz", {})
    assert (tmp_path / "none.npz").is_file() and read_triangles(tmp_path / "none.npz") == {}
    (tmp_path / "blocked").write_text("a file")
    through(tmp_path / "blocked" / "store.npz", BIN)


def test_formats_that_refer_to_other_files_are_not_kept(tmp_path: Path) -> None:
    (tmp_path / "lid.gltf").write_text("{}")
    assert file_key(tmp_path / "lid.gltf") is None


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"lid\.obj: cannot be read"):
        Triangles().of(tmp_path / "lid.obj")


@pytest.fixture
def source(tmp_path: Path) -> AssetRef:
    """A copy of a sample with meshes that are cut into several pieces."""
    shutil.copytree(BIN, tmp_path / BIN.name)
    return AssetRef(asset_id=BIN.name, path=str(tmp_path / BIN.name))


def same(one: Extraction, two: Extraction) -> bool:
    """Whether two extractions agree in every bit."""
    clouds = [
        [cloud for link in item.geometry.values() for part in link.parts for cloud in (*part.pieces, part.rotation)]
        + [link.points for link in item.geometry.values()]
        for item in (one, two)
    ]
    told = one.features == two.features and one.findings == two.findings
    return told and len(clouds[0]) == len(clouds[1]) and all(map(np.array_equal, *clouds))


def test_what_is_read_from_disk_is_what_was_computed(source: AssetRef, monkeypatch: pytest.MonkeyPatch) -> None:
    cache = Path(source.path).parent / "shapes"
    plain, first = extract(source), extract(source, cache)
    assert same(plain, first) and (cache / f"{BIN.name}.npz").is_file()
    monkeypatch.setattr(triangles, "load_mesh", lambda path: pytest.fail(f"{path.name} is parsed again"))
    assert same(plain, extract(source, cache))


def test_a_mesh_that_changed_is_read_anew_and_the_others_are_not(
    source: AssetRef, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache = Path(source.path).parent / "shapes"
    before = extract(source, cache)
    mesh = next(file for file in before.mesh_files.values() if file is not None)
    grown = [
        "v " + " ".join(str(2.0 * float(number)) for number in line.split()[1:4]) if line.startswith("v ") else line
        for line in mesh.read_text().splitlines()
    ]
    mesh.write_text("\n".join(grown))
    parsed: list[Path] = []

    def load(path: Path) -> trimesh.Trimesh:
        parsed.append(path)
        return load_mesh(path)

    monkeypatch.setattr(triangles, "load_mesh", load)
    after = extract(source, cache)
    assert parsed == [mesh]
    assert not same(before, after) and same(after, extract(source))


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04 cut short", b"no archive at all"])
def test_a_damaged_file_is_no_loss(source: AssetRef, damage: bytes) -> None:
    cache = Path(source.path).parent / "shapes"
    plain = extract(source, cache)
    (cache / f"{BIN.name}.npz").write_bytes(damage)
    assert same(plain, extract(source, cache))
    assert read_shapes(cache / f"{BIN.name}.npz")


def test_a_folder_that_cannot_be_written_is_no_loss(source: AssetRef) -> None:
    blocked = Path(source.path).parent / "shapes"
    blocked.write_text("a file")
    assert same(extract(source), extract(source, blocked))


def test_unreadable_meshes_are_told_as_without_a_store(source: AssetRef) -> None:
    for mesh in Path(source.path).rglob("*.obj"):
        mesh.write_bytes(b"\x00\xff nothing that anybody wrote")
    with pytest.raises(AssetError) as plain:
        extract(source)
    with pytest.raises(AssetError) as stored:
        extract(source, Path(source.path).parent / "shapes")
    assert str(stored.value) == str(plain.value)


def test_a_mesh_at_another_scale_is_another_mesh() -> None:
    assert mesh_key("content", np.ones(3)) != mesh_key("content", np.full(3, 2.0))
    assert mesh_key(None, np.ones(3)) is None


def test_flat_and_empty_are_kept_too(tmp_path: Path, source: AssetRef) -> None:
    extract(source, tmp_path / "shapes")
    known = read_shapes(tmp_path / "shapes" / f"{BIN.name}.npz")
    some: CachedMesh = next(iter(known.values()))
    write_shapes(tmp_path / "again.npz", {"one": some})
    (again,) = read_shapes(tmp_path / "again.npz").values()
    assert again.shape.solid.volume == some.shape.solid.volume and len(again.shape.pieces) == len(some.shape.pieces)
    write_shapes(tmp_path / "none.npz", {})
    assert read_shapes(tmp_path / "none.npz") == {}
