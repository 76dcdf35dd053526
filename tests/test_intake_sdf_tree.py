"""SDF whose joints name frames, close loops, hang the other way round, and models of several loose or still links."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asset2sim.assets.urdf.read import element_joint
from asset2sim.assets.urdf.references import ANYWHERE
from asset2sim.intake.formats.sdf import urdf_of_sdf
from asset2sim.intake.robots import without_robots
from asset2sim.intake.split import parts_of
from asset2sim.physics.kinematics import link_to_root, parents_first
from schemas.errors import AssetError

BOX = "<collision name='c'><geometry><box><size>.1 .1 .1</size></box></geometry></collision>"
PLACES = {"a": "0 0 0", "b": "1 0 0", "c": "1 2 0"}
LINKS = [f"<link name='{name}'><pose>{xyz} 0 0 .3</pose>{BOX}</link>" for name, xyz in PLACES.items()]


def hinge(name: str, ends: tuple[str, str], axis: str = "0 0 1", more: str = "") -> str:
    first, second = ends
    inner = f"<parent>{first}</parent><child>{second}</child>{more}<axis><xyz>{axis}</xyz></axis>"
    return f"<joint name='{name}' type='revolute'>{inner}</joint>"


def made(folder: Path, *inside: str, holder: str = "model name='thing'") -> Any:
    """The URDF made of a model, or of a world."""
    (folder / "thing.sdf").write_text(f"<sdf version='1.8'><{holder}>{''.join(inside)}</{holder.split()[0]}></sdf>")
    return urdf_of_sdf(folder / "thing.sdf", folder, ANYWHERE)


def ways(robot: Any) -> dict[str, tuple[str, str]]:
    """Joint → its parent and child."""
    return {joint.name: (joint.parent, joint.child) for joint in map(element_joint, robot.findall("joint"))}


def places(robot: Any, root: str, positions: dict[str, float]) -> dict[str, Any]:
    """Link → its (4, 4) place below the root's, each joint at its position, rad."""
    return link_to_root(parents_first([element_joint(joint) for joint in robot.findall("joint")]), root, positions)


@pytest.mark.parametrize("axis", ["0 0 1", "0 1 0", "-.6 0 .8"])
def test_a_joint_stated_the_other_way_round_turns_as_it_did(tmp_path: Path, axis: str) -> None:
    near = hinge("near", ("a", "b"))
    plain = made(tmp_path, *LINKS, near, hinge("far", ("b", "c"), axis, "<pose>.2 .1 0 0 .4 0</pose>")).robot
    # the same joint from c to b: its frame is where it was, which b states now, and its axis points the other way
    other = "<pose relative_to='c'>.2 .1 0 0 .4 0</pose>"
    reversed_axis = " ".join(f"{-float(word):g}" for word in axis.split())
    turned = made(tmp_path, *LINKS, near, hinge("far", ("c", "b"), reversed_axis, other)).robot
    assert ways(turned) == ways(plain) == {"near": ("a", "b"), "far": ("b", "c")}
    for angle in (0.0, 0.7):
        found, expected = (places(robot, "a", {"near": 0.2, "far": angle})["c"] for robot in (turned, plain))
        assert found == pytest.approx(expected, abs=1e-7)


@pytest.mark.system
def test_a_joint_that_its_loop_holds_is_fixed_and_named(tmp_path: Path) -> None:
    follows = "<mimic joint='last'><multiplier>2</multiplier></mimic>"
    near = hinge("near", ("a", "b")).replace("<xyz>", f"{follows}<xyz>")
    found = made(tmp_path, *LINKS, near, hinge("far", ("b", "c")), hinge("last", ("a", "c")))
    assert ways(found.robot) == {"near": ("a", "b"), "far": ("b", "c")}
    assert any("the loop that 'far' moves" in note for note in found.notes)
    assert found.robot.find("joint/mimic") is None
    assert [joint.get("type") for joint in found.robot.findall("joint")] == ["fixed", "continuous"]


