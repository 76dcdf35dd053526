"""The refined folder: self-contained, loadable anywhere without a warning, written whole or not at all."""

import logging
import shutil
from pathlib import Path

import numpy as np
import pybullet
import pytest
import trimesh
import yourdfpy
from pybullet_utils.bullet_client import BulletClient

from asset2sim.assets.folder import staged_folder, write_folder, write_urdf
from asset2sim.assets.hulls import collision_hulls
from asset2sim.engines.console import captured_console
from asset2sim.intake.origin import extract
from asset2sim.validation.validate import validate
from schemas.asset import AssetRef
from schemas.overlay import Overlay
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Source
from tests.assets import RAW, box_obj, fingerprint, joint, link, mesh, near, robot, shape, written

PHYSICS = PhysicsSettings()
ASSETS = ("Stapler/stapler_desk", "Box/box_wooden", "Box/planted_flat_decal", "Keyboard/keyboard_compact")


def refine(source: Path, target: Path, scale: float = 0.25) -> None:
    item = extract(AssetRef(asset_id=source.name, path=str(source), root=str(source.parent)))
    overlay, _ = validate(item, Overlay(scale=scale), Source.MODEL, 0.5, PHYSICS)
    write_folder(item, overlay, collision_hulls(item, overlay.scale), target, PHYSICS)


def pybullet_says(urdf: Path) -> tuple[list[str], list[float]]:
    """What PyBullet prints while it loads a file with its looks, and the masses of its links, kg."""
    client = BulletClient(connection_mode=pybullet.DIRECT)
    try:
        with captured_console() as lines:
            body = client.loadURDF(str(urdf), flags=pybullet.URDF_USE_INERTIA_FROM_FILE)
        masses = [client.getDynamicsInfo(body, i)[0] for i in range(-1, client.getNumJoints(body))]
    finally:
        client.disconnect()
    return lines, masses


def loads_quietly(folder: Path, caplog: pytest.LogCaptureFixture) -> yourdfpy.URDF:
    """Load a refined folder in both readers; fails on any word of either."""
    with (
        caplog.at_level(logging.WARNING),
        caplog.at_level(logging.WARNING, logger="yourdfpy"),
        captured_console() as said,
    ):
        model = yourdfpy.URDF.load(str(folder / "mobility.urdf"), load_collision_meshes=True)
    assert said == [] and caplog.messages == []
    lines, masses = pybullet_says(folder / "mobility.urdf")
    assert lines == [] and min(masses) > 0.0
    stated = [item.inertial.mass for item in model.robot.links]
    assert near(sum(masses), sum(stated), 1e-6)
    return model


@pytest.mark.system
@pytest.mark.parametrize("asset", ASSETS)
def test_a_refined_folder_loads_anywhere_without_a_warning(
    asset: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    source = tmp_path / "in" / "thing"
    shutil.copytree(RAW / asset, source)
    before = fingerprint(source)
    refine(source, tmp_path / "out" / "thing")
    assert fingerprint(source) == before, "the input is not written to"
    shutil.rmtree(tmp_path / "in")
    moved = tmp_path / "far" / "from here" / "other name"
    shutil.move(tmp_path / "out" / "thing", moved)
    original = extract(AssetRef(asset_id="a", path=str(RAW / asset))).features
    model = loads_quietly(moved, caplog)
    assert near(np.sort(model.scene.extents), np.sort(original.rest_size) * 0.25, 1e-4)
    assert (moved / "semantics.txt").read_bytes() == (RAW / asset / "semantics.txt").read_bytes()
    assert not (moved / "bounding_box.json").exists(), "it would no longer be true"


@pytest.mark.system
def test_meshes_of_every_kind_and_from_a_package(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    package = tmp_path / "thing"
    meshes = package / "meshes"
    meshes.mkdir(parents=True)
    box = trimesh.creation.box((0.4, 0.4, 0.4))
    for kind in ("stl", "dae", "glb"):
        box.export(meshes / f"{kind}_box.{kind}")
    names = ("stl", "dae", "glb")
    urdf = robot(
        link("body", shape("1 1 1")),
        *(link(name, mesh(f"package://thing/meshes/{name}_box.{name}")) for name in names),
        *(joint(f"to_{name}", "revolute", "body", name, xyz=f"{i} 0 1", axis="0 0 1", limit="0 1")
          for i, name in enumerate(names)),
    )  # fmt: skip
    written(package / "urdf", urdf)
    refine(package / "urdf", tmp_path / "out", 0.5)
    shutil.rmtree(package)
    model = loads_quietly(tmp_path / "out", caplog)
    for item in model.robot.links[1:]:
        look = item.visuals[0].geometry.mesh.filename
        assert not Path(look).is_absolute() and "://" not in look and (tmp_path / "out" / look).is_file()
        loaded = trimesh.load_mesh(tmp_path / "out" / item.collisions[0].geometry.mesh.filename)
        assert near(loaded.extents, (0.2, 0.2, 0.2), 1e-6), item.name


@pytest.mark.system
def test_a_missing_visual_is_dropped(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    urdf = robot(link("a", mesh("a.obj") + mesh("gone.obj")))
    refine(written(tmp_path / "in", urdf, {"a.obj": box_obj((0, 0, 0), (1, 1, 1))}), tmp_path / "out")
    model = loads_quietly(tmp_path / "out", caplog)
    assert [item.geometry.mesh.filename for item in model.robot.links[0].visuals] == ["a.obj"]


def test_writing_the_urdf_again_changes_nothing(tmp_path: Path) -> None:
    source = RAW / "Box" / "box_wooden"
    item = extract(AssetRef(asset_id="a", path=str(source)))
    overlay, _ = validate(item, Overlay(scale=0.25), Source.MODEL, 0.5, PHYSICS)
    folder = write_folder(item, overlay, collision_hulls(item, 0.25), tmp_path / "out", PHYSICS)
    before = fingerprint(tmp_path)
    write_urdf(item, overlay, folder, PHYSICS)
    assert fingerprint(tmp_path) == before


def test_a_staged_folder_replaces_the_old_one_at_the_end(tmp_path: Path) -> None:
    final = written(tmp_path / "assets" / "a", "old", {"stale.txt": "old"})
    with staged_folder(final) as staged:
        (staged / "mobility.urdf").write_text("new")
        assert (final / "mobility.urdf").read_text() == "old", "readers still see the old one"
    assert fingerprint(final).keys() == {"mobility.urdf"} and (final / "mobility.urdf").read_text() == "new"
    assert [path.name for path in final.parent.iterdir()] == ["a"]


def write_half(final: Path, problem: BaseException) -> None:
    with staged_folder(final) as staged:
        assert not list(staged.iterdir())
        (staged / "mobility.urdf").write_text("half")
        raise problem


@pytest.mark.parametrize("problem", [RuntimeError, KeyboardInterrupt])
def test_a_failed_write_leaves_the_old_folder(tmp_path: Path, problem: type[BaseException]) -> None:
    final = written(tmp_path / "assets" / "a", "old")
    with pytest.raises(problem):
        write_half(final, problem())
    assert (final / "mobility.urdf").read_text() == "old"
    assert [path.name for path in final.parent.iterdir()] == ["a"]


def test_leftovers_of_a_killed_run_are_cleared(tmp_path: Path) -> None:
    final = tmp_path / "assets" / "a"
    written(tmp_path / "assets" / ".a.new", "half")
    written(tmp_path / "assets" / ".a.old", "good")
    with pytest.raises(RuntimeError):
        write_half(final, RuntimeError())
    assert (final / "mobility.urdf").read_text() == "good", "killed between two moves: the old one comes back"
