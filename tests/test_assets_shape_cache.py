"""Shapes kept from one extraction to the next: the same numbers, and never those of another file."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh

from asset2sim.assets.extract import Extraction
from asset2sim.assets.meshes import triangles
from asset2sim.assets.meshes.load import load_mesh
from asset2sim.assets.meshes.shape_cache import CachedMesh, mesh_key, read_shapes, write_shapes
from asset2sim.intake.origin import extract
from schemas.asset import AssetRef
from schemas.errors import AssetError
from tests.assets import RAW

BIN = "trashcan_pedal"


@pytest.fixture
def source(tmp_path: Path) -> AssetRef:
    """A copy of a sample with meshes that are cut into several pieces."""
    shutil.copytree(RAW / "TrashCan" / BIN, tmp_path / BIN)
    return AssetRef(asset_id=BIN, path=str(tmp_path / BIN))


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
    assert same(plain, first) and (cache / f"{BIN}.npz").is_file()
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
    (cache / f"{BIN}.npz").write_bytes(damage)
    assert same(plain, extract(source, cache))
    assert read_shapes(cache / f"{BIN}.npz")


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
    known = read_shapes(tmp_path / "shapes" / f"{BIN}.npz")
    some: CachedMesh = next(iter(known.values()))
    write_shapes(tmp_path / "again.npz", {"one": some})
    (again,) = read_shapes(tmp_path / "again.npz").values()
    assert again.shape.solid.volume == some.shape.solid.volume and len(again.shape.pieces) == len(some.shape.pieces)
    write_shapes(tmp_path / "none.npz", {})
    assert read_shapes(tmp_path / "none.npz") == {}
