"""Robots in a scene's file: left out where they stand beside an object, and nothing else is."""

from pathlib import Path

import pytest
from lxml import etree

from asset2sim.intake.formats.format import Converted
from asset2sim.intake.robots import without_robots
from tests.assets import joint, link, read, robot, shape, written

CABINET = link("cabinet", shape("0.4 0.4 0.4")) + link("door", shape("0.02 0.4 0.4"))
HUNG = joint("stands", "fixed", "world", "cabinet") + joint("door_hinge", "revolute", "cabinet", "door",
                                                          axis="0 0 1", limit="0 1.5")  # fmt: skip


def chain(count: int, limit: str, name: str = "part") -> str:
    """So many links in a row below ``world``, each hinged on the one before."""
    links = "".join(link(f"{name}_{n}", shape("0.1 0.1 0.1")) for n in range(count + 1))
    joints = "".join(
        joint(f"{name}_joint_{n}", "revolute", f"{name}_{n}", f"{name}_{n + 1}", axis="0 1 0", limit=limit)
        for n in range(count)
    )
    return links + joint(f"{name}_stands", "fixed", "world", f"{name}_0") + joints


@pytest.mark.parametrize(
    ("beside", "driven", "leaves"),
    [
        (chain(7, "-2.8 2.8"), 0, True),
        (chain(4, "-0.5 0.5", "panda"), 0, True),
        (chain(5, "-0.5 0.5"), 5, True),
        (chain(5, "-2.8 2.8"), 0, False),
        (chain(7, "-0.4 0.4"), 0, False),
        (chain(3, "-2.8 2.8", "arm"), 3, False),
        (chain(20, "-2.8 2.8"), 0, False),
        (chain(4, "-0.5 0.5", "alarm"), 1, False),
    ],
    ids=["arm", "small arm", "motors", "lamp", "blinds", "short", "hose", "one motor"],
)
def test_a_robot_is_told_from_furniture(beside: str, driven: int, leaves: bool) -> None:
    text = robot(link("world"), CABINET, HUNG, beside)
    motors = frozenset(f"{name}_joint_{n}" for name in ("part", "arm", "alarm") for n in range(driven))
    made = without_robots(Converted(etree.fromstring(text.split("?>")[1]), driven=motors))
    left = {str(item.get("name")) for item in made.robot.findall("link")}
    assert (left == {"world", "cabinet", "door"}) is leaves
    assert ({str(item.get("name")) for item in made.robot.findall("joint")} == {"stands", "door_hinge"}) is leaves
    assert ("robot '" in str(made.notes)) is leaves


def test_a_robot_alone_is_the_object() -> None:
    made = without_robots(Converted(etree.fromstring(robot(link("world"), chain(7, "-2.8 2.8")).split("?>")[1])))
    assert len(made.robot.findall("link")) == 9 and not made.notes


def test_an_object_that_is_then_alone_and_free_is_free_of_the_world() -> None:
    text = robot(link("base"), CABINET, HUNG, chain(7, "-2.8 2.8")).replace('"world"', '"base"')
    note = "cabinet: free in it, and fixed where they stand; --split keeps them free"
    made = without_robots(
        Converted(etree.fromstring(text.split("?>")[1]), notes=(note,), world="base", free=("cabinet",))
    )
    assert {str(item.get("name")) for item in made.robot.findall("link")} == {"cabinet", "door"}
    assert (made.world, made.free) == ("", ()) and note not in made.notes


def test_a_robot_s_names_stay_out_of_what_is_read(tmp_path: Path) -> None:
    tags = '<gazebo reference="part_3"/><transmission name="t"><joint name="part_joint_1"/></transmission>'
    found = read(written(tmp_path, robot(link("world"), CABINET, HUNG, chain(7, "-2.8 2.8"), tags)))
    assert [item.name for item in found.features.joints if item.type != "fixed"] == ["door_hinge"]
    assert "part_" not in found.urdf.read_text() and any("robot 'part_0'" in item.message for item in found.findings)
