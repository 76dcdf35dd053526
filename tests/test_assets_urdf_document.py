"""What origins write differently comes in one form: mimics resolved, capsules split, shapes and names checked."""

from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from asset2sim.assets.urdf.capsule import split_capsules
from asset2sim.assets.urdf.document import Document, read_document
from asset2sim.assets.urdf.mimic import read_mimics
from asset2sim.assets.urdf.read import element_pose
from asset2sim.physics.kinematics import link_to_root, moved_links, tree_of
from schemas.errors import AssetError
from schemas.features import Mimic
from tests.assets import joint, link, read, robot, shape, written
from tests.origins import floats, gears, gripper, lost_mimics

BOX = shape("1 1 1")


def document(folder: Path, urdf: str | bytes) -> Document:
    path = written(folder, "") / "mobility.urdf"
    path.write_bytes(urdf.encode() if isinstance(urdf, str) else urdf)
    return read_document(path)


def test_a_chain_of_mimics_follows_its_first(tmp_path: Path) -> None:
    """dial = −10 · right + 0.2 and right = −left: dial = 10 · left + 0.2."""
    found = read_mimics(document(tmp_path, gripper().urdf).robot)
    assert found == {
        "right_slide": Mimic(joint="left_slide", multiplier=-1.0),
        "dial_turn": Mimic(joint="left_slide", multiplier=10.0, offset=0.2),
    }


def test_unusable_mimics_end_and_are_told(tmp_path: Path) -> None:
    found = document(tmp_path, lost_mimics().urdf)
    assert read_mimics(found.robot) == {}
    assert sorted(str(item.joint) for item in found.findings) == ["lost", "one", "own", "stuck", "two"]


@pytest.mark.parametrize("mimic", ["multiplier='0'", "multiplier='nan'", "offset='x'"])
def test_a_mimic_whose_numbers_make_no_sense_is_dropped(tmp_path: Path, mimic: str) -> None:
    limits = {"axis": "0 0 1", "limit": "0 1"}
    urdf = robot(
        link("a", BOX), link("b", BOX), link("c", BOX), joint("lead", "revolute", "a", "b", **limits),
        joint("own", "revolute", "a", "c", more=f"<mimic joint='lead' {mimic}/>", **limits),
    )  # fmt: skip
    assert [item.code for item in document(tmp_path, urdf).findings] == ["mimic_unusable"]


def test_followers_move_with_their_leader(tmp_path: Path) -> None:
    """The pinion of the gear pair turns by −2 · 0.3 + 0.1 = −0.5 rad, and its range is that of ±0.5 rad."""
    features = read(written(tmp_path, str(gears().urdf))).features
    tree = tree_of(features.joints)
    pose = link_to_root(tree, features.root, {"drive": 0.3, "driven": 1.0})["pinion"]
    assert np.arctan2(pose[1, 0], pose[0, 0]) == pytest.approx(-0.5)
    assert set(moved_links(tree, "drive")) == {"wheel", "pinion"}
    driven = features.joint("driven")
    assert (driven.lower, driven.upper) == pytest.approx((-0.9, 1.1))


def test_at_another_scale_sliders_follow_in_metres(tmp_path: Path) -> None:
    features = read(written(tmp_path, str(gripper().urdf))).features
    pose = link_to_root(tree_of(features.joints, 0.5), features.root, {"left_slide": 0.02})
    assert pose["right"][1, 3] == pytest.approx(-0.5 * 0.02 - 0.02)
    assert np.arctan2(pose["dial"][1, 0], pose["dial"][0, 0]) == pytest.approx(10.0 * 0.04 + 0.2)


def test_a_leader_without_limits_gets_its_followers(tmp_path: Path) -> None:
    """A pinion that turns for ever, with a rack of 0 to 0.1 m at 0.05 m/rad: 0 to 2 rad."""
    urdf = robot(
        link("a", BOX), link("b", BOX), link("c", BOX), joint("turn", "continuous", "a", "b", axis="0 0 1"),
        joint("rack", "prismatic", "a", "c", axis="1 0 0", limit="0 0.1",
              more="<mimic joint='turn' multiplier='0.05'/>"),
    )  # fmt: skip
    extraction = read(written(tmp_path, urdf))
    turn = extraction.features.joint("turn")
    assert (turn.type, turn.lower) == ("revolute", 0.0) and turn.upper == pytest.approx(2.0)
    assert [item.code for item in extraction.findings] == ["mimic", "mimic_limits"]


def test_a_capsule_is_a_cylinder_and_two_balls_at_its_ends() -> None:
    text = '<collision name="own"><origin xyz="1 0 0" rpy="0 1.5707963267948966 0"/><geometry><capsule radius="0.1" length="0.6"/></geometry></collision>'  # noqa: E501
    element = etree.fromstring(f"<link name='a'>{text}</link>")
    split_capsules(element)
    found = [(item[1][0].tag, element_pose(item)[:3, 3].tolist()) for item in element.findall("collision")]
    assert [kind for kind, _ in found] == ["cylinder", "sphere", "sphere"]
    # Turned by a right angle about y, its axis is x.
    ends = sorted(place for kind, place in found if kind == "sphere")
    assert ends == [pytest.approx([0.7, 0.0, 0.0], abs=1e-9), pytest.approx([1.3, 0.0, 0.0], abs=1e-9)]


def test_a_shape_that_urdf_does_not_know_is_left_out(tmp_path: Path) -> None:
    odd = "<collision><geometry><cone radius='1'/></geometry></collision><visual><geometry/></visual>"
    found = document(tmp_path, robot(link("a", BOX + odd)))
    assert [(item.code, item.link) for item in found.findings] == [("unknown_shape", "a")] * 2
    assert [len(found.robot.findall(f"link/{tag}")) for tag in ("visual", "collision")] == [1, 1]


