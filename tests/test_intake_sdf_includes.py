"""SDF files that include other models: read from the folders beside, placed and named as the include says."""

from pathlib import Path

import pytest

from asset2sim.assets.urdf.references import ANYWHERE, AllowedFolders
from asset2sim.intake.dataset import load_dataset
from asset2sim.intake.formats.format import Converted
from asset2sim.intake.formats.sdf import urdf_of_sdf
from asset2sim.intake.origin import extract
from schemas.asset import AssetRef
from schemas.errors import AssetError
from tests.assets import box_obj, read

LATCH = (
    '<link name="drawer"><pose>0.1 0 0 0 0 0</pose><visual name="v"><geometry><mesh><uri>meshes/d.obj</uri></mesh>'
    '</geometry></visual></link><link name="latch"/><joint name="turn" type="revolute"><parent>drawer</parent><child>'
    "latch</child><axis><xyz>1 0 0</xyz></axis></joint>"
)
QUARTER = "1 0 0 0 0 1.5707963267948966"


def model(folder: Path, content: str, version: str = "1.7", file: str = "model.sdf") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    text = f'<sdf version="{version}"><model name="{folder.name}">{content}</model></sdf>'
    (folder / file).write_text(text, encoding="utf-8")
    return folder / file


def cabinet(folder: Path, include: str, child: str, version: str = "1.8") -> Path:
    slide = (
        f'<joint name="slide" type="prismatic"><parent>body</parent><child>{child}</child><axis><xyz>1 0 0</xyz>'
        "<limit><lower>0</lower><upper>0.2</upper></limit></axis></joint>"
    )
    return model(folder / "cabinet", f'<link name="body"/>{include}{slide}', version)


def numbers(made: Converted, joint: str, tag: str) -> list[float]:
    found = made.robot.find(f"joint[@name='{joint}']/{tag}")
    assert found is not None
    return [float(word) for word in str(found.get("xyz")).split()]


@pytest.mark.parametrize("inner", ["1.4", "1.7"])
@pytest.mark.parametrize("merge", [False, True])
@pytest.mark.parametrize("uri", ["model://box", "../box", "file://../box/model.sdf"])
def test_a_model_beside_is_included_as_the_include_has_it(tmp_path: Path, uri: str, merge: bool, inner: str) -> None:
    place = model(tmp_path / "box", f"<pose>5 5 5 0 0 0</pose>{LATCH}", inner)
    (tmp_path / "box" / "meshes").mkdir()
    (tmp_path / "box" / "meshes" / "d.obj").write_text(box_obj((0.0, 0.0, 0.0), (0.1, 0.1, 0.1)))
    attribute, first = (' merge="true"', "") if merge else ("", "top__")
    include = f"<include{attribute}><uri>{uri}</uri><name>top</name><pose>{QUARTER}</pose></include>"
    file = cabinet(tmp_path, include, f"{'' if merge else 'top::'}drawer")
    made = urdf_of_sdf(file, tmp_path, ANYWHERE)
    assert [link.get("name") for link in made.robot.findall("link")] == ["body", f"{first}drawer", f"{first}latch"]
    assert numbers(made, "slide", "origin") == pytest.approx([1.0, 0.1, 0.0]), "its own pose is overridden"
    # Up to version 1.4 an axis is stated in its model's frame, which the drawer's is parallel to; so it is in 1.7.
    assert numbers(made, f"{first}turn", "axis") == pytest.approx([1.0, 0.0, 0.0])
    assert [path.resolve() for path in made.files] == [place]
    found = extract(AssetRef(asset_id="cabinet", path=str(file.parent), root=str(tmp_path)))
    assert found.features.joint("slide").child == f"{first}drawer"
    mesh = made.robot.find("link/visual/geometry/mesh")
    assert mesh is not None and Path(str(mesh.get("filename"))) == place.parent / "meshes" / "d.obj"


def test_an_included_model_is_placed_by_a_frame_of_its_own(tmp_path: Path) -> None:
    """Its drawer stands 0.1 m off its origin; by the drawer it is placed 1 m off the body's, turned a quarter."""
    model(tmp_path / "box", LATCH)
    include = f"<include><uri>model://box</uri><name>top</name><pose>{QUARTER}</pose>{{}}</include>"
    placed = include.format("<placement_frame>drawer</placement_frame>")
    made = urdf_of_sdf(cabinet(tmp_path, placed, "top::drawer"), tmp_path, ANYWHERE)
    assert numbers(made, "slide", "origin") == pytest.approx([1.0, 0.0, 0.0])
    unknown = include.format("<placement_frame>door</placement_frame>")
    with pytest.raises(AssetError, match="'door', which is not in the model"):
        urdf_of_sdf(cabinet(tmp_path, unknown, "top::drawer"), tmp_path, ANYWHERE)