@pytest.mark.system
@pytest.mark.parametrize(("parent", "last"), [("c", "d"), ("d", "c")])
def test_what_a_loop_ties_follows_the_joint_that_leads_it(parent: str, last: str, tmp_path: Path) -> None:
    """A parallelogram: its two cranks turn alike, its coupler stays parallel to its base, whichever end is stated."""
    at = {"a": "0 0 0", "b": "0 .15 0", "c": ".1 .3 0", "d": ".2 .15 0"}
    links = [f"<link name='{name}'><pose>{place} 0 0 0</pose>{BOX}</link>" for name, place in at.items()]
    ends = (("one", "a", "b", "0 -.15 0"), ("two", "b", "c", "-.1 0 0"), ("three", "a", "d", "0 -.15 0"),
            ("four", parent, last, ".1 0 0" if last == "c" else "0 .15 0"))  # fmt: skip
    joints = [hinge(name, (one, other), more=f"<pose>{pose} 0 0 0</pose>") for name, one, other, pose in ends]
    found = made(tmp_path, *links, *joints)
    ratios = {str(joint.get("name")): float(str(follows.get("multiplier")))
              for joint in found.robot.findall("joint") for follows in joint.findall("mimic")}  # fmt: skip
    assert ratios == {"two": pytest.approx(-1.0, abs=1e-4), "three": pytest.approx(1.0, abs=1e-4)}
    assert any("the loop that 'one' moves" in note for note in found.notes), found.notes
    (joined,) = found.robot.findall("disable_collisions")
    assert {joined.get("link1"), joined.get("link2")} == {"c", "d"}, "as links that a joint ties"


def test_a_joint_that_closes_a_loop_of_several_freedoms_is_left_out_and_named(tmp_path: Path) -> None:
    ball = "<joint name='last' type='ball'><parent>a</parent><child>c</child></joint>"
    found = made(tmp_path, *LINKS, hinge("near", ("a", "b")), hinge("far", ("b", "c")), ball)
    assert any("joint 'last' closes a loop" in note for note in found.notes)


def test_the_ends_of_a_joint_may_be_frames_and_models(tmp_path: Path) -> None:
    frames = "<frame name='at' attached_to='b'><pose>0 0 .5 0 0 0</pose></frame><frame name='on' attached_to='at'/>"
    inner = f"<model name='in'><pose>0 5 0 0 0 0</pose><link name='first'>{BOX}</link></model>"
    joints = hinge("near", ("a", "on")), hinge("far", ("on", "in")), hinge("further", ("in::first", "c"))
    robot = made(tmp_path, *LINKS, frames, inner, *joints).robot
    assert ways(robot) == {"near": ("a", "b"), "far": ("b", "in__first"), "further": ("in__first", "c")}
    found = places(robot, "a", {})
    turn = element_joint(robot.find("joint[@name='near']"))
    assert turn.child_to_parent[:3, 3] == pytest.approx(np.array([np.cos(0.3), -np.sin(0.3), 0.5]), abs=1e-6)
    assert np.linalg.norm(found["in__first"][:3, 3]) == pytest.approx(5.0, abs=1e-6)


def test_a_link_without_shape_called_as_the_world_is_the_world(tmp_path: Path) -> None:
    rail = hinge("rail", ("world", "a")).replace("revolute", "prismatic")
    robot = made(tmp_path, "<link name='world'/>", *LINKS[:2], rail, hinge("near", ("a", "b"))).robot
    assert ways(robot) == {"rail": ("base", "a"), "near": ("a", "b")}
    held = hinge("held", ("world", "a")).replace("revolute", "fixed")
    found = made(tmp_path, "<link name='world'/>", *LINKS[:2], held, hinge("near", ("a", "b")))
    assert ways(found.robot) == {"near": ("a", "b")} and "link 'a' is fixed to the world" in found.notes


def test_the_world_may_be_the_child(tmp_path: Path) -> None:
    robot = made(tmp_path, *LINKS[:2], hinge("foot", ("a", "world")), hinge("near", ("a", "b"))).robot
    assert ways(robot) == {"foot": ("base", "a"), "near": ("a", "b")}


