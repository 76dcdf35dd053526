"""What an asset may be written in: the same cabinet comes of every format, and what cannot be read says what to do."""

import re
from pathlib import Path

import pytest

from asset2sim.assets.extract import Extraction
from asset2sim.assets.urdf.references import ANYWHERE, AllowedFolders
from asset2sim.intake.dataset import load_dataset
from asset2sim.intake.formats.sdf import urdf_of_sdf
from asset2sim.intake.formats.xacro import find_package
from asset2sim.intake.origin import extract
from asset2sim.runs.plan.asset_files import asset_files
from schemas.asset import AssetRef
from schemas.errors import AssetError
from schemas.inputs import InputSettings
from schemas.settings import EngineSettings, Settings
from schemas.vocabulary import Engine, FailureMode, Method, UpAxis
from tasks.pipeline import refine_asset
from tests.assets import near, prior, read
from tests.cabinets import AXES, CENTERS, FORMATS, MJCF, RANGES, SIZE, XACRO, dae, sdf, written_cabinet

pytest.importorskip("pxr")  # it reads USD
pytest.importorskip("mujoco")  # it reads MJCF; imported here, since importing it starts a program


def is_the_cabinet(found: Extraction) -> bool:
    features = found.features
    joints = {joint.name: joint for joint in features.joints}
    return (
        near(features.closed_size, SIZE, 1e-6)
        and features.root == "body"
        and all(near(features.link_centers[name], center, 1e-6) for name, center in CENTERS.items())
        and all(near((joints[name].lower, joints[name].upper), ends, 1e-6) for name, ends in RANGES.items())
        and all(near(joints[name].axis_in_root, axis, 1e-6) for name, axis in AXES.items())
    )


@pytest.mark.parametrize("kind", FORMATS)
def test_the_same_cabinet_comes_of_every_format(tmp_path: Path, kind: str) -> None:
    found = read(written_cabinet(tmp_path / "cabinet", kind))
    assert is_the_cabinet(found)
    told = [finding for finding in found.findings if finding.code.startswith("converted_")]
    assert [finding.code for finding in told] == (
        [] if kind in ("urdf", "collada") else [f"converted_{kind[:5].split('_')[0]}"]
    )
    assert all(found.source.name in finding.message for finding in told)
    assert found.features.urdf_file == found.source.name and found.source.is_relative_to(tmp_path)


@pytest.mark.system
@pytest.mark.parametrize("encoding", ["iso-8859-1", "utf-16"])
def test_names_in_another_encoding_are_engines_too(tmp_path: Path, encoding: str) -> None:
    folder = written_cabinet(tmp_path / "cabinet", "urdf")
    file = folder / "thing.urdf"
    text = f"<?xml version='1.0' encoding='{encoding}'?>" + file.read_text(encoding="utf-8").split("?>")[-1]
    file.write_bytes(text.replace('"door_hinge"', '"t\u00fcr"').encode(encoding))
    settings = Settings(method=Method.RAW, engine=EngineSettings(verify=(Engine.PYBULLET,), interact=False))
    record = refine_asset(AssetRef(asset_id="a", path=str(folder)), tmp_path / "out", settings, prior)
    assert record.reports[0].problem is None, record.reason
    assert record.measurement is not None and "t\u00fcr" in [joint.name for joint in record.measurement.joints]


@pytest.mark.parametrize("kind", ["urdf", "xacro", "sdf", "mjcf", "usd"])
def test_a_dataset_lists_assets_of_every_format(tmp_path: Path, kind: str) -> None:
    written_cabinet(tmp_path / "one", kind)
    assert [ref.asset_id for ref in load_dataset(tmp_path)] == ["one"]
    assert [ref.asset_id for ref in load_dataset(tmp_path / "one")] == ["one"]


def test_a_ros_package_is_no_mjcf(tmp_path: Path) -> None:
    folder = written_cabinet(tmp_path / "one", "xacro")
    (folder / "package.xml").write_text("<package><name>cabinet_description</name><mujoco/></package>")
    assert read(folder).source.name == "cabinet.urdf.xacro"


