"""Scenes of boxes, in MJCF, SDF, USD and URDF, cut: what their parts are, and that each stands where it stood."""

from functools import partial
from pathlib import Path

import numpy as np
import pytest

from asset2sim.assets.authored import authored_overlay
from asset2sim.assets.exports.mjcf import export_mjcf
from asset2sim.assets.folder import write_folder
from asset2sim.intake.dataset import load_dataset
from asset2sim.intake.origin import extract, parts_in
from asset2sim.intake.scenes import with_parts
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import apply, link_to_root, tree_of
from asset2sim.runs.check_request import cut_scenes
from asset2sim.validation.support import forced_support
from schemas.asset import AssetRef
from schemas.errors import AssetError, UsageError
from schemas.inputs import InputSettings
from schemas.settings import PhysicsSettings
from schemas.support import SupportKind
from schemas.vocabulary import CollisionMode, Engine, UpAxis
from tests import usd_stages as usd
from tests.assets import joint, link, robot, shape
from tests.cabinets import sdf_shape, usd_part
from tests.engine_worlds import every_engine, held

SPLIT = InputSettings(split=True)
MJCF = """<mujoco model="kitchen"><compiler angle="radian"/><worldbody><geom type="plane" size="4 4 1"/>
  <body name="room">
    <body name="counter" pos="1 0 0"><geom type="box" size="0.4 0.6 0.45" pos="0 0 0.45"/></body>
    <body name="cabinet" pos="-1 0.2 1.5" quat="0.8 0 0 0.6"><body name="carcass">
      <geom type="box" size="0.2 0.3 0.3"/><body name="door" pos="0.21 -0.3 0">
        <joint name="door_hinge" axis="0 0 -1" range="0 1.6"/><geom type="box" size="0.01 0.29 0.29" pos="0 0.3 0"/>
      </body></body></body>
    <body name="stove" pos="0 1 0" quat="0.5 0.5 0.5 0.5">
      <geom type="box" size="0.3 0.4 0.3" pos="0 0.4 0"/><body name="handle" pos="0.31 0.6 0">
        <geom type="box" size="0.01 0.01 0.1"/></body>
      <body name="oven_door" pos="0.31 0.1 0"><joint name="oven_hinge" axis="0 0 -1" range="0 1.5"/>
        <geom type="box" size="0.01 0.2 0.25" pos="0 0.2 0"/></body></body>
    <body name="hood" pos="-1 0.2 1.5" quat="0.8 0 0 0.6">
      <geom type="box" size="0.12 0.3 0.1" pos="0.12 0 -0.385"/></body>
    <body name="tap" pos="0 1.55 0.2"><geom type="sphere" size="0.02" contype="0" conaffinity="2"/></body>
    <body name="lamp" pos="0 0 2"><geom type="sphere" size="0.1"/></body>
  </body>
  <body name="kettle" pos="1 0.1 1.02" quat="0.8 0 0 0.6"><freejoint/><geom type="cylinder" size="0.08 0.1"/>
    <body name="lid" pos="0 0 0.11"><joint name="lid_slide" type="slide" axis="0 0 1" range="0 0.05"/>
      <geom type="cylinder" size="0.06 0.005"/></body></body>
</worldbody></mujoco>"""
MOVED = {
    "counter": (), "cabinet": ("door",), "stove": ("oven_door",), "hood": (), "tap": (), "lamp": (),
    "kettle": ("lid",),
}  # fmt: skip
"""Part → links that its joints move. The hood overlaps the cabinet by 5 mm and more, and the oven's door swings through
the tap, which by its bits collides with nothing."""
LAMP, STAND, LEAF = (sdf_shape(size) for size in ("0.1 0.1 0.3", "0.4 0.4 0.5", "0.02 0.3 0.3"))
DOOR = f"""<link name="door"><pose>0.3 0 0 0 0 0</pose>{LEAF}</link><joint name="j" type="revolute">
  <parent>body</parent><child>door</child><axis><xyz>0 0 1</xyz><limit><lower>0</lower><upper>1</upper></limit></axis>
  </joint>"""
WORLD = f"""<sdf version="1.7"><world name="room"><model name="ground"><static>true</static><link name="l">
  <visual name="v"><geometry><plane><normal>0 0 1</normal></plane></geometry></visual></link></model>
  <include><uri>model://sun</uri></include>
  <model name="stand"><static>1</static><pose>1 2 0.25 0 0 1</pose><link name="body">{STAND}</link>{DOOR}</model>
  <model name="lamp"><pose>1 2 0.65 0 0 1.5</pose><link name="body"><pose>0.1 0 0 0 0 0</pose>{LAMP}</link></model>
  </world></sdf>"""