def test_the_walls_of_a_still_model_are_one_object(tmp_path: Path) -> None:
    found = made(tmp_path, "<static>1</static>", *LINKS)
    assert {parent for parent, _ in ways(found.robot).values()} == {"base"} and not found.free
    assert places(found.robot, "base", {})["c"][:3, 3] == pytest.approx([1.0, 2.0, 0.0])
    assert parts_of(found) == ()


def test_loose_links_of_a_model_are_parts(tmp_path: Path) -> None:
    found = made(tmp_path, *LINKS, hinge("near", ("a", "b")))
    assert [(part.name, part.free) for part in parts_of(found)] == [("a", True), ("c", True)]


def test_models_of_one_name_stand_where_each_stands(tmp_path: Path) -> None:
    model = "<model name='m'><static>1</static><pose>{} 0 0 0 0 0</pose><link name='l'>" + BOX + "</link></model>"
    robot = made(tmp_path, model.format(1), model.format(4), holder="world name='w'").robot
    placed = places(robot, "base", {})
    assert sorted(float(pose[0, 3]) for name, pose in placed.items() if name != "base") == [1.0, 4.0]


def test_links_between_axes_have_names_of_their_own(tmp_path: Path) -> None:
    links = [text.replace("'c'", "'b_1'", 1) for text in LINKS]
    ball = hinge("ball", ("a", "b")).replace("revolute", "ball")
    robot = made(tmp_path, *links, ball, hinge("far", ("b", "b_1"))).robot
    names = [link.get("name") for link in robot.findall("link")]
    assert len({*names}) == len(names)


def test_of_a_world_of_nothing_but_absent_models_each_is_named(tmp_path: Path) -> None:
    names = "".join(f"<include><uri>model://{name}</uri></include>" for name in ("sun", "walker"))
    with pytest.raises(AssetError, match="model://sun, model://walker' is not there") as caught:
        made(tmp_path, names, holder="world name='w'")
    assert caught.value.code == "sdf_nested"


def test_a_file_may_include_its_one_model(tmp_path: Path) -> None:
    (tmp_path / "shelf").mkdir()
    made(tmp_path / "shelf", *LINKS[:2], hinge("near", ("a", "b")))
    (tmp_path / "shelf" / "thing.sdf").rename(tmp_path / "shelf" / "model.sdf")
    (tmp_path / "room.sdf").write_text("<sdf version='1.8'><include><uri>model://shelf</uri></include></sdf>")
    found = urdf_of_sdf(tmp_path / "room.sdf", tmp_path, ANYWHERE)
    assert ways(found.robot) == {"near": ("a", "b")} and [file.name for file in found.files] == ["model.sdf"]
    (tmp_path / "room.sdf").write_text("<sdf version='1.8'><include><uri>https://x.org/chair</uri></include></sdf>")
    with pytest.raises(AssetError, match="chair' is not there"):
        urdf_of_sdf(tmp_path / "room.sdf", tmp_path, ANYWHERE)


@pytest.mark.parametrize(
    ("links", "axis", "code", "said"),
    [
        (LINKS[:2], "0 1", "sdf_number", "<xyz> of joint 'near', line 1: it is not three finite numbers"),
        (LINKS[:2], "0 0 z", "sdf_number", "<xyz> of joint 'near', line 1"),
        (LINKS[:2], "0 0 nan", "sdf_number", "three finite numbers"),
        ([LINKS[0], *LINKS[:2]], "0 0 1", "sdf_name", "two of its links are called 'a'"),
        ([LINKS[0], LINKS[1].replace(" 0 0 .3<", " 0 0<")], "0 0 1", "sdf_number", "<pose> of link 'b', line 1"),
    ],
)
def test_what_is_wrong_is_named_with_its_joint_or_link_and_line(
    tmp_path: Path, links: list[str], axis: str, code: str, said: str
) -> None:
    with pytest.raises(AssetError, match=r"thing\.sdf") as caught:
        made(tmp_path, *links, hinge("near", ("a", "b"), axis))
    assert caught.value.code == code and said in str(caught.value), str(caught.value)