def test_a_scene_is_left_for_the_model_that_it_includes(tmp_path: Path) -> None:
    folder = written_cabinet(tmp_path / "one", "mjcf")
    (folder / "scene.xml").write_text('<mujoco><include file="thing.xml"/></mujoco>')
    assert read(folder).source.name == "thing.xml"


def test_a_urdf_goes_before_what_lies_beside_it(tmp_path: Path) -> None:
    written_cabinet(tmp_path / "one", "sdf")
    assert read(written_cabinet(tmp_path / "one", "urdf")).source.name == "thing.urdf"


def test_the_content_hash_covers_the_original_and_what_it_includes(tmp_path: Path) -> None:
    folder = written_cabinet(tmp_path / "one", "xacro")
    before = read(folder).features.content_hash
    assert read(folder).features.content_hash == before
    parts = folder / "urdf" / "parts.xacro"
    parts.write_text(parts.read_text() + "<!-- other -->")
    assert read(folder).features.content_hash != before


def test_a_xacro_may_leave_out_the_prefix_of_xacro_s_own_elements_and_macros(tmp_path: Path) -> None:
    folder = written_cabinet(tmp_path / "one", "xacro")
    whole = read(folder).features
    for file in (folder / "urdf").glob("*.xacro"):
        file.write_text(file.read_text().replace("<xacro:", "<").replace("</xacro:", "</"))
    old = read(folder)
    assert old.features.joints == whole.joints and len(old.features.links) == len(whole.links)
    assert any("without the prefix 'xacro:'" in item.message for item in old.findings)


def test_what_a_xacro_takes_from_elsewhere_is_among_the_asset_s_files(tmp_path: Path) -> None:
    folder = written_cabinet(tmp_path / "cabinet_description", "xacro") / "urdf"
    names = [file.name for file in asset_files(folder, AllowedFolders((tmp_path,)))]
    assert "cabinet.urdf.xacro" in names and any("body.obj" in name for name in names)
    assert any("plate.obj" in name for name in names), "of a file that the xacro includes"


def refused(folder: Path) -> AssetError:
    with pytest.raises(AssetError) as caught:
        read(folder)
    assert caught.value.mode is FailureMode.UNREADABLE_ASSET
    return caught.value


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("${height / 2}", "${hight / 2}", r"cabinet.urdf.xacro, line 8: .*hight"),
        ("parts.xacro", "gone.xacro", r"cabinet.urdf.xacro, line 6: .*gone.xacro"),
        ("</robot>", "", r"cabinet.urdf.xacro, line 2\d: "),
        ('default="0.6"', "", r"cabinet.urdf.xacro, line 3: .*default"),
        ("${height / 2}", "${9**9**9}", r"cabinet.urdf.xacro, line 8: .*too large"),
        ("${height / 2}", "$(eval 9**9**9)", "too large"),
        ("${height / 2}", "${len([x for x in range(10**9)])}", "too large"),
        ("${height / 2}", "${[x.__class__ for x in (1,)]}", "__class__"),
    ],
)
def test_a_xacro_that_cannot_be_resolved_names_file_and_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    folder = written_cabinet(tmp_path / "one", "xacro")
    (folder / "urdf" / "cabinet.urdf.xacro").write_text(XACRO.replace(old, new))
    error = refused(folder)
    assert error.code == "xacro_unresolved"
    assert re.search(said, str(error)), str(error)


def test_a_xacro_may_name_its_own_folder(tmp_path: Path) -> None:
    folder = written_cabinet(tmp_path / "one", "xacro")
    text = XACRO.replace("$(find cabinet_description)/urdf/", "$(dirname)/")
    (folder / "urdf" / "cabinet.urdf.xacro").write_text(text)
    assert is_the_cabinet(read(folder))


def test_a_xacro_of_an_sdf_is_that_sdf(tmp_path: Path) -> None:
    folder = written_cabinet(tmp_path / "one", "sdf")
    file = folder / "model.sdf"
    argument = '<xacro:arg name="top" default="0.6"/>'
    head = f'<sdf xmlns:xacro="http://www.ros.org/x"{file.read_text().split("<sdf", 1)[1]}'.replace(
        ">", f">{argument}", 1
    )
    (folder / "model.sdf.xacro").write_text(head)
    file.unlink()
    assert is_the_cabinet(read(folder))