STAGE = usd.usda(
    usd.prim("Xform", "room",
             usd.prim("Xform", "stand", usd.at((1, 2, 0.25)), "bool physics:kinematicEnabled = true",
                      usd.plate("mesh", (0.4, 0.4, 0.5)), apis=("PhysicsRigidBodyAPI",)),
             usd_part("lamp", (0.1, 0.1, 0.3), (1, 2, 0.65)), usd_part("door", (0.02, 0.3, 0.3), (1.3, 2, 0.25)),
             usd.joint("Revolute", "hinge", ("/room/stand", "/room/door"), usd.limits(0.0, 60.0, "Z"),
                       frame0="0.3 0 0")),
    default="room",
)  # fmt: skip
URDF = robot(
    link("floor", shape("4 4 0.02")),
    *(link(name, shape("0.5 0.4 0.6")) for name in ("left", "right", "shelf", "cup")),
    *(link(name, shape("0.02 0.4 0.3")) for name in ("left_door", "right_door", "hatch")),
    joint("a", "fixed", "floor", "left", xyz="-1,0,0.4"),
    joint("b", "fixed", "floor", "right", xyz="1 0 0.4"),
    joint("c", "fixed", "floor", "shelf", xyz="0 1 0.4"),
    joint("free", "floating", "right", "cup", xyz="0 0 1"),
    joint("left_hinge", "revolute", "left", "left_door", xyz="0.3 0 0", axis="0 0 1", limit="0 1"),
    joint("right_hinge", "revolute", "right", "right_door", xyz="0.3 0 0", axis="0 0 1", limit="0 1", more="MORE"),
    joint("hatch_hinge", "revolute", "floor", "hatch", xyz="0 -1 0.2", axis="0 0 1", limit="0 1"),
)


def kitchen(folder: Path, name: str, text: str) -> list[AssetRef]:
    """The assets of a dataset that is this file, cut."""
    folder.mkdir(exist_ok=True)
    (folder / name).write_text(text)
    return load_dataset(folder, cut=partial(with_parts, inputs=SPLIT))


def placed(ref: AssetRef) -> dict[str, Array]:
    """Link → its points in the frame of the asset's root."""
    found = extract(ref)
    poses = link_to_root(tree_of(found.features.joints), found.features.root, {})
    return {name: apply(poses[name], item.points) for name, item in found.geometry.items() if len(item.points)}


@pytest.mark.system
@pytest.mark.parametrize(
    ("name", "text", "moved", "free"),
    [
        ("kitchen.xml", MJCF, MOVED, "kettle"),
        ("room.sdf", WORLD, {"stand__body": ("stand__door",), "lamp__body": ()}, "lamp__body"),
        ("room.usda", STAGE, {"stand": ("door",), "lamp": ()}, "lamp"),
    ],
)
def test_a_scene_is_cut_where_its_parts_hang_and_each_stands_where_it_stood(
    tmp_path: Path, name: str, text: str, moved: dict[str, tuple[str, ...]], free: str
) -> None:
    if name.endswith("usda"):
        pytest.importorskip("pxr")
    refs = kitchen(tmp_path, name, text)
    scene = AssetRef(asset_id=tmp_path.name, path=str(tmp_path))
    whole, parts = placed(scene), parts_in(scene, UpAxis.Z, SPLIT)
    assert [ref.asset_id for ref in refs] == [f"{tmp_path.name}.{name}" for name in moved]
    for ref, part in zip(refs, parts, strict=True):
        found = extract(ref).features
        assert ref.scene == tmp_path.name and ref.part == part.name and found.metric
        assert tuple(item.child for item in found.movable_joints) == moved[part.name]
        assert ref.support is (SupportKind.FREESTANDING if part.name == free else SupportKind.FIXED)
        assert np.allclose(part.to_scene[2, :3], [0, 0, 1]) and np.allclose(part.to_scene[:3, 2], [0, 0, 1])
        for name, points in placed(ref).items():
            assert apply(part.to_scene, points) == pytest.approx(whole.pop(name), abs=1e-8), name
    assert not whole, "every link with a shape is in one part"
    fixed = forced_support(None, extract(scene))
    assert fixed is not None and fixed.fixed and forced_support(None, extract(refs[0])) is None
    told = " ".join(item.message for item in extract(scene).findings)
    assert f"{free}: free in it, and fixed where they stand" in told and ("model://sun" in told) == ("sdf" in text)


