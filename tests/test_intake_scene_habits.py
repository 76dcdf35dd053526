"""SDF and MJCF files in habits of robot benchmarks: what stands for the world, hands, gears, outlines, free bodies."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
import trimesh

from asset2sim.assets.urdf.references import ANYWHERE
from asset2sim.intake.formats.mjcf import urdf_of_mjcf
from asset2sim.intake.formats.sdf import urdf_of_sdf
from asset2sim.intake.up_axis import find_up
from asset2sim.validation.validate import validate
from schemas.errors import AssetError
from schemas.overlay import Overlay
from schemas.settings import PhysicsSettings
from schemas.support import SupportKind
from schemas.vocabulary import Source, UpAxis
from tests.assets import near, read

pytestmark = pytest.mark.system
"""Reading MJCF loads MuJoCo, which starts a program."""

BOX = '<geom type="box" size="0.1 0.1 0.1" mass="2"/>'
DOOR = f'<body name="door" pos="0.3 0 0"><joint name="hinge" axis="0 0 1" range="0 90"/>{BOX}</body>'


def mjcf(folder: Path, world: str, rest: str = "") -> Path:
    folder.mkdir(exist_ok=True)
    file = folder / "model.xml"
    file.write_text(f'<mujoco model="m">{rest}<worldbody>{world}</worldbody></mujoco>', encoding="utf-8")
    return file


def sdf_link(name: str, geometry: str = "<box><size>0.2 0.2 0.2</size></box>") -> str:
    shape = f"<geometry>{geometry}</geometry>"
    return f'<link name="{name}"><visual name="v">{shape}</visual><collision name="c">{shape}</collision></link>'


def sdf(folder: Path, inside: str) -> Path:
    file = folder / "model.sdf"
    file.write_text(f'<sdf version="1.7"><model name="thing">{inside}</model></sdf>', encoding="utf-8")
    return file


def test_a_body_called_base_stands_beside_the_world(tmp_path: Path) -> None:
    file = mjcf(tmp_path, f'<body name="base">{BOX}</body><body name="cabinet" pos="1 0 0">{BOX}{DOOR}</body>')
    made = urdf_of_mjcf(file, tmp_path)
    names = [str(link.get("name")) for link in made.robot.findall("link")]
    assert sorted(names) == ["base", "cabinet", "door", "world"] and made.world == "world"
    assert read(tmp_path).features.root == "world"


def test_an_sdf_link_called_base_is_hinged_on_the_world(tmp_path: Path) -> None:
    hinge = ('<joint name="turn" type="revolute"><parent>world</parent><child>base</child><axis><xyz>0 0 1</xyz>'
             "<limit><lower>0</lower><upper>1</upper></limit></axis></joint>")  # fmt: skip
    made = urdf_of_sdf(sdf(tmp_path, sdf_link("base") + hinge), tmp_path, ANYWHERE)
    (joint,) = made.robot.findall("joint")
    ends = [str(item.get("link")) for tag in ("parent", "child") for item in joint.findall(tag)]
    assert ends == ["world", "base"]


def test_three_slides_and_three_hinges_are_a_free_body(tmp_path: Path) -> None:
    slides = "".join(f'<joint name="{k}{n}" type="{k}" axis="{a}"/>' for k in ("slide", "hinge")
                     for n, a in enumerate(("1 0 0", "0 1 0", "0 0 1")))  # fmt: skip
    alone = urdf_of_mjcf(mjcf(tmp_path, f'<body name="case">{slides}{BOX}{DOOR}</body>'), tmp_path)
    assert [str(item.get("name")) for item in alone.robot.findall("joint")] == ["hinge"] and not alone.world
    beside = f'<body name="cabinet" pos="1 0 0">{BOX}{DOOR}</body><body name="can">{slides}{BOX}</body>'
    motor = '<actuator><motor joint="slide0"/></actuator>'
    tied = '<equality><joint joint1="slide0" joint2="hinge"/></equality>'
    world = mjcf(tmp_path, beside).read_text().replace("</worldbody>", f"</worldbody>{motor}{tied}")
    (tmp_path / "model.xml").write_text(world)
    made = urdf_of_mjcf(tmp_path / "model.xml", tmp_path)
    assert made.free == ("can",) and {str(item.get("type")) for item in made.robot.findall("joint")} == {
        "fixed", "revolute"}  # fmt: skip
    limited = slides.replace('name="slide2"', 'name="slide2" range="0 1"')
    held = urdf_of_mjcf(mjcf(tmp_path, f'<body name="lift">{limited}{BOX}</body>'), tmp_path)
    assert len(held.robot.findall("joint")) == 6 and held.world == "base"


@pytest.mark.parametrize("motors", [True, False])
def test_a_hand_of_fingers_is_left_out_and_drawers_are_not(tmp_path: Path, motors: bool) -> None:
    name = "part" if motors else "FFJ"
    finger = '{}<body name="{n}a{i}"><joint name="{n}{i}0"/>{g}<body name="{n}b{i}"><joint name="{n}{i}1"/>{g}' \
             '<body name="{n}c{i}"><joint name="{n}{i}2"/>{g}</body></body></body>'  # fmt: skip
    hand = "".join(finger.format("", n=name, i=i, g='<geom size="0.01" mass="0.1"/>') for i in range(2))
    drawers = "".join(
        f'<body name="d{n}"><joint name="s{n}" type="slide" range="0 0.2"/>{BOX}</body>' for n in range(7)
    )
    driven = "".join(f'<motor joint="{name}{i}{k}"/>' for i in range(2) for k in range(3)) * motors
    driven += "".join(f'<motor joint="s{n}"/>' for n in range(7))
    world = f'<body name="mount" pos="0 0 1"><geom size="0.02"/>{hand}</body><body name="cabinet">{BOX}{drawers}</body>'
    mjcf(tmp_path, world, f"<actuator>{driven}</actuator>")
    found = read(tmp_path)
    assert {joint.name for joint in found.features.movable_joints} == {f"s{n}" for n in range(7)}
    assert "robot 'mount' with its 7 links is left out" in str(found.findings)


@pytest.mark.parametrize(
    ("ratio", "axis", "ends", "turned"), [(-2.0, "0 0 1", "body wheel", 2.0), (2.0, "0 0 -1", "wheel body", -2.0)]
)
def test_a_gearbox_ties_two_hinges(tmp_path: Path, ratio: float, axis: str, ends: str, turned: float) -> None:
    limit = "<limit><lower>{}</lower><upper>{}</upper></limit>"

    def hinge(name: str, parent: str, child: str, axis: str, high: float) -> str:
        return (f'<joint name="{name}" type="revolute"><parent>{parent}</parent><child>{child}</child><axis>'
                f"<xyz>{axis}</xyz>{limit.format(-high, high)}</axis></joint>")  # fmt: skip

    first, second = ends.split()
    gear = ('<joint name="gear" type="gearbox"><parent>knob</parent><child>wheel</child>'
            f"<gearbox_ratio>{ratio}</gearbox_ratio><gearbox_reference_body>body</gearbox_reference_body>"
            "<axis><xyz>0 1 0</xyz></axis><axis2><xyz>0 0 1</xyz></axis2></joint>")  # fmt: skip
    inside = sdf_link("body") + sdf_link("knob") + sdf_link("wheel") + hinge("turn", "body", "knob", "0 1 0", 1.0)
    made = urdf_of_sdf(sdf(tmp_path, inside + hinge("roll", first, second, axis, 3.0) + gear), tmp_path, ANYWHERE)
    # θ₂ = -ratio · θ₁: the knob's turn about y, and the wheel's about z, both in the body.
    (mimic,) = made.robot.iter("mimic")
    assert mimic.get("joint") == "roll" and near(float(str(mimic.get("multiplier"))), 1.0 / turned)
    told = urdf_of_sdf(sdf(tmp_path, inside + gear), tmp_path, ANYWHERE).notes
    assert told == ("gearbox 'gear' is left out: it ties no two hinges of its reference body 'body'",)


def test_outlines_are_extruded_and_those_within_are_holes(tmp_path: Path) -> None:
    def polyline(points: str, height: float = 0.4) -> str:
        inside = "".join(f"<point>{point}</point>" for point in points.split(","))
        return f"<polyline>{inside}<height>{height}</height></polyline>"

    notched = polyline("0 0,0.4 0,0.4 0.3,0.2 0.1,0 0.3") + polyline("0.1 0.02,0.3 0.02,0.3 0.06,0.1 0.06")
    made = urdf_of_sdf(sdf(tmp_path, sdf_link("tray", notched)), tmp_path, ANYWHERE)
    solid = trimesh.load_mesh(str(next(made.robot.iter("mesh")).get("filename")))
    assert (
        isinstance(solid, trimesh.Trimesh)
        and near(solid.volume, 0.4 * (0.4 * 0.3 - 0.5 * 0.4 * 0.2 - 0.2 * 0.04), 1e-9)
        and solid.is_watertight
    )
    assert near(solid.bounds.tolist(), [[0.0, 0.0, 0.0], [0.4, 0.3, 0.4]])
    with pytest.raises(AssetError, match="link 'tray': <polyline> is an outline of fewer than three points"):
        urdf_of_sdf(sdf(tmp_path, sdf_link("tray", polyline("0 0,1 0"))), tmp_path, ANYWHERE)


LICENCE = "<!-- ~ Copyright\n ~\n-->\n\n"


def test_a_licence_before_the_declaration_is_passed_over(tmp_path: Path) -> None:
    file = mjcf(tmp_path, f'<body name="box">{BOX}<include file="door.xml"/></body>')
    file.write_text(LICENCE + "<?xml version='1.0'?>\n" + file.read_text())
    (tmp_path / "door.xml").write_text(f"{LICENCE}<?xml version='1.0'?>\n<mujocoinclude>{DOOR}</mujocoinclude>")
    assert [joint.name for joint in read(tmp_path).features.movable_joints] == ["hinge"]


def test_an_include_that_is_missing_is_named_where_it_stands(tmp_path: Path) -> None:
    file = mjcf(tmp_path, f'<body name="box">{BOX}</body>', '<include file="parts.xml"/>')
    (tmp_path / "parts.xml").write_text('<mujocoinclude>\n<include file="robot.xml"/></mujocoinclude>')
    with pytest.raises(AssetError, match=r"its include 'robot.xml' \(parts.xml, line 2\) is not there"):
        urdf_of_mjcf(file, tmp_path)
    (tmp_path / "parts.xml").unlink()
    with pytest.raises(AssetError, match=r"its include 'parts.xml' \(line 1\) is not there"):
        urdf_of_mjcf(file, tmp_path)


def test_a_format_of_simulators_is_not_turned_upright(tmp_path: Path) -> None:
    legs = "".join(
        f'<geom type="box" size="0.02 0.25 0.02" pos="{x} -0.25 {z}"/>' for x in (-0.4, 0.4) for z in (-0.3, 0.3)
    )
    lid = f'<body name="lid" pos="0 0 0"><joint name="hinge" axis="1 0 0" range="0 90"/>{BOX}</body>'
    (tmp_path / "mjcf").mkdir()
    mjcf(tmp_path / "mjcf", f'<body name="legs"><geom type="box" size="0.45 0.01 0.35"/>{legs}{lid}</body>')
    found = read(tmp_path / "mjcf")
    up, told = find_up(found)
    assert up is UpAxis.Z and told is not None and told.code == "up_doubtful" and "its format has z up" in told.message
    assert found.opened is not None
    unsaid = replace(found, opened=replace(found.opened, metric_format=""))
    assert find_up(unsaid)[0] is UpAxis.Y, "of any other file the shape decides"


def held(folder: Path) -> tuple[SupportKind, Source]:
    found = validate(read(folder), Overlay(scale=1.0), Source.PRIOR, 0.5, PhysicsSettings())[0].support
    return found.kind, found.source


def test_what_moves_on_the_world_alone_is_held_by_it(tmp_path: Path) -> None:
    cup = f'<body name="cup" pos="0 0 0.6"><joint name="x" type="slide" axis="1 0 0" range="-1 1"/>{BOX}</body>'
    mjcf(tmp_path / "cup", cup)
    assert held(tmp_path / "cup") == (SupportKind.FIXED, Source.AUTHORED)
    mjcf(tmp_path / "rail", '<geom type="capsule" size="0.02 1" euler="0 90 0" pos="0 0 0.6"/>' + cup)
    assert held(tmp_path / "rail") == (SupportKind.FIXED, Source.AUTHORED), "shapes of the world do not fall"
    mjcf(tmp_path / "chest", f'<body name="chest">{BOX}{DOOR}</body>')
    assert held(tmp_path / "chest")[0] is SupportKind.FREESTANDING, "where a program puts it, it stands"
    (tmp_path / "sdf").mkdir()
    fixed = '<joint name="f" type="fixed"><parent>world</parent><child>box</child></joint>'
    sdf(tmp_path / "sdf", sdf_link("box") + fixed)
    assert held(tmp_path / "sdf") == (SupportKind.FIXED, Source.AUTHORED)


@pytest.mark.parametrize(
    ("bits", "rest", "pairs"),
    [
        ('contype="0" conaffinity="1"', "", [("base", "lid"), ("base", "knob")]),
        ('contype="0" conaffinity="0"', "", [("base", "lid")]),
        ("", '<option><flag contact="disable"/></option>', [("base", "lid"), ("base", "knob")]),
        ("", '<contact><exclude body1="base" body2="knob"/></contact>', [("base", "knob")]),
        ("", "", []),
    ],
)
def test_what_its_file_lets_pass_passes(tmp_path: Path, bits: str, rest: str, pairs: list[tuple[str, str]]) -> None:
    solid = f'<geom size="0.1" mass="1" {bits}/>'
    knob = f'<body name="knob"><joint name="turn" axis="0 1 0"/>{solid}</body>'
    lid = f'<body name="mount">{solid}<body name="lid"><joint name="hinge" axis="1 0 0"/>{solid}{knob}</body></body>'
    file = mjcf(tmp_path, f'<body name="base">{solid}{lid}</body>', rest)
    found = [(item.get("link1"), item.get("link2"))
             for item in urdf_of_mjcf(file, tmp_path).robot.findall("disable_collisions")]  # fmt: skip
    assert [pair for pair in found if "mount" not in pair] == pairs


TABLE = '<body name="tablelink" pos="0 0 -0.03"><geom type="box" size="0.7 0.4 0.03"/></body>'
RIM_GEOM = '<geom type="box" size="{}" pos="{}"/>'
RIM = "".join(RIM_GEOM.format(*side) for side in (
    ("0.7 0.01 0.06", "0 0.39 0.06"), ("0.7 0.01 0.06", "0 -0.39 0.06"),
    ("0.01 0.38 0.06", "0.69 0 0.06"), ("0.01 0.38 0.06", "-0.69 0 0.06")))  # fmt: skip
RIMMED = f'{TABLE}<body name="RetainingWall">{RIM}</body>'
CABINET = f'<body name="cabinet" pos="0 0 0.1">{BOX}{DOOR}</body>'
PLATE = '<asset><mesh name="plate" vertex="0 0 0  0.3 0.3 0  0.32 0.28 0  0.02 -0.02 0  0.2 0.2 0.2"/></asset>'
"""A mesh whose longest axis lies at 45° to the table, which stands on it."""


@pytest.mark.parametrize(
    ("world", "links"),
    [
        (RIMMED + CABINET, ["cabinet", "door"]),
        (f'{RIMMED}<body name="case"><geom type="mesh" mesh="plate"/>{DOOR.replace("0.3 0 0", "0 0 0.1")}</body>',
         ["case", "door"]),
        (f'<body name="wall">{RIM}</body>{CABINET}', ["base", "cabinet", "door", "wall"]),
        (TABLE + f'<body name="drawer" pos="0 0 -0.2"><joint name="s" type="slide" range="0 0.2"/>{BOX}</body>',
         ["base", "drawer", "tablelink"]),
        (TABLE + f'<body name="case" pos="0 0 0.1">{BOX}</body>', ["base", "case", "tablelink"]),
    ],
    ids=["a table with a rim", "a mesh on it", "a wall without a table", "a drawer under its table", "nothing moves"],
)  # fmt: skip
def test_the_table_that_an_object_stands_on_is_no_part_of_it(tmp_path: Path, world: str, links: list[str]) -> None:
    made = urdf_of_mjcf(mjcf(tmp_path, world, PLATE), tmp_path)
    assert sorted(str(link.get("name")) for link in made.robot.findall("link")) == links
    told = [note.split(" is left out")[0] for note in made.notes if "left out" in note]
    assert told == (["body 'tablelink'", "body 'RetainingWall'"] if "base" not in links else [])


@pytest.mark.parametrize(
    ("mark", "left"),
    [('pos="0 0.15 0.001" size="0.1 0.1 0.001" contype="0" conaffinity="0"', True),
     ('pos="0 0.15 0.001" size="0.1 0.1 0.001"', False),
     ('pos="0 0.15 0.1" size="0.1 0.1 0.1" contype="0" conaffinity="0"', False)],
    ids=["a mat that is only drawn", "one that is solid", "a thing that is only drawn"],
)  # fmt: skip
def test_what_is_only_drawn_on_the_table_goes_with_it(tmp_path: Path, mark: str, left: bool) -> None:
    made = urdf_of_mjcf(mjcf(tmp_path, f'<geom name="mat" type="box" {mark}/>{TABLE}{CABINET}'), tmp_path)
    assert (made.robot.find("link[@name='base']") is None) is left
    assert ("geom 'mat' is left out: it is only drawn, on what is left out" in made.notes) is left


def test_what_its_file_fixes_on_a_table_is_held_where_it_would_fall(tmp_path: Path) -> None:
    thin = '<geom type="box" size="0.2 0.01 0.2" pos="0 0 0.2" mass="2"/>'
    nail = '<body name="nail" pos="0 -0.03 0.3"><joint type="slide" axis="0 1 0" range="0 0.02"/>{}</body>'
    board = f'<body name="board">{thin}{nail.format(BOX.replace("0.1 0.1 0.1", "0.02 0.01 0.02"))}</body>'
    mjcf(tmp_path / "board", TABLE + board)
    assert held(tmp_path / "board") == (SupportKind.FIXED, Source.AUTHORED)
    mjcf(tmp_path / "cabinet", RIMMED + CABINET)
    assert held(tmp_path / "cabinet")[0] is SupportKind.FREESTANDING, "what stands firmly is not"
    mjcf(tmp_path / "alone", board)
    assert held(tmp_path / "alone")[1] is not Source.AUTHORED, "no table holds it"


def test_what_a_file_draws_upright_by_its_root_stands_upright(tmp_path: Path) -> None:
    lid = f'<body name="lid" pos="0 0.3 0"><joint axis="1 0 0" range="0 90"/>{BOX}</body>'
    own = f'<body name="case" quat="0.7071068 0.7071068 0 0">{BOX}{lid}</body>'
    hinge = ('<joint name="hinge" type="revolute"><parent>case</parent><child>lid</child><axis><xyz>1 0 0</xyz>'
             "<limit><lower>0</lower><upper>1</upper></limit></axis></joint>")  # fmt: skip
    on = sdf_link("lid").replace("<visual", '<pose relative_to="case">0 0.3 0 0 0 0</pose><visual', 1) + hinge
    up = "<pose>0 0 0 1.5707963 0 0</pose>"
    of_link = sdf_link("case").replace("<visual", f"{up}<visual", 1)
    ways: tuple[tuple[Callable[[Path, str], Path], str], ...] = (
        (mjcf, own),
        (sdf, up + sdf_link("case") + on),
        (sdf, of_link + on),
    )
    for number, (write, text) in enumerate(ways):
        folder = tmp_path / str(number)
        folder.mkdir()
        write(folder, text)
        assert near(read(folder).features.rest_size, (0.2, 0.2, 0.5), 1e-5)


def test_the_legs_of_a_table_that_is_left_out_are_left_out(tmp_path: Path) -> None:
    legs = "".join(
        f'<geom name="table_leg_{x}" type="box" size="0.03 0.03 0.3" pos="{x} 0 -0.44"/>' for x in (-0.4, 0.4)
    )
    top = '<geom name="table_top" type="box" size="0.6 0.6 0.02" pos="0 0 -0.12"/>'
    made = urdf_of_mjcf(mjcf(tmp_path, f'{top}{legs}<body name="cabinet">{BOX}{DOOR}</body>'), tmp_path)
    assert made.robot.find("link[@name='base']") is None or made.robot.find("link[@name='base']/collision") is None
    assert sum("is left out: it is the floor" in note for note in made.notes) == 3


@pytest.mark.parametrize("marked", [True, False], ids=["marked", "not"])
def test_what_is_marked_for_a_loader_that_scales_it_has_the_size_of_its_kind(marked: bool, tmp_path: Path) -> None:
    ends = {"p0": "-.5 -.4 -.3", "px": ".5 -.4 -.3", "py": "-.5 .4 -.3", "pz": "-.5 -.4 .3"}
    sites = "".join(f'<site name="ext_{name}" pos="{at}"/>' for name, at in ends.items()) if marked else ""
    case = '<geom type="box" size="0.5 0.35 0.3"/>'
    door = '<geom type="box" size="0.35 0.02 0.28" pos="0.35 0 0"/>'
    hinge = f'<body name="door" pos="-0.4 -0.38 0"><joint axis="0 0 1" range="-90 0"/>{door}</body>'
    mjcf(tmp_path, f'<body name="microwave">{case}{sites}{hinge}</body>')
    extraction = read(tmp_path)
    assert bool(extraction.features.metric) is not marked
    told = "; ".join(item.message for item in extraction.findings)
    assert ("its lengths are not metres" in told) is marked