@pytest.mark.parametrize("space", ["", ' xmlns="http://drake.mit.edu"'])
def test_a_urdf_may_hang_on_a_world_that_is_no_link(tmp_path: Path, space: str) -> None:
    folder = written_cabinet(tmp_path / "one", "urdf")
    file = next(folder.rglob("*.urdf"))
    weld = '<joint name="weld" type="fixed"><parent link="world"/><child link="body"/></joint></robot>'
    file.write_text(file.read_text().replace("</robot>", weld).replace("<robot", f"<robot{space}", 1))
    found = read(folder)
    assert found.features.root == "world" and any("'world'" in finding.message for finding in found.findings)


def test_a_mistake_in_an_included_xacro_names_that_file(tmp_path: Path) -> None:
    folder = written_cabinet(tmp_path / "one", "xacro")
    parts = folder / "urdf" / "parts.xacro"
    parts.write_text(parts.read_text().replace("</xacro:macro>", ""))
    assert "cabinet.urdf.xacro: in parts.xacro, line " in str(refused(folder))


MACRO = """<robot name="set" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:macro name="board" params="name size:='0.3 0.2 0.1'"><link name="${name}"><visual><geometry>
<box size="${size}"/></geometry></visual></link></xacro:macro>
<xacro:macro name="cabinet" params="PARAMS"><xacro:board name="${prefix}body"/><xacro:board name="${prefix}door"/>
<joint name="${prefix}hinge" type="revolute"><xacro:insert_block name="origin"/><parent link="${prefix}body"/>
<child link="${prefix}door"/><limit lower="0" upper="${reach}"/></joint></xacro:macro>MORE</robot>"""


def test_a_xacro_that_only_defines_a_macro_is_one_instance_of_it(tmp_path: Path) -> None:
    text = MACRO.replace("PARAMS", "prefix *origin reach:=1.5").replace("MORE", "")
    (tmp_path / "cabinet.xacro").write_text(text)
    found = read(tmp_path)
    assert found.features.root == "body" and found.features.joint("hinge").upper == 1.5
    assert any("only defines the macro cabinet (prefix" in finding.message for finding in found.findings)
    hung = '<joint name="stands" type="fixed"><parent link="${parent}"/><child link="body"/></joint>'
    text = MACRO.replace("PARAMS", "parent prefix:='' *origin reach:=1").replace("<joint", f"{hung}<joint", 1)
    (tmp_path / "cabinet.xacro").write_text(text.replace("MORE", ""))
    assert read(tmp_path).features.root == "world"
    (tmp_path / "cabinet.xacro").write_text(text.replace("${parent}", "hall").replace("MORE", ""))
    assert read(tmp_path).features.root == "hall", "a link of the file that takes the macro"


@pytest.mark.parametrize(
    ("params", "more"),
    [
        ("prefix *origin reach", ""),
        ("prefix *origin *lid reach:=1", ""),
        ("prefix *origin reach:=1", '<xacro:macro name="shelf" params="depth"><link name="s"/></xacro:macro>'),
    ],
)
def test_macros_that_need_an_argument_or_a_choice_are_listed(tmp_path: Path, params: str, more: str) -> None:
    (tmp_path / "cabinet.xacro").write_text(MACRO.replace("PARAMS", params).replace("MORE", more))
    error = refused(tmp_path)
    assert error.code == "xacro_macros" and f"cabinet ({params})" in str(error) and "<xacro:cabinet" in str(error)
    assert ("shelf (depth)" in str(error)) == bool(more)


def test_a_macro_is_chosen_of_several_by_its_name(tmp_path: Path) -> None:
    """Also of those that an included file defines, or another uses; their arguments at their defaults."""
    shelf = '<xacro:macro name="shelf" params="depth height:=1"><xacro:board name="s"/></xacro:macro>'
    (tmp_path / "cabinet.xacro").write_text(MACRO.replace("PARAMS", "prefix *origin reach:=1.5").replace("MORE", shelf))
    file = tmp_path / "all.xacro"
    file.write_text(
        '<robot name="all" xmlns:xacro="http://www.ros.org/x"><xacro:include filename="cabinet.xacro"/></robot>'
    )

    def chosen(macro: str) -> Extraction:
        ref = AssetRef(asset_id="a", path=str(file), root=str(tmp_path))
        return extract(ref, inputs=InputSettings(macro=macro))

    assert chosen("cabinet").features.joint("hinge").upper == 1.5
    assert [link.name for link in chosen("board").features.links] == ["object"]
    for macro, said in {
        "": "cabinet .*; shelf .*--macro",
        "cupboard": "'cupboard'.*cabinet",
        "shelf": "for depth:",
    }.items():
        with pytest.raises(AssetError, match=said) as raised:
            chosen(macro)
        assert raised.value.code == "xacro_macros" and "all.xacro" in str(raised.value)


