"""Reading a URDF: what no simulator could load is refused, and the message names the file and the link or joint."""

from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from asset2sim.assets.urdf.document import known_robot
from asset2sim.assets.urdf.read import Dynamics, read_dynamics, read_urdf
from schemas.errors import AssetError
from schemas.vocabulary import FailureMode
from tests.assets import cabinet, joint, link, read, robot, shape, written

UNREADABLE, INVALID = FailureMode.UNREADABLE_ASSET, FailureMode.INVALID_JOINT_CONFIGURATION
BOX = shape("1 1 1")
TWO = link("a", BOX) + link("b", BOX)


def hinge(name: str = "swing", parent: str = "a", child: str = "b", axis: str = "0 0 1", limit: str = "0 1") -> str:
    return joint(name, "revolute", parent, child, axis=axis, limit=limit)


def refused(folder: Path, urdf: str) -> AssetError:
    with pytest.raises(AssetError) as caught:
        read_urdf(written(folder, urdf) / "mobility.urdf")
    assert "mobility.urdf" in str(caught.value)
    return caught.value


@pytest.mark.parametrize(
    ("urdf", "code", "named"),
    [
        ("robot: a\nnot xml", "not_xml", "XML"),
        ("", "not_xml", "XML"),
        ("<robot name='a'><link name='a'>", "not_xml", "XML"),
        ("<sdf><model/></sdf>", "not_urdf", "<sdf>"),
        ("<robot name='a'/>", "no_links", "no link"),
        (robot(TWO, link("b"), hinge()), "duplicate_link", "link 'b'"),
        (robot(TWO, link("c"), hinge(), hinge(child="c")), "duplicate_joint", "joint 'swing'"),
        (robot(TWO), "roots", "a, b"),
        (robot(TWO, hinge(), hinge("back", "b", "a")), "roots", "loop"),
        (robot(TWO, link("c"), hinge("one", "b", "c"), hinge("two", "c", "b")), "loop", "b, c"),
        (robot(TWO, link("c"), hinge(), hinge("other", "c", "b")), "two_parents", "link 'b'"),
    ],
)  # fmt: skip
def test_what_is_no_tree_is_unreadable(tmp_path: Path, urdf: str, code: str, named: str) -> None:
    error = refused(tmp_path, urdf)
    assert (error.mode, error.code) == (UNREADABLE, code)
    assert named in str(error)


@pytest.mark.parametrize(
    ("urdf", "code", "said"),
    [
        (robot(TWO, hinge(child="ghost")), "unknown_link", "child 'ghost'"),
        (robot(TWO, hinge(parent="ghost")), "unknown_link", "parent 'ghost'"),
        (robot(TWO, hinge(axis="0 0 0")), "zero_axis", "axis"),
        (robot(TWO, hinge(limit="nan 1")), "not_finite", "limit lower='nan'"),
        (robot(TWO, hinge(limit="0 inf")), "not_finite", "limit upper='inf'"),
        (robot(TWO, hinge(axis="0 0 NaN")), "not_finite", "axis xyz"),
    ],
)  # fmt: skip
def test_joints_that_make_no_sense_are_named(tmp_path: Path, urdf: str, code: str, said: str) -> None:
    error = refused(tmp_path, urdf)
    assert (error.mode, error.code, error.joint) == (INVALID, code, "swing")
    assert "'swing'" in str(error) and said in str(error)


def test_a_number_that_is_not_finite_names_its_link(tmp_path: Path) -> None:
    spoilt = '<visual><origin xyz="0 -inf 0"/><geometry><box size="1 1 1"/></geometry></visual>'
    error = refused(tmp_path, robot(link("a", BOX + spoilt), link("b"), hinge()))
    assert error.code == "not_finite" and "'a'" in str(error)


def test_an_inertial_that_is_not_finite_is_left_to_extraction(tmp_path: Path) -> None:
    spoilt = '<inertial><mass value="nan"/></inertial>'
    folder = written(tmp_path, robot(link("a", BOX + spoilt), link("b"), hinge()))
    assert [item.name for item in read_urdf(folder / "mobility.urdf").links] == ["a", "b"]


def test_a_link_named_nan_is_a_name(tmp_path: Path) -> None:
    folder = written(tmp_path, robot(link("nan", BOX), link("inf"), hinge(parent="nan", child="inf")))
    assert [item.name for item in read_urdf(folder / "mobility.urdf").links] == ["nan", "inf"]