@pytest.mark.parametrize(
    ("urdf", "said"),
    [
        ("<robot name='r'><link/></robot>", "<link> number 1"),
        ("<robot name='r'><link name='a'/><joint name='j' type='fixed'><parent link='a'/></joint></robot>", "no child"),
    ],
)
def test_what_lacks_a_name_or_an_end_is_said(tmp_path: Path, urdf: str, said: str) -> None:
    with pytest.raises(AssetError, match=said):
        document(tmp_path, urdf)


def test_a_default_namespace_goes_and_prefixes_stay(tmp_path: Path) -> None:
    found = document(
        tmp_path, "<robot xmlns='http://u' xmlns:g='http://g' name='r'><link name='a'/><g:sensor g:rate='5'/></robot>"
    )
    assert [item.tag for item in found.robot] == ["link", "{http://g}sensor"]
    assert "xmlns=" not in etree.tostring(found.robot).decode()


def test_a_floating_joint_is_left_out_on_a_bare_root_and_fixed_on_one_with_a_shape(tmp_path: Path) -> None:
    urdf = str(floats().urdf)
    robot_alone = document(tmp_path, urdf).robot
    assert [item.get("name") for item in robot_alone if item.tag in ("link", "joint")] == ["body", "door", "hinge"]
    held = document(tmp_path, urdf.replace('<link name="world"></link>', link("world", BOX)))
    assert [(item.code, item.joint) for item in held.findings] == [("part_floats", "free")]
    assert {str(item.get("name")): item.get("type") for item in held.robot.findall("joint")}["free"] == "fixed"


SMALL = '<robot name="r"><link name="base"/></robot>'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (f'<?xml version="0.0" ?>{SMALL}', "Unsupported version '0.0'"),
        (f'\n<?xml version="1.0"?>{SMALL}', "XML declaration allowed only at the start"),
        (SMALL.replace("<link", "<!-- a -- b -->\n<link"), "Double hyphen within comment"),
        (SMALL.replace("<link", "<xacro:include/><link"), "Namespace prefix xacro on include is not defined"),
        (SMALL.replace("<link", "<a:b c:d='1'><e:f/></a:b><link"), "Namespace prefix c for d on b is not defined"),
    ],
)
def test_mistakes_beside_the_content_are_passed_over_and_said(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "a.urdf"
    path.write_text(text, encoding="utf-8")
    document = read_document(path)
    assert [link.get("name") for link in document.robot.findall("link")] == ["base"]
    recovered = [finding for finding in document.findings if finding.code == "xml_recovered"]
    assert len(recovered) == 1 and f"a.urdf: {said}" in recovered[0].message
    etree.fromstring(etree.tostring(document.robot))  # engines read what is written of it, and recover nothing


@pytest.mark.parametrize(
    "text",
    [SMALL[:-9], SMALL[:-20], f"{SMALL}{SMALL}", SMALL.replace('"base"', "base"), SMALL.replace("/>", "><joint>"), ""],
)
def test_a_file_that_lost_content_is_no_xml(text: str, tmp_path: Path) -> None:
    """What a recovering parser would read of it is not what its author wrote."""
    for before in ('<?xml version="0.0" ?>', "<!-- a -- b -->"):
        (tmp_path / "a.urdf").write_text(f"{before}{text}", encoding="utf-8")
        with pytest.raises(AssetError, match=r"a\.urdf: not readable as XML"):
            read_document(tmp_path / "a.urdf")


@pytest.mark.parametrize(("text", "said"), [
    ("version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "Git LFS pointer, not the URDF: run `git lfs pull`"),
    ("<!doctype html><html><body>404</body></html>", "web page, likely of a download that failed: download the URDF"),
    ("<robot name='a'><link name='b'", "line 1, column"),
])  # fmt: skip
def test_a_file_of_another_kind_is_called_what_it_is(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(AssetError, match=said) as refused:
        document(tmp_path, text)
    assert "<string>" not in str(refused.value)


def test_infinite_limits_are_none_and_decimal_commas_are_named(tmp_path: Path) -> None:
    endless = robot(link("a", BOX), link("b", BOX), joint("j", "revolute", "a", "b", axis="0 0 1", limit="-inf inf"))
    found = document(tmp_path, endless.replace("<limit ", "<limit effort='inf' velocity='NaN' ", 1))
    turning = found.robot.find("joint")
    assert turning is not None and turning.get("type") == "continuous"
    assert [item.code for item in found.findings] == ["limits_unlimited"]
    sliding = endless.replace('"revolute"', '"prismatic"').replace("'revolute'", "'prismatic'")
    with pytest.raises(AssetError, match="is not finite"):
        document(tmp_path, sliding)
    german = robot(link("a", BOX), link("b", BOX), joint("j", "fixed", "a", "b", xyz="0,3 0 0"))
    with pytest.raises(AssetError, match="with a point and no comma"):
        document(tmp_path, german)
    listed = document(tmp_path, german.replace("0,3 0 0", "0.3,0,0")).robot.find("joint/origin")
    assert listed is not None and listed.get("xyz") == "0.3 0 0"


def test_a_joint_from_a_link_to_itself_is_named(tmp_path: Path) -> None:
    with pytest.raises(AssetError, match="'j': its parent and its child are both 'a'"):
        read(written(tmp_path, robot(link("a", BOX), link("b", BOX), joint("j", "fixed", "a", "a"))))