def test_a_package_is_found_by_folder_manifest_or_place(tmp_path: Path) -> None:
    inner = tmp_path / "thing" / "urdf"
    inner.mkdir(parents=True)
    (tmp_path / "other").mkdir()
    above = [inner, inner.parent, tmp_path]
    assert find_package("thing", above) == inner.parent
    assert find_package("other", above) == tmp_path / "other"
    assert find_package("unheard_of", above) == inner.parent, "the folder above urdf/"
    (tmp_path / "package.xml").write_text("<package><name> whole </name></package>")
    assert find_package("whole", above) == tmp_path


@pytest.mark.parametrize(
    ("text", "code", "said"),
    [
        ("<sdf><model/><model/></sdf>", "sdf_models", "2 in <sdf>"),
        ("<world/>", "sdf_models", "gz sdf"),
        ("<sdf><model>", "not_xml", "export the SDF again"),
        (sdf().replace('type="revolute"', 'type="spring"'), "sdf_joint", "joint 'door_hinge' is spring"),
        (sdf().replace("<parent>body<", "<parent>bod<", 1), "sdf_joint", "its parent 'bod' is not a link"),
        (sdf().replace("<link name", "<include/><link name", 1), "sdf_nested", "<include>"),
        (
            sdf(door_joint='<pose relative_to="gone">0 0 0 0 0 0</pose>'),
            "sdf_frame",
            "'gone', which is not in the model",
        ),
        (sdf(door_joint="<pose>0 0 a 0 0 0</pose>"), "sdf_number", "'door_hinge'"),
    ],
)
def test_an_sdf_that_no_urdf_can_say_is_refused(tmp_path: Path, text: str, code: str, said: str) -> None:
    (tmp_path / "model.sdf").write_text(text)
    error = refused(tmp_path)
    assert error.code == code and said in str(error) and "model.sdf" in str(error)


def test_sdf_frames_axes_and_the_world(tmp_path: Path) -> None:
    frame = '<frame name="f" attached_to="body"><pose degrees="true">0.212 -0.24 0.15 0 90 0</pose></frame>'
    text = sdf(door_joint='<pose relative_to="f">0 0 0 0 0 0</pose>', axis="<xyz>1 0 0</xyz>")
    held = '<joint name="floor" type="fixed"><parent>world</parent><child>body</child></joint></model>'
    (tmp_path / "model.sdf").write_text(
        text.replace('<link name="door"', frame + '<link name="door"').replace("</model>", held)
    )
    found = read(tmp_path)
    assert is_the_cabinet(found), "x of a frame pitched by a quarter turn points down"
    assert any("fixed to the world" in finding.message for finding in found.findings)


