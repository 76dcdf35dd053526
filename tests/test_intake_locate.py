"""Finding the URDF and the meshes that it refers to, whatever scheme and slashes it uses."""

from pathlib import Path

import pytest

from asset2sim.assets.urdf.references import find_mesh
from asset2sim.intake.locate import find_source
from schemas.errors import AssetError
from schemas.vocabulary import FailureMode


def touch(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("x")
    return path


def test_a_urdf_one_folder_down_is_found(tmp_path: Path) -> None:
    file = touch(tmp_path / "urdf" / "thing.urdf")
    touch(tmp_path / "meshes" / "a.obj")
    assert find_source(tmp_path) == file


def test_mobility_urdf_goes_before_others(tmp_path: Path) -> None:
    touch(tmp_path / "other.urdf")
    assert find_source(touch(tmp_path / "mobility.urdf").parent).name == "mobility.urdf"


@pytest.mark.parametrize(
    ("names", "said"), [((), "no URDF file"), (("a.urdf", "b.urdf"), r"2 URDF files \(a.urdf, b.urdf\)")]
)
def test_no_single_urdf_is_unreadable(tmp_path: Path, names: tuple[str, ...], said: str) -> None:
    for name in names:
        touch(tmp_path / name)
    with pytest.raises(AssetError, match=said) as caught:
        find_source(tmp_path)
    assert caught.value.mode is FailureMode.UNREADABLE_ASSET
    assert str(tmp_path) in str(caught.value)


def test_a_missing_folder_is_unreadable(tmp_path: Path) -> None:
    with pytest.raises(AssetError, match=r"gone.*no such asset folder") as caught:
        find_source(tmp_path / "gone")
    assert caught.value.code == "missing_folder"


@pytest.mark.parametrize(
    "reference",
    [
        "meshes/a.obj",
        "meshes\\a.obj",
        "./meshes/a.obj",
        " meshes/a.obj ",
        "package://some_robot/meshes/a.obj",
        "package://some_robot\\meshes\\a.obj",
        "model://thing/meshes/a.obj",
        "file://meshes/a.obj",
        "package://meshes/a.obj",
    ],
)
def test_references_beside_the_urdf(tmp_path: Path, reference: str) -> None:
    file = touch(tmp_path / "meshes" / "a.obj")
    found = find_mesh(reference, tmp_path)
    assert found is not None and found.samefile(file)


def test_a_package_keeps_urdf_and_meshes_side_by_side(tmp_path: Path) -> None:
    file = touch(tmp_path / "some_robot" / "meshes" / "a.stl")
    folder = tmp_path / "some_robot" / "urdf"
    folder.mkdir()
    found = find_mesh("package://some_robot/meshes/a.stl", folder)
    assert found is not None and found.samefile(file)
    assert find_mesh("meshes/a.stl", folder) is None, "a plain relative path means the URDF's own folder"


def test_the_longest_fitting_path_wins(tmp_path: Path) -> None:
    touch(tmp_path / "a.obj")
    file = touch(tmp_path / "visual" / "a.obj")
    found = find_mesh("package://robot/visual/a.obj", tmp_path)
    assert found is not None and found.samefile(file)


def test_absolute_paths(tmp_path: Path) -> None:
    file = touch(tmp_path / "else" / "a.obj")
    folder = tmp_path / "asset"
    folder.mkdir()
    assert find_mesh(str(file), folder) == file
    assert find_mesh(f"file://{file}", folder) == file


@pytest.mark.parametrize("reference", ["", "   ", "package://", "gone.obj", "package://robot/gone.obj", "meshes"])
def test_what_is_not_there_is_none(tmp_path: Path, reference: str) -> None:
    touch(tmp_path / "meshes" / "a.obj")
    assert find_mesh(reference, tmp_path) is None
