"""Robots in a scene's file: left out where they stand beside an object, and nothing else is."""

from pathlib import Path

import pytest
from lxml import etree

from asset2sim.intake.formats.format import Converted
from asset2sim.intake.origin import parts_in
from asset2sim.intake.robots import without_bystanders, without_robots
from schemas.asset import AssetRef
from schemas.inputs import InputSettings
from schemas.vocabulary import UpAxis
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


def floating_hand(axes: str, kind: str = "prismatic") -> str:
    """A ball below ``world`` that moves along or about these axes, one after the other."""
    names = ["world", *(f"part_{n}" for n in range(len(axes)))]
    vectors = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}
    return "".join(
        link(names[n + 1], shape("0.03 0.03 0.03") if n == len(axes) - 1 else "")
        + joint(f"part_joint_{n}", kind, names[n], names[n + 1], axis=vectors[axis], limit="-0.2 0.2")
        for n, axis in enumerate(axes)
    )


@pytest.mark.parametrize(
    ("beside", "driven", "leaves"),
    [
        (floating_hand("xyz"), 3, True),
        (floating_hand("xyz"), 0, False),
        (floating_hand("xz"), 2, False),
        (floating_hand("xyz", "revolute"), 3, False),
        (chain(7, "-2.8 2.8"), 0, True),
        (chain(4, "-0.5 0.5", "panda"), 0, True),
        (chain(5, "-0.5 0.5"), 5, True),
        (chain(5, "-2.8 2.8"), 0, False),
        (chain(7, "-0.4 0.4"), 0, False),
        (chain(3, "-2.8 2.8", "arm"), 3, False),
        (chain(20, "-2.8 2.8"), 0, False),
        (chain(4, "-0.5 0.5", "alarm"), 1, False),
    ],
    ids=[
        "floating hand",
        "without motors",
        "two slides",
        "turning",
        "arm",
        "small arm",
        "motors",
        "lamp",
        "blinds",
        "short",
        "hose",
        "one motor",
    ],
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


@pytest.mark.parametrize(("beside", "free", "leaves"), [
    ("", ("cube",), True),
    ("", ("cube", "cabinet"), True),
    ("", (), False),
    (chain(1, "-1 1"), ("cube",), False),
], ids=["free", "all free", "fixed", "two things move"])  # fmt: skip
def test_a_free_cube_beside_the_one_thing_that_moves_is_left_out(
    beside: str, free: tuple[str, ...], leaves: bool
) -> None:
    cube = link("cube", shape("0.1 0.1 0.1")) + joint("lies", "fixed", "world", "cube")
    text = robot(link("world"), CABINET, HUNG, cube, beside).split("?>")[1]
    made = without_bystanders(Converted(etree.fromstring(text), world="world", free=free))
    left = {str(item.get("name")) for item in made.robot.findall("link")}
    assert (left == {"cabinet", "door"} | ({"world"} if "cabinet" not in free else set())) is leaves
    assert (made.free == ()) is (leaves or not free) and ("'cube' is free" in str(made.notes)) is leaves


@pytest.mark.system
def test_of_an_mjcf_what_is_free_is_left_out_but_no_part_of_it(tmp_path: Path) -> None:
    box = '<geom type="box" size="0.1 0.1 0.1" mass="2"/>'
    door = f'<body name="door" pos="0.3 0 0"><joint name="hinge" axis="0 0 1" range="0 90"/>{box}</body>'
    world = f'<body name="case">{box}{door}</body><body name="cube" pos="1 0 0"><freejoint/>{box}</body>'
    (tmp_path / "model.xml").write_text(f"<mujoco><worldbody>{world}</worldbody></mujoco>", encoding="utf-8")
    assert {item.name for item in read(tmp_path).features.links} == {"base", "case", "door"}
    assert [part.name for part in parts_in(AssetRef(asset_id="a", path=str(tmp_path)), UpAxis.Z, InputSettings())] == [
        "case", "cube"]  # fmt: skip
    held = world.replace('name="case">', 'name="case"><freejoint/>')
    (tmp_path / "model.xml").write_text(f"<mujoco><worldbody>{held}</worldbody></mujoco>", encoding="utf-8")
    alone = read(tmp_path)
    assert {item.name for item in alone.features.links} == {"case", "door"}, "where nothing is held"
    assert alone.opened is not None and not alone.opened.held


@pytest.mark.system
@pytest.mark.parametrize(
    ("still", "links"),
    [
        ('<geom type="box" size="0.1 0.1 0.1" pos="1 0 0"/>', {"case", "door"}),
        ('<body name="bin" pos="1 0 0">{}</body>', {"base", "case", "door"}),
        ('<geom type="box" size="0.1 0.1 0.1" pos="0 0.21 0"/>', {"base", "case", "door"}),
        ('<body name="wall" pos="0 0.21 0">{0}</body><body name="post" pos="0 0.42 0">{0}</body>',
         {"base", "case", "door", "wall", "post"}),
    ],
    ids=["a pile", "a bin", "a wall behind it", "what touches that"],
)  # fmt: skip
def test_what_stands_apart_from_the_one_thing_that_moves_is_left_out(
    tmp_path: Path, still: str, links: set[str]
) -> None:
    box = '<geom type="box" size="0.1 0.1 0.1" mass="2"/>'
    door = f'<body name="door" pos="0.3 0 0"><joint name="hinge" axis="0 0 1" range="0 90"/>{box}</body>'
    world = f'<body name="case">{box}{door}</body>{still.format(box)}'
    (tmp_path / "model.xml").write_text(f"<mujoco><worldbody>{world}</worldbody></mujoco>", encoding="utf-8")
    assert {item.name for item in read(tmp_path).features.links} == links