@pytest.mark.parametrize(
    ("kind", "rest", "axes"),
    [
        ("revolute2", "<axis2><xyz>0 1 0</xyz></axis2>", ["0 0 1", "0 1 0"]),
        ("universal", "<axis2><xyz>0 1 0</xyz></axis2>", ["0 0 1", "0 1 0"]),
        ("revolute2", "<axis2><xyz>0 1 0</xyz></axis2>LOCKED", ["0 1 0"]),
        ("ball", "", ["1 0 0", "0 1 0", "0 0 1"]),
        ("screw", "<thread_pitch>500</thread_pitch>", ["0 0 1"]),
    ],
)
def test_an_sdf_joint_of_several_axes_is_a_chain_of_hinges(
    tmp_path: Path, kind: str, rest: str, axes: list[str]
) -> None:
    limit = "<limit><lower>0</lower><upper>0</upper></limit>" if "LOCKED" in rest else ""
    joint = (
        f'<joint name="j" type="{kind}"><parent>body</parent><child>wheel</child><axis><xyz>0 0 1</xyz>{limit}</axis>'
        f'{rest.replace("LOCKED", "")}</joint><joint name="gears" type="gearbox"><parent>body</parent>'
        "<child>wheel</child></joint>"
    )
    wheel = '<link name="wheel"><pose>0.3 0 0 0 0 0</pose></link>'
    (tmp_path / "model.sdf").write_text(
        f'<sdf version="1.7"><model name="cart"><link name="body"/>{wheel}{joint}</model></sdf>'
    )
    made = urdf_of_sdf(tmp_path / "model.sdf", tmp_path, ANYWHERE)
    joints = made.robot.findall("joint")
    found = [str(item.get("xyz")) for joint in joints for item in joint.findall("axis")]
    assert found == axes and [joint.get("type") for joint in joints] == ["continuous"] * len(axes)
    parents, children = ([str(joint.find(end).get("link")) for joint in joints] for end in ("parent", "child"))  # type: ignore[union-attr]
    assert parents == ["body", *children[:-1]] and children[-1] == "wheel"
    assert {str(link.get("name")) for link in made.robot.findall("link")} == {"body", *children}
    origins = [str(item.get("xyz")) for joint in joints for item in joint.findall("origin")]
    assert origins == ["0.3 0 0", *["0 0 0"] * (len(axes) - 1)]
    assert "gearbox 'gears' is left out" in str(made.notes) and ("thread" in str(made.notes)) == (kind == "screw")


ARM = '<geom size="1"/><body name="c"><joint/><geom size="1"/></body>'


@pytest.mark.parametrize(
    ("old", "new", "code", "said"),
    [
        ("<freejoint/>", "<freejoint/><geom type=\"bad\"/>", "mjcf_refused", "bad"),
        ("</worldbody>", f'<body name="b"><freejoint/>{ARM}</body></worldbody>', "mjcf_objects", "(body, b)"),
        (MJCF[MJCF.index("<worldbody>") : MJCF.index("</worldbody>")], "<worldbody>", "mjcf_bodies", "no body"),
    ],
)  # fmt: skip
def test_an_mjcf_that_no_urdf_can_say_is_refused(tmp_path: Path, old: str, new: str, code: str, said: str) -> None:
    folder = written_cabinet(tmp_path / "one", "mjcf")
    (folder / "thing.xml").write_text(MJCF.replace(old, new))
    error = refused(folder)
    assert error.code == code and said in str(error) and "thing.xml" in str(error)


@pytest.mark.parametrize("version", ["1.4", "1.7"])
def test_a_nested_model_stands_where_its_own_pose_puts_it(tmp_path: Path, version: str) -> None:
    """The frame's model is turned by a quarter about z and moved by 1 m; the door hangs in it from outside, and has a
    latch of its own."""
    latch = (
        '<link name="latch"><pose>0.1 0 0 0 0 0</pose></link><joint name="turn" type="revolute"><parent>door</parent>'
        "<child>latch</child><axis><xyz>1 0 0</xyz></axis></joint>"
    )
    (tmp_path / "model.sdf").write_text(
        f'<sdf version="{version}"><model name="doorway"><model name="wall"><pose>1 0 0 0 0 1.5707963267948966</pose>'
        '<link name="frame"><pose>0.5 0 0 0 0 0</pose></link></model><model name="leaf">'
        f'<pose>1 0 0 0 0 1.5707963267948966</pose><link name="door"/>{latch}</model><joint name="hinge" '
        'type="revolute"><parent>wall::frame</parent><child>leaf::door</child><axis><xyz>0 0 1</xyz></axis></joint>'
        "</model></sdf>"
    )
    made = urdf_of_sdf(tmp_path / "model.sdf", tmp_path, ANYWHERE).robot
    assert [link.get("name") for link in made.findall("link")] == ["wall__frame", "leaf__door", "leaf__latch"]
    joints = {str(joint.get("name")): joint for joint in made.findall("joint")}
    place = {name: [float(v) for v in str(joint.find("origin").get("xyz")).split()] for name, joint in joints.items()}  # type: ignore[union-attr]
    assert place["hinge"] == pytest.approx([-0.5, 0.0, 0.0]) and place["leaf__turn"] == pytest.approx([0.1, 0.0, 0.0])
    axis = joints["leaf__turn"].find("axis")
    assert axis is not None
    assert [float(v) for v in str(axis.get("xyz")).split()] == pytest.approx([1.0, 0.0, 0.0]), "in the leaf's own frame"