def test_a_slider_without_limits_goes_as_far_as_the_longest_link_is_long(tmp_path: Path) -> None:
    parts = link("a", shape("0.5 0.2 0.1")), link("b", shape("0.1 0.3 0.1"))
    item = read(written(tmp_path, robot(*parts, joint("slide", "prismatic", "a", "b", axis="1 0 0"))))
    slide = item.features.joint("slide")
    assert (slide.lower, slide.upper) == pytest.approx((-0.5, 0.5))
    assert [(finding.code, finding.joint) for finding in item.findings] == [("limits_supplied", "slide")]


@pytest.mark.parametrize("axis", ["0 0 1", "2 0 0", "0.6 0 -0.8"])
def test_a_planar_joint_slides_in_its_plane_and_turns_about_its_normal(tmp_path: Path, axis: str) -> None:
    normal = np.array([float(word) for word in axis.split()])
    parts = link("a", BOX), link("b", BOX), link("move_1", BOX)  # a name that the steps would take
    moves = joint("move", "planar", "a", "b", xyz="0 0 0.3", axis=axis, limit="0 1")
    features = read(written(tmp_path, robot(*parts, moves, joint("on", "fixed", "a", "move_1")))).features
    steps = [features.joint(name) for name in ("move_1_", "move_2", "move")]
    assert [step.type for step in steps] == ["prismatic", "prismatic", "continuous"]
    assert [(step.parent, step.child) for step in steps] == [("a", "move_1_"), ("move_1_", "move_2"), ("move_2", "b")]
    frame = np.array([step.axis_in_root for step in steps])
    assert frame @ frame.T == pytest.approx(np.eye(3), abs=1e-9)
    assert frame[2] == pytest.approx(normal / np.linalg.norm(normal))
    assert [step.origin_xyz for step in steps] == [(0.0, 0.0, 0.3), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)]


def test_a_part_that_floats_is_held_where_it_stands(tmp_path: Path) -> None:
    item = read(written(tmp_path, robot(TWO, joint("loose", "floating", "a", "b", xyz="0 0 2"))))
    assert item.features.joint("loose").type == "fixed" and item.features.joint("loose").origin_xyz == (0.0, 0.0, 2.0)
    assert [(finding.code, finding.joint) for finding in item.findings] == [("part_floats", "loose")]


def test_a_limit_that_is_not_stated_is_zero(tmp_path: Path) -> None:
    half = '<limit upper="0.4" effort="1" velocity="1"/>'
    extraction = read(written(tmp_path, robot(TWO, joint("pull", "prismatic", "a", "b", axis="1 0 0", more=half))))
    pull = extraction.features.joint("pull")
    assert (pull.lower, pull.upper) == (0.0, 0.4)
    assert [finding.code for finding in extraction.findings] == ["limit_completed"]


def test_half_a_limit_that_leaves_no_range_is_refused(tmp_path: Path) -> None:
    half = '<limit lower="0" effort="1" velocity="1"/>'
    folder = written(tmp_path, robot(TWO, joint("swing", "revolute", "a", "b", axis="1 0 0", more=half)))
    with pytest.raises(AssetError, match=r"mobility\.urdf.*'swing'") as caught:
        read(folder)
    assert (caught.value.mode, caught.value.code) == (INVALID, "half_limits")


def test_a_hinge_without_limits_turns_freely(tmp_path: Path) -> None:
    features = read(written(tmp_path, robot(TWO, joint("swing", "revolute", "a", "b", axis="0 0 3")))).features
    swing = features.joint("swing")
    assert (swing.type, swing.lower, swing.upper) == ("continuous", None, None)
    assert swing.axis == (0.0, 0.0, 1.0)


def test_dynamics_are_read_back_with_what_parsers_drop(tmp_path: Path) -> None:
    terms = '<dynamics damping="0.5" friction="0.25" spring_stiffness="2" spring_reference="-0.1"/>'
    urdf = robot(
        TWO, link("c"), joint("swing", "revolute", "a", "b", axis="0 0 1", limit="0 1", more=terms),
        joint("weld", "fixed", "b", "c"),
    )  # fmt: skip
    found = read_dynamics(written(tmp_path, urdf) / "mobility.urdf")
    assert found == {"swing": Dynamics(0.5, 0.25, 2.0, -0.1)}


def test_readers_share_a_document_until_it_is_written_anew_and_do_not_change_it(tmp_path: Path) -> None:
    file = written(tmp_path, cabinet()) / "mobility.urdf"
    robot = known_robot(file)
    before = etree.tostring(robot)
    first = (read_dynamics(file), read_urdf(file).links[0].name)
    assert known_robot(file) is robot and etree.tostring(robot) == before
    file.write_text(file.read_text(encoding="utf-8").replace("<joint ", "<!-- changed --><joint "), encoding="utf-8")
    assert known_robot(file) is not robot and (read_dynamics(file), read_urdf(file).links[0].name) == first
    file.unlink()
    with pytest.raises(AssetError):
        known_robot(file)