@pytest.mark.parametrize(
    ("more", "names"),
    [("", ["floor", "left", "right", "cup"]), ('<mimic joint="left_hinge"/>', ["floor", "left", "cup"])],
)
def test_a_root_keeps_what_is_its_own_and_what_moves_together_stays_together(
    tmp_path: Path, more: str, names: list[str]
) -> None:
    """The shelf without joints and the hatch are the floor's; doors that are tied are one object."""
    refs = kitchen(tmp_path, "kitchen.urdf", URDF.replace("MORE", more))
    assert [ref.part for ref in refs] == names
    assert set(placed(refs[0])) == {"floor", "shelf", "hatch"}
    assert set(placed(refs[1])) == {"left", "left_door", *(("right", "right_door") if more else ())}


def test_of_what_is_one_object_or_no_tree_nothing_is_cut(tmp_path: Path) -> None:
    whole = robot(link("a", shape("1 1 1")), link("b", shape("1 1 1")), joint("j", "continuous", "a", "b"))
    for name, text in (("one", whole), ("loop", whole.replace("</robot>", joint("k", "fixed", "b", "a") + "</robot>"))):
        (ref,) = kitchen(tmp_path / name, "thing.urdf", text)
        assert ref.part is None and ref.asset_id == name


def test_a_file_whose_cutting_breaks_ends_no_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise KeyError("x")

    monkeypatch.setattr("asset2sim.intake.scenes.parts_in", broken)
    assert [ref.part for ref in kitchen(tmp_path, "k.urdf", URDF)] == [None]


@pytest.mark.system
def test_objects_that_nothing_holds_are_refused_by_the_option_s_name(tmp_path: Path) -> None:
    loose = [joint(f"{name}_loose", "floating", "world", name) for name in ("a", "b")]
    for name, text in (
        ("k.xml", MJCF.replace('<body name="room">', '<body name="room"><freejoint/>')),
        ("k.urdf", robot(link("world"), *(link(name, shape("0.1 0.1 0.1")) for name in ("a", "b")), *loose)),
    ):
        folder = tmp_path / name.replace(".", "_")
        folder.mkdir()
        (folder / name).write_text(text)
        with pytest.raises(AssetError, match="--split"):
            extract(AssetRef(asset_id="k", path=str(folder)))


def test_a_part_that_floats_in_a_whole_is_held_and_the_option_named(tmp_path: Path) -> None:
    (tmp_path / "k.urdf").write_text(URDF)
    item = extract(AssetRef(asset_id="k", path=str(tmp_path)))
    assert item.features.joint("free").type == "fixed"
    assert ["--split" in finding.message for finding in item.findings if finding.code == "part_floats"] == [True]


def test_parts_have_rows_of_their_own_and_are_chosen_by_their_ids(tmp_path: Path) -> None:
    kitchen(tmp_path, "kitchen.xml", MJCF)
    lamp = f"{tmp_path.name}.lamp"
    (tmp_path / "overrides.csv").write_text(f"asset_id,mass_kg\n{lamp},0.5\n")
    (ref,) = load_dataset(tmp_path, None, (lamp,), None, partial(with_parts, inputs=SPLIT))
    assert ref.overrides is not None and ref.overrides.mass_kg == 0.5 and ref.root == str(tmp_path)
    with pytest.raises(UsageError, match="behind a URL"):
        cut_scenes([AssetRef(asset_id="k", path="s3://kitchens/k")], SPLIT)


@every_engine
@pytest.mark.system
def test_in_a_scene_that_is_not_cut_what_the_file_lets_pass_does_not_collide(tmp_path: Path, engine: Engine) -> None:
    """The oven's door at 67 degrees is where the tap is; without the file's bits they touch."""
    physics = PhysicsSettings()
    for meets, text in ((False, MJCF), (True, MJCF.replace('contype="0" conaffinity="2"', ""))):
        (tmp_path / "kitchen.xml").write_text(text)
        found = extract(AssetRef(asset_id="kitchen", path=str(tmp_path / "kitchen.xml")))
        overlay = authored_overlay(found, physics)
        urdf = write_folder(found, overlay, {}, tmp_path / f"{meets}", physics, CollisionMode.KEEP).urdf
        with held(engine, urdf) as world:
            world.place({"oven_hinge": 1.176})
            world.step(1)
            touching = {frozenset((point.link_a, point.link_b)) for point in world.contacts()}
        # MuJoCo's own filter has doors pass whatever is welded to the world.
        expected = meets and engine is not Engine.MUJOCO
        assert (frozenset(("tap", "oven_door")) in touching) is expected, touching
        document = export_mjcf(urdf.parent, overlay, 1e-3).read_text()
        assert ('body1="oven_door" body2="tap"' in document) is not meets