def test_an_mjcf_ball_is_three_hinges(tmp_path: Path) -> None:
    folder = written_cabinet(tmp_path / "one", "mjcf")
    hinge = '<joint name="door_hinge" axis="0 0 -1" pos="0 -0.24 0" range="0 85.94366926962348"/>'
    assert hinge in MJCF
    (folder / "thing.xml").write_text(MJCF.replace(hinge, '<joint name="door_hinge" type="ball" pos="0 -0.24 0"/>'))
    found = read(folder)
    door = [joint for joint in found.features.joints if joint.name.startswith("door_hinge")]
    assert [joint.type for joint in door] == ["continuous"] * 3 and door[-1].child == "door"
    assert any("ball joint 'door_hinge' is three hinges" in finding.message for finding in found.findings)


def test_mjcf_ties_springs_and_zeros_become_urdf(tmp_path: Path) -> None:
    folder = written_cabinet(tmp_path / "one", "mjcf")
    slide = (
        'type="slide" axis="1 0 0" range="0 0.2" ref="0.05" springref="0.15" stiffness="7" damping="3" frictionloss="2"'
    )
    tie = '<equality><joint joint1="drawer_slide" joint2="door_hinge" polycoef="0.01 0.5 0 0 0"/></equality></mujoco>'
    text = MJCF.replace('type="slide" axis="1 0 0" range="0 0.2"', slide).replace("</mujoco>", tie)
    (folder / "thing.xml").write_text(text)
    found = read(folder)
    drawer = found.features.joint("drawer_slide")
    # Where MuJoCo draws it is a URDF's zero, -0.05 to 0.15; what it follows takes it no lower than 0.01.
    assert near((drawer.lower, drawer.upper), (0.01, 0.15))
    assert (drawer.damping, drawer.friction) == (3.0, 2.0)
    assert drawer.mimic is not None and drawer.mimic.joint == "door_hinge"
    assert (
        'multiplier="0.5" offset="0.01"' in found.urdf.read_text()
        and 'spring_reference="0.1"' in found.urdf.read_text()
    )


def test_a_folder_without_any_format_says_which_there_are(tmp_path: Path) -> None:
    (tmp_path / "notes.xml").write_text("<notes/>")
    assert "nor a xacro, SDF, MJCF or USD file" in str(refused(tmp_path))


def test_collada_units_are_applied_and_up_axes_are_not(tmp_path: Path) -> None:
    found = read(written_cabinet(tmp_path / "one", "collada"))
    codes = [finding.code for finding in found.findings]
    assert codes.count("collada_unit") == 1 and codes.count("collada_up_axis") == 1
    (tmp_path / "one" / "body.dae").write_text(dae((0.4, 0.5, 0.6)))
    (tmp_path / "one" / "plate.dae").write_text(dae((0.02, 0.48, 0.28)))
    plain = read(tmp_path / "one")
    assert is_the_cabinet(plain) and not any(finding.code.startswith("collada") for finding in plain.findings)


@pytest.mark.parametrize("up", [up for up in UpAxis if up is not UpAxis.Z])
@pytest.mark.parametrize("kind", ["urdf", "mjcf"])
def test_a_stated_up_axis_turns_the_whole_object(tmp_path: Path, kind: str, up: UpAxis) -> None:
    folder = written_cabinet(tmp_path / "one", kind)
    plain, turned = (extract(AssetRef(asset_id="one", path=str(folder)), up=axis) for axis in (UpAxis.Z, up))
    index = "xyz".index(up[-1])
    assert turned.features.closed_size[2] == pytest.approx(plain.features.closed_size[index])
    for joint in plain.features.joints:
        lifted = turned.features.joint(joint.name).axis_in_root[2]
        assert lifted == pytest.approx(joint.axis_in_root[index] * (-1 if up.startswith("-") else 1), abs=1e-7)
    assert turned.urdf.is_file() and turned.source == plain.source