def test_a_xacro_of_an_sdf_includes_what_lies_beside_it(tmp_path: Path) -> None:
    shape = '<visual name="v"><geometry><box><size>0.1 0.1 0.1</size></box></geometry></visual>'
    model(tmp_path / "box", f'<link name="drawer">{shape}</link>')
    file = cabinet(tmp_path, "<include><uri>../box</uri><name>top</name></include>", "top::drawer")
    file.rename(file.with_name("model.sdf.xacro"))
    assert extract(AssetRef(asset_id="cabinet", path=str(file.parent), root=str(tmp_path))).features.link("top__drawer")


@pytest.mark.parametrize(
    ("inertial", "second", "kilograms", "centre"),
    [
        ("<density>700</density>", "", 14.0, 0.2),
        ("", "<density>3000</density>", 40.0, 0.3),
        ("<mass>5</mass>", "", 5.0, 0.2),
        ("", "", None, None),
    ],
    ids=["one density", "one of a shape", "a mass", "nothing"],
)
def test_an_inertial_that_gazebo_makes_is_made_of_stated_densities(
    inertial: str, second: str, kilograms: float | None, centre: float | None, tmp_path: Path
) -> None:
    """Two boxes of 10 l, at 0 and 0.4 m."""
    box = "<geometry><box><size>0.1 0.2 0.5</size></box></geometry>"
    shapes = (
        f"<collision name='a'>{box}</collision><collision name='b'><pose>0.4 0 0 0 0 0</pose>{box}{second}</collision>"
    )
    file = model(tmp_path / "box", f"<link name='d'><inertial auto='true'>{inertial}</inertial>{shapes}</link>", "1.11")
    stated = read(file).features.link("d").inertial
    assert (None if stated is None else stated.mass_kg) == pytest.approx(kilograms)
    assert (None if stated is None else stated.com[0]) == pytest.approx(centre)


def test_of_an_included_model_s_files_the_newest_is_taken(tmp_path: Path) -> None:
    for name, link in (("box-1_3.sdf", "old"), ("box-1_10.sdf", "new"), ("box-1_4.sdf", "older")):
        model(tmp_path / "box", f'<link name="{link}"/>', file=name)
    stated = "".join(f"<sdf>{name}</sdf>" for name in ("box-1_3.sdf", "box-1_10.sdf", "box-1_4.sdf"))
    (tmp_path / "box" / "model.config").write_text(f"<model>{stated}</model>", encoding="utf-8")
    made = urdf_of_sdf(cabinet(tmp_path, "<include><uri>model://box</uri></include>", "box::new"), tmp_path, ANYWHERE)
    assert [link.get("name") for link in made.robot.findall("link")] == ["body", "box__new"]


def test_models_that_include_each_other_and_those_outside_are_refused(tmp_path: Path) -> None:
    include = "<include><uri>model://{}</uri></include>"
    file = cabinet(tmp_path / "set", include.format("box"), "box::d")
    with pytest.raises(AssetError, match=r"model.sdf: its <include> 'model://box' is not there: keep that model"):
        urdf_of_sdf(file, tmp_path, ANYWHERE)
    model(tmp_path / "box", '<link name="d"/>')
    with pytest.raises(AssetError, match=r"lies outside the dataset"):
        urdf_of_sdf(file, tmp_path, AllowedFolders((tmp_path / "set",)))
    model(tmp_path / "box", f'<link name="d"/>{include.format("box")}')
    with pytest.raises(AssetError, match=r"models are included"):
        urdf_of_sdf(file, tmp_path, ANYWHERE)


def test_a_world_of_gazebo_is_a_file_of_sdf(tmp_path: Path) -> None:
    """What it includes is an object of it where it lies beside, and said where it does not."""
    model(
        tmp_path / "models" / "box",
        '<link name="d"><visual name="v"><geometry><box><size>1 1 1</size></box></geometry></visual></link>',
    )
    shape = "<collision name='c'><geometry><ellipsoid><radii>0.1 0.2 0.3</radii></ellipsoid></geometry></collision>"
    text = f"<include><uri>model://sun</uri></include><model name='egg'><link name='shell'>{shape}</link></model>"
    (tmp_path / "kitchen.world").write_text(
        f"<sdf version='1.9'><world name='w'>{text}</world></sdf>", encoding="utf-8"
    )
    assert [ref.asset_id for ref in load_dataset(tmp_path / "kitchen.world")] == ["kitchen"]
    found = read(tmp_path / "kitchen.world")
    assert found.features.closed_size == pytest.approx((0.2, 0.4, 0.6), rel=0.02)
    assert any("model://sun" in item.message for item in found.findings)
