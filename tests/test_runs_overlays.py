"""Overlays without geometry: they hold no vertex of the originals, and on a copy of the dataset give the same bytes."""

import csv
import json
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pybullet
import pytest
import trimesh
from scipy.spatial import cKDTree

from asset2sim.catalog.write import write_run
from asset2sim.runs.overlays import BROUGHT, INDEX, apply_overlays, export_overlays
from flows.command import main
from flows.hand_on import REMAKE
from schemas.asset import AssetRef
from schemas.errors import UsageError
from schemas.inputs import InputSettings
from schemas.recipe import RECIPE_NAME, Recipe
from schemas.settings import EngineSettings, RunSettings
from schemas.vocabulary import BaseMode, Engine, Export, FailureMode, StateMode
from tasks.pipeline import refine_asset
from tasks.remake import remake_asset
from tests.assets import NO_VIEWS, RAW, fingerprint, prior, sample
from tests.factories import make_failure, make_run

IDS = ("stapler_desk", "box_wooden")
"""An object whose hulls are cut, and one that is hung from a world with its state baked and exported as MJCF."""
pytestmark = pytest.mark.system


@dataclass(frozen=True)
class Published:
    """A run's folder, and its objects as overlays."""

    out: Path
    overlays: Path


@pytest.fixture(scope="module")
def published(tmp_path_factory: pytest.TempPathFactory) -> Published:
    """Both objects refined, verified in one engine, as a run leaves them."""
    place = tmp_path_factory.mktemp("published")
    quick = NO_VIEWS.model_copy(update={"engine": EngineSettings(verify=(Engine.PYBULLET,), interact=False)})
    other = quick.model_copy(update={"state": StateMode.BAKE, "base": BaseMode.WORLD, "exports": (Export.MJCF,)})
    records = [refine_asset(sample(name), place / "out", settings, prior) for name, settings in
               zip(IDS, (quick, other), strict=True)]  # fmt: skip
    write_run(place / "out", make_run(settings=quick), [*records, make_failure("broken", FailureMode.MISSING_MESH)])
    written, left_out = export_overlays(place / "out", place / "overlays")
    assert (written, left_out) == (sorted(IDS), [])
    return Published(place / "out", place / "overlays")


@pytest.fixture
def dataset(tmp_path: Path) -> Path:
    """A copy of the two assets, with a manifest that asks nothing."""
    rows = ["asset_id,path"]
    for name in IDS:
        shutil.copytree(sample(name).path, tmp_path / "data" / name)
        rows.append(f"{name},{name}")
    (tmp_path / "data" / "manifest.csv").write_text("\n".join(rows), encoding="utf-8")
    return tmp_path / "data"


def numbers_in(value: object) -> Iterator[list[float]]:
    """Every list of numbers within a JSON document, and the values of each of its objects in their order."""
    inner = list(value.values()) if isinstance(value, dict) else value if isinstance(value, list) else []
    yield [float(item) for item in inner if isinstance(item, int | float) and not isinstance(item, bool)]
    for item in inner:
        yield from numbers_in(item)


def triples(folder: Path) -> np.ndarray:
    """(n, 3) every three numbers that stand beside each other in the folder's JSON files."""
    found = [np.zeros((0, 3))]
    for file in folder.glob("*.json"):
        for row in numbers_in(json.loads(file.read_text(encoding="utf-8"))):
            if len(row) >= 3:
                found.append(np.lib.stride_tricks.sliding_window_view(np.array(row), 3))
    return np.vstack(found)


def vertices_of(ref: AssetRef) -> np.ndarray:
    """(n, 3) vertices of all meshes of an asset."""
    meshes = [trimesh.load_mesh(file, process=False) for file in sorted(Path(ref.path).rglob("*.obj"))]
    return np.vstack([mesh.vertices for mesh in meshes])


def shared_vertices(said: np.ndarray, vertices: np.ndarray, scale: float) -> int:
    """How many of the triples are a vertex, as authored or at the final scale; what lies on an axis is any number."""
    told = said[(np.abs(said) > 1e-6).sum(axis=1) >= 2]
    authored, final = (np.asarray(cKDTree(vertices * factor).query(told)[0]) for factor in (1.0, scale))
    return int((np.minimum(authored, final) < 1e-7).sum())


def test_an_overlay_folder_has_no_vertex_of_the_originals(published: Published) -> None:
    assert sorted(path.name for path in published.overlays.iterdir()) == sorted((*IDS, INDEX, "README.md"))
    for name in IDS:
        folder = published.overlays / name
        assert sorted(path.name for path in folder.iterdir()) == sorted(BROUGHT)
        scale = float(json.loads((folder / "overlay.json").read_text(encoding="utf-8"))["scale"])
        vertices, said = vertices_of(sample(name)), triples(folder)
        assert len(said) > 30 and shared_vertices(said, vertices, scale) == 0
        # The test sees one that is there.
        assert shared_vertices(np.vstack([said, scale * vertices[::50]]), vertices, scale) > 0


def test_no_path_of_this_machine_and_no_secret_is_handed_on(published: Published) -> None:
    texts = "".join(path.read_text(encoding="utf-8") for path in published.overlays.rglob("*") if path.is_file())
    assert str(published.out) not in texts and str(RAW) not in texts