def test_a_static_model_is_held_and_what_has_no_name_gets_one(tmp_path: Path) -> None:
    nameless = [hinge("", ends).replace(" name=''", "") for ends in (("a", "b"), ("b", "c"))]
    found = made(tmp_path, "<static>true</static>", *LINKS, *nameless)
    assert ways(found.robot) == {"joint_1": ("a", "b"), "joint_2": ("b", "c")}
    assert "static" in found.held and not made(tmp_path, *LINKS, *nameless).held


def test_a_mass_without_an_inertia_is_kept(tmp_path: Path) -> None:
    heavy = LINKS[0].replace("<pose>", "<inertial><mass>3</mass></inertial><pose>", 1)
    found = made(tmp_path, heavy).robot.find("link/inertial")
    assert found.find("mass").get("value") == "3" and found.find("inertia").get("ixx") == "0"


def test_an_empty_element_has_gazebos_default(tmp_path: Path) -> None:
    heavy = "<inertial><mass>3</mass><inertia><ixx> </ixx></inertia></inertial><pose/>"
    limit = "<limit><lower>\n</lower><upper>1</upper></limit>"
    robot = made(
        tmp_path, LINKS[0].replace("<pose>", f"{heavy}<pose>", 1), LINKS[1], hinge("h", ("a", "b"), more=limit)
    )
    found, stated = robot.robot.find("link/inertial/inertia"), robot.robot.find("joint/limit")
    assert float(found.get("ixx")) == 1.0 and float(stated.get("lower")) == 0.0


def test_limits_beside_an_axis_are_its_limits(tmp_path: Path) -> None:
    limit = "<limit><lower>-0.5</lower><upper>1.5</upper></limit>"
    found = made(tmp_path, *LINKS[:2], hinge("h", ("a", "b"), more=limit))
    (stated,) = found.robot.findall("joint/limit")
    assert (float(stated.get("lower")), float(stated.get("upper"))) == (-0.5, 1.5)
    assert any("beside its axis" in note for note in found.notes)


def test_poses_are_relative_to_frames_of_the_world_and_to_other_models(tmp_path: Path) -> None:
    corner = "<frame name='corner'><pose>1 2 0 0 0 1.5707963267948966</pose></frame>"
    model = "<model name='{0}'><static>1</static><pose relative_to='{1}'>1 0 0 0 0 0</pose>{2}</model>"
    shelf, lamp = model.format("shelf", "corner", LINKS[0]), model.format("lamp", "shelf", LINKS[1])
    cup, held = model.format("cup", "shelf::a", LINKS[0]), hinge("held", ("shelf::a", "lamp::b"))
    for joined in ("", held):
        robot = made(tmp_path, corner, shelf, lamp, cup, joined, holder="world name='w'").robot
        found = places(robot, "base", {})
        expected = {"shelf__a": (1.0, 3.0), "lamp__b": (1.0, 5.0), "cup__a": (1.0 - np.sin(0.3), 3.0 + np.cos(0.3))}
        assert {name: (found[name][0, 3], found[name][1, 3]) for name in expected} == {
            name: pytest.approx(place, abs=1e-6) for name, place in expected.items()
        }
    assert ways(robot)["held"] == ("shelf__a", "lamp__b")


def test_an_arm_beside_a_model_of_a_world_is_left_out(tmp_path: Path) -> None:
    arm = [
        *(f"<link name='l{n}'>{BOX}</link>" for n in range(8)),
        *(hinge(f"j{n}", (f"l{n}", f"l{n + 1}")) for n in range(7)),
    ]
    models = f"<model name='arm'>{''.join(arm)}{hinge('foot', ('world', 'l0')).replace('revolute', 'fixed')}</model>"
    door = f"<model name='door'>{LINKS[0]}{LINKS[1]}{hinge('turn', ('a', 'b'))}</model>"
    found = without_robots(made(tmp_path, models, door, holder="world name='w'"))
    assert {name.split("__")[0] for name in ways(found.robot)} == {"door"}
    assert any("robot 'arm__l0' with its 8 links" in note for note in found.notes)