def test_applied_to_a_copy_it_gives_the_same_bytes_without_engines(
    published: Published, dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object, **__: object) -> None:
        raise AssertionError("an engine was asked")

    monkeypatch.setattr(pybullet, "connect", refused)
    cut = Recipe.model_validate_json((published.overlays / IDS[0] / RECIPE_NAME).read_bytes()).cuts
    assert any(way.planes for ways in cut.values() for way in ways)
    for name in IDS:
        ref = AssetRef(asset_id=name, path=str(dataset / name), root=str(dataset))
        made = remake_asset(ref, published.overlays / name, tmp_path / "again")
        assert (made.outcome, made.reason) == ("same", "")
        assert fingerprint(tmp_path / "again" / "assets" / name) == fingerprint(published.out / "assets" / name)


def test_what_is_not_the_original_is_a_row_and_the_others_are_made(
    published: Published, dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mesh = next((dataset / IDS[0]).rglob("*.obj"))
    mesh.write_text(f"{mesh.read_text(encoding='utf-8')}\n# another release\n", encoding="utf-8")
    out = tmp_path / "again"
    assert main(["overlays", "apply", str(published.overlays), str(dataset), "--out", str(out)]) == 1
    said = capsys.readouterr()
    assert "1 of 2 objects made again, byte for byte" in said.out
    assert f"{mesh.name}: another file than was refined" in said.err and IDS[0] in said.err
    assert not (out / "assets" / IDS[0]).exists()
    index = json.loads((out / "assets" / "index.json").read_text(encoding="utf-8"))
    assert [(item["asset_id"], item["status"]) for item in index["assets"]] == [(IDS[1], "ok")]
    mesh.unlink()
    with (dataset / "manifest.csv").open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([("asset_id", "path"), (IDS[0], IDS[0])])
    made = apply_overlays(published.overlays, dataset, tmp_path / "third", RunSettings(workers=1), REMAKE)
    assert [item.outcome for item in made] == ["original", "original"]
    told = {item.asset_id: item.reason for item in made}
    assert f"{mesh.name}: not there" in told[IDS[0]] and "no asset of this id" in told[IDS[1]]


def test_other_packages_are_named_where_bytes_differ(published: Published, dataset: Path, tmp_path: Path) -> None:
    brought = tmp_path / "brought"
    shutil.copytree(published.overlays / IDS[1], brought)
    recipe = json.loads((brought / RECIPE_NAME).read_text(encoding="utf-8"))
    recipe["made_with"]["numpy"] = "0.1"
    (brought / RECIPE_NAME).write_text(json.dumps(recipe), encoding="utf-8")
    ref = AssetRef(asset_id=IDS[1], path=str(dataset / IDS[1]), root=str(dataset))
    made = remake_asset(ref, brought, tmp_path / "again")
    assert made.outcome == "differs" and f"{RECIPE_NAME} changed" in made.reason and "numpy 0.1, here" in made.reason


def test_what_cannot_be_handed_on_is_said(published: Published, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="did not pass"):
        export_overlays(published.out, tmp_path / "none", ("broken",))
    with pytest.raises(UsageError, match="is there already"):
        export_overlays(published.out, published.overlays)
    copy = tmp_path / "copy"
    shutil.copytree(published.out, copy)
    (copy / "assets" / IDS[0] / RECIPE_NAME).unlink()
    (copy / "assets" / IDS[1] / "mobility.urdf").write_text("<robot/>", encoding="utf-8")
    written, left_out = export_overlays(copy, tmp_path / "none")
    assert written == [] and "before recipes were kept" in left_out[1] and "not as it was verified" in left_out[0]


def test_an_object_whose_meshes_lie_in_a_package_is_made_again_wherever_that_is(tmp_path: Path) -> None:
    meshes, data = tmp_path / "meshes", tmp_path / "data"
    shutil.copytree(sample("box_wooden").path, data / "box_wooden")
    (data / "box_wooden" / "textured_objs").rename(meshes)
    urdf = next((data / "box_wooden").glob("*.urdf"))
    urdf.write_text(urdf.read_text(encoding="utf-8").replace("textured_objs/", "package://shapes/"), encoding="utf-8")
    (data / "manifest.csv").write_text("asset_id,path\nbox_wooden,box_wooden\n", encoding="utf-8")
    quick = NO_VIEWS.model_copy(update={
        "engine": EngineSettings(verify=(Engine.PYBULLET,), interact=False),
        "inputs": InputSettings(packages=(f"shapes={meshes}",)),
    })  # fmt: skip
    ref = AssetRef(asset_id="box_wooden", path=str(data / "box_wooden"), root=str(data))
    record = refine_asset(ref, tmp_path / "out", quick, prior)
    write_run(tmp_path / "out", make_run(settings=quick), [record])
    assert export_overlays(tmp_path / "out", tmp_path / "overlays") == (["box_wooden"], [])
    recipe = (tmp_path / "overlays" / "box_wooden" / RECIPE_NAME).read_text(encoding="utf-8")
    assert '"package://shapes/' in recipe and str(tmp_path) not in recipe
    elsewhere = meshes.rename(tmp_path / "elsewhere")
    words = ["overlays", "apply", str(tmp_path / "overlays"), str(data), "--out"]
    assert main([*words, str(tmp_path / "without")]) == 1
    assert main([*words, str(tmp_path / "again"), "--package", f"shapes={elsewhere}"]) == 0
    made, was = (fingerprint(tmp_path / out / "assets" / "box_wooden") for out in ("again", "out"))
    assert made == was
