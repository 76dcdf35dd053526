"""MJCF files as people have them, which MuJoCo alone refuses: read, and what was left out is said."""

from collections.abc import Callable
from itertools import product
from pathlib import Path

import pytest

from asset2sim.intake.dataset import load_dataset
from asset2sim.intake.formats.mjcf import urdf_of_mjcf
from asset2sim.intake.formats.mjcf_document import schema
from asset2sim.intake.robots import without_robots
from schemas.errors import AssetError
from schemas.settings import PhysicsSettings
from tasks.extract import validate_authored
from tests.assets import read

pytestmark = pytest.mark.system
"""Reading MJCF loads MuJoCo, which starts a program."""

BODY = '<body name="base"><geom type="box" size="0.1 0.1 0.1"/>{more}</body>'
LID = '<body name="lid" pos="0 0 0.1"><joint name="hinge" axis="1 0 0" range="0 90"/>{more}</body>'
ROPE = '<site name="t"/>'
SOLID = '<geom type="box" size="0.1 0.1 0.01"/>'


def written(folder: Path, world: str, rest: str = "") -> Path:
    file = folder / "model.xml"
    file.write_text(f'<mujoco model="m">{rest}<worldbody>{world}</worldbody></mujoco>', encoding="utf-8")
    return file


def links_and_notes(file: Path, work: Path) -> tuple[list[str], str]:
    work.mkdir()
    made = urdf_of_mjcf(file, work)
    return [str(link.get("name")) for link in made.robot.findall("link")], "; ".join(made.notes)


@pytest.mark.parametrize(
    ("world", "rest", "said"),
    [
        (BODY.format(more=LID.format(more='<geom type="box" size="1 1 1" mass="0"/>')), "", ""),
        (BODY.format(more=LID.format(more="")), "", ""),
        (BODY.format(more=f'<region name="r"/>{LID.format(more=SOLID)}'), "", "<region>, which MuJoCo does not know"),
        (BODY.format(more=LID.format(more=SOLID.replace("/>", ' colour="red"/>'))), "", "'colour' of <geom>"),
        (
            BODY.format(
                more=LID.format(more=f"{SOLID.replace('<geom', '<geom name=x')}{SOLID}".replace("=x", '="x"') * 2)
            ),
            "",
            "a second geom 'x' has no name",
        ),
        (
            BODY.format(more=LID.format(more=SOLID.replace("/>", ' material="wood"/>'))),
            '<asset><texture name="t" type="2d" file="gone.png"/><material name="wood" texture="t"/></asset>',
            "texture 't' is left out: its file 'gone.png' is not there",
        ),
        (
            BODY.format(more=LID.format(more=f'{SOLID}<geom type="mesh" mesh="gone"/>')),
            '<asset><mesh file="gone.stl"/></asset>',
            "mesh 'gone' is left out: its file 'gone.stl' is not there",
        ),
        (BODY.format(more=LID.format(more=SOLID.replace("/>", ' class="gone"/>'))), "", "no default 'gone'"),
        (BODY.format(more=LID.format(more=SOLID.replace("/>", ' material="gone"/>'))), "", "no material 'gone'"),
        (BODY.format(more=LID.format(more=SOLID)), '<actuator><motor joint="gone"/></actuator>', "<motor> is left out"),
        (BODY.format(more=LID.format(more=SOLID)), '<keyframe><key qpos="0 0 0"/></keyframe>', ""),
        (
            BODY.format(more=LID.format(more=f'<plugin instance="d"/>{SOLID}')),
            '<extension><plugin plugin="their.detent"><instance name="d"/></plugin></extension>',
            "plugin 'their.detent' is left out",
        ),
        (BODY.format(more=LID.format(more=SOLID + SOLID.replace("0.01", "0"))), "", "box of size 0.1 0.1 0 is left"),
        (
            BODY.format(more=LID.replace('0 90"', '90 0" limited="true"').format(more=SOLID)),
            "",
            "'hinge' is the wrong way round",
        ),
        (
            BODY.format(more=LID.format(more=f'<inertial pos="0 0 0" mass="1" diaginertia="1 .1 .1"/>{SOLID}')),
            "",
            "inertia of body 'lid', which no body can have",
        ),
        (
            BODY.format(more=LID.format(more=SOLID)),
            '<equality><connect body1="base" body2="lid" anchor="0 0 0"/></equality>',
            "the loop of 'hinge' is stiff",
        ),
        (
            BODY.format(more=f'<site name="s"/>{LID.format(more=SOLID + ROPE)}'),
            '<tendon><spatial><site site="s"/><site site="t"/></spatial></tendon>',
            "its 1 tendons are left out",
        ),
        (
            BODY.format(more=LID.format(more=SOLID)) + '<geom type="hfield" hfield="ground"/>',
            '<asset><hfield name="ground" nrow="2" ncol="2" size="1 1 1 1"/></asset>',
            "its 1 height fields are left out",
        ),
    ],
    ids=[
        "massless geom", "massless body", "element", "attribute", "name twice", "texture gone", "mesh gone",
        "class gone", "material gone", "joint gone", "keys of another", "plugin", "flat", "range", "inertia",
        "closed loop", "spatial tendon", "height field",
    ],
)  # fmt: skip
def test_what_mujoco_refuses_is_read_and_what_is_left_out_is_said(
    world: str, rest: str, said: str, tmp_path: Path
) -> None:
    links, notes = links_and_notes(written(tmp_path, world, rest), tmp_path / "work")
    assert links == ["base", "lid"] and said in notes and bool(said) == bool(notes)


def test_a_mended_file_keeps_its_includes_its_folders_and_the_masses_that_it_states(tmp_path: Path) -> None:
    stated = '<inertial pos="0 0 0" mass="0.7" diaginertia="0.01 0.01 0.01"/>'
    (tmp_path / "lid.xml").write_text(
        f"<mujoco>{LID.format(more=stated + SOLID + '<unknown/>')}</mujoco>", encoding="utf-8"
    )
    work = tmp_path / "work"
    work.mkdir()
    made = urdf_of_mjcf(written(tmp_path, BODY.format(more='<include file="lid.xml"/>')), work)
    base, lid = made.robot.findall("link")
    assert base.find("inertial") is None, "none is stated, and MuJoCo's own guess does not count"
    mass = lid.find("inertial/mass")
    assert mass is not None and float(str(mass.get("value"))) == 0.7


def test_what_cannot_be_mended_names_the_file_and_mujocos_reason(tmp_path: Path) -> None:
    for world, said in (
        (BODY.format(more=LID.format(more=SOLID.replace("0.1 0.1 0.01", "big"))), "model.xml: MuJoCo refuses it"),
        (
            BODY.format(more='<include file="gone.xml"/>'),
            r"its include 'gone.xml' \(line 1\) is not there: restore the file",
        ),
        (BODY.format(more='<include file="model.xml"/>'), "break the circle"),
    ):
        with pytest.raises(AssetError, match=said):
            urdf_of_mjcf(written(tmp_path, world), tmp_path)


def test_an_include_and_nothing_else_is_told(tmp_path: Path) -> None:
    (tmp_path / "model.xml").write_text('<include file="other.xml"/>')
    with pytest.raises(AssetError, match="an <include> and nothing else"):
        urdf_of_mjcf(tmp_path / "model.xml", tmp_path)


def test_the_schema_has_what_objects_are_made_of() -> None:
    assert {"body", "worldbody", "geom", "joint", "inertial", "mesh", "texture", "equality"} <= set(schema())
    assert {"pos", "quat", "name"} <= schema()["body"] and {"range", "damping", "armature"} <= schema()["joint"]


SLIDES = "".join(
    f'<body name="{name}" pos="{at} 0 0.2"><joint name="{name}" type="slide" axis="1 0 0" range="0 0.2"{more}/>'
    f'<geom type="box" size="0.1 0.1 0.1"{seen}/></body>'
    for name, at, more, seen in (
        ("left", 0, "", ""), ("right", 1, "", ""), ("lamp", 2, ' armature="0.02"', ' contype="0" conaffinity="0"'),
    )
)  # fmt: skip


def fixed_tendon(*factors: float) -> str:
    """A tendon over the first joints, and the equality that keeps its length."""
    joints = "".join(f'<joint joint="{name}" coef="{c}"/>' for name, c in zip(("left", "right"), factors, strict=False))
    return f'<tendon><fixed name="t">{joints}</fixed></tendon><equality><tendon tendon1="t"/></equality>'


@pytest.mark.parametrize(
    ("rest", "mimics"),
    [
        (fixed_tendon(1, 1), {"left": ("right", -1.0, 0.0)}),
        (fixed_tendon(4, -1), {"left": ("right", 0.25, 0.0)}),
        (fixed_tendon(-1, 4), {"right": ("left", 0.25, 0.0)}),
        (
            '<equality><joint joint1="right" joint2="lamp" polycoef="0.1 20 0 0 0"/></equality>',
            {"lamp": ("right", 0.05, -0.005)},
        ),
        (
            '<equality><joint joint1="left" joint2="lamp"/><joint joint1="right" joint2="left"/></equality>',
            {"lamp": ("left", 1.0, 0.0), "right": ("left", 1.0, 0.0)},
        ),
        ('<equality><joint joint1="left" polycoef="0 0 0 0 0"/></equality>', {}),
        ('<equality><joint joint1="left" joint2="right" polycoef="0 1 1 0 0"/></equality>', {}),
    ],
    ids=["doors", "gear", "other gear", "lamp", "three", "held", "curved"],
)
def test_joints_that_are_tied_follow_one_that_a_hand_can_move(
    rest: str, mimics: dict[str, tuple[str, float, float]], tmp_path: Path
) -> None:
    file = written(tmp_path, BODY.format(more=SLIDES))
    file.write_text(file.read_text().replace("</worldbody>", f"</worldbody>{rest}"))
    made = urdf_of_mjcf(file, tmp_path)
    joints = {str(joint.get("name")): joint for joint in made.robot.findall("joint")}
    found = {
        name: (item.get("joint"), float(str(item.get("multiplier"))), float(str(item.get("offset"))))
        for name, joint in joints.items()
        for item in joint.findall("mimic")
    }
    assert found.keys() == mimics.keys()
    for name, (leader, ratio, offset) in mimics.items():
        assert found[name][0] == leader and found[name][1:] == pytest.approx((ratio, offset))
    assert (joints["left"].get("type") == "fixed") == ("holds" in "".join(made.notes))
    assert ("cannot say" in "".join(made.notes)) == (not mimics and joints["left"].get("type") != "fixed")
    assert [item.get("armature") for item in joints["lamp"].findall("dynamics")] == ["0.02"]


def test_what_stands_in_the_world_without_a_body_is_one_link(tmp_path: Path) -> None:
    made = urdf_of_mjcf(written(tmp_path, f'{SOLID}<body name="goal" mocap="true">{SOLID}</body>'), tmp_path)
    assert [link.get("name") for link in made.robot.findall("link")] == ["base"]
    assert len(made.robot.findall("link/collision")) == 1 and "1 mocap bodies" in str(made.notes)


@pytest.mark.parametrize(
    ("name", "size", "at", "left"),
    [
        ("floor", "3 3 0.05", "0 0 -0.16", True),
        ("the_ground_0", "3 3 0.05", "0 0 -0.155", True),
        ("stage", "3 3 0.05", "0 0 -0.16", False),
        ("subfloors", "3 3 0.05", "0 0 -0.16", False),
        ("floor", "0.11 0.11 0.01", "0 0 -0.11", False),
        ("floor", "3 3 0.05", "0 0 0.05", False),
    ],
    ids=["a floor", "reached into", "of another name", "part of a name", "a cabinet's bottom", "above something"],
)
def test_a_floor_that_is_drawn_as_a_box_is_no_part_of_what_stands_on_it(
    name: str, size: str, at: str, left: bool, tmp_path: Path
) -> None:
    wall = '<geom name="wall" type="box" size="0.11 0.01 0.1"/>'
    floor = f'<geom name="{name}" type="box" size="{size}" pos="{at}"/>'
    made = urdf_of_mjcf(written(tmp_path, f"{floor}{wall}{LID.format(more=SOLID)}"), tmp_path)
    assert len(made.robot.findall("link[@name='base']/collision")) == (1 if left else 2)
    assert (f"geom '{name}' is left out: it is the floor" in str(made.notes)) == left


def test_what_a_program_places_is_read_where_it_has_joints(tmp_path: Path) -> None:
    press = f'<body name="press"><joint type="slide" range="0 0.02"/>{SOLID}</body>'
    made = urdf_of_mjcf(written(tmp_path, f'<body name="box" mocap="true">{SOLID}{press}</body>'), tmp_path)
    assert [link.get("name") for link in made.robot.findall("link")] == ["box", "press"]
    assert [joint.get("type") for joint in made.robot.findall("joint")] == ["prismatic"]


@pytest.mark.parametrize(("tie", "left"), [("weld", True), ("connect", True), ("", False)])
def test_a_hand_that_a_mocap_body_leads_is_no_part_of_what_it_opens(tie: str, left: bool, tmp_path: Path) -> None:
    finger = f'<body name="finger"><joint type="slide" range="0 0.05"/>{SOLID}</body>'
    hand = f'<body name="target" mocap="true"/><body name="hand" pos="0 0 1"><freejoint/>{SOLID}{finger}</body>'
    ties = '<equality><{} body1="target" body2="hand"{}/></equality>'
    rest = ties.format(tie, ' anchor="0 0 0"' * (tie == "connect")) if tie else ""
    alone = urdf_of_mjcf(written(tmp_path, hand, rest), tmp_path)
    assert {"hand", "finger"} <= {link.get("name") for link in alone.robot.findall("link")}
    made = urdf_of_mjcf(written(tmp_path, hand + LID.format(more=SOLID), rest), tmp_path)
    assert (not {"hand", "finger"} & {link.get("name") for link in made.robot.findall("link")}) is left
    assert ("'hand', which a mocap body leads, is left out" in made.notes) is left


@pytest.mark.parametrize(
    ("geoms", "mass"),
    [
        ('<geom type="box" size=".1 .1 .1" mass="2"/><geom type="sphere" size=".1" mass=".5"/>', 2.5),
        ('<geom type="box" size=".1 .1 .1" mass="2"/><geom type="sphere" size=".1" density="0"/>', 2.0),
        ('<geom type="box" size=".1 .1 .1" mass="2"/><geom type="sphere" size=".1"/>', None),
        ('<geom type="box" size=".1 .1 .1" mass="2"/><geom type="box" size=".01 .01 .01" contype="0"/>', 2.008),
        ('<geom type="box" size=".1 .1 .1" mass="2"/><geom type="sphere" size=".1" contype="0" conaffinity="0"/>', 2.0),
        ('<geom type="sphere" size=".1" mass="0"/><geom type="sphere" size=".1" contype="0" conaffinity="0"/>', None),
        ('<geom type="box" size=".1 .1 .1"/>', None),
        ('<geom type="box" size=".1 .1 .1" density="600"/><geom type="sphere" size=".1" mass=".5"/>', 5.3),
        ('<geom type="box" size=".1 .1 .1" density="600"/><geom type="sphere" size=".1"/>', None),
        ('<geom type="box" size=".1 .1 .1" density="100"/>', None),
        ('<geom type="box" size=".1 .1 .1" density="50000"/>', None),
    ],
    ids=["each", "a weightless one", "one at the default density", "a small one", "looks", "looks alone",
         "none", "a material's density",
         "a density beside none", "a density of nothing", "of no material"],
)  # fmt: skip
def test_masses_of_geoms_are_the_masses_of_their_body(geoms: str, mass: float | None, tmp_path: Path) -> None:
    file = tmp_path / "thing.xml"
    file.write_text(f"<mujoco><worldbody><body>{geoms}</body></worldbody></mujoco>", encoding="utf-8")
    (found,) = urdf_of_mjcf(file, tmp_path / "work").robot.findall("link")
    stated = found.find("inertial/mass")
    assert (None if stated is None else float(str(stated.get("value")))) == (mass and pytest.approx(mass))


def test_a_link_passes_what_is_fixed_to_what_it_moves_in_where_the_file_lets_it(tmp_path: Path) -> None:
    mount = '<body name="mount" pos="0 0 0.1"><geom type="box" size="0.02 0.02 0.01"{bits}/>{more}</body>'

    def pairs(bits: str) -> list[tuple[str | None, str | None]]:
        solid = f'<geom type="box" size="0.1 0.1 0.01"{bits}/>'
        world = BODY.replace("0.1 0.1 0.1", f'0.1 0.1 0.1"{bits} name="g').format(
            more=mount.format(bits=bits, more=LID.format(more=solid))
        )
        made = urdf_of_mjcf(written(tmp_path, world), tmp_path)
        return [(item.get("link1"), item.get("link2")) for item in made.robot.findall("disable_collisions")]

    assert pairs(' contype="0" conaffinity="1"') == [("base", "lid")], "the mount is its parent, which engines let pass"
    assert pairs("") == []


def test_bounds_on_masses_and_inertias_say_nothing_of_a_body(tmp_path: Path) -> None:
    world = BODY.format(more=LID.format(more='<geom type="box" size="0.1 0.1 0.01" mass="0.03"/>'))
    file = written(tmp_path, world, '<compiler boundmass="0.5" boundinertia="0.01"/>')
    (mass,) = urdf_of_mjcf(file, tmp_path).robot.findall("link[@name='lid']/inertial/mass")
    (moments,) = urdf_of_mjcf(file, tmp_path).robot.findall("link[@name='lid']/inertial/inertia")
    assert float(str(mass.get("value"))) == 0.03
    assert float(str(moments.get("izz"))) == pytest.approx(0.03 / 12.0 * (0.2**2 + 0.2**2))


@pytest.mark.parametrize(
    ("limits", "rest", "turned", "upper"),
    [
        ("0 1.57", "", "", 1.57),
        ("0 1.57", "<compiler angle='degree'/>", "", 0.0274),
        ("0 1.57", "", "euler='0 0 90'", 0.0274),
        ("0 90", "", "", 1.5708),
        ("-3 3", "", "", 0.0524),
        ("0 3.00", "", "", 3.0),
    ],
    ids=["radians", "stated", "degrees elsewhere", "degrees", "a rocker", "a door"],
)
def test_angles_of_no_stated_unit_are_radians_where_they_can_be_nothing_else(
    limits: str, rest: str, turned: str, upper: float, tmp_path: Path
) -> None:
    """An object that a benchmark puts into its scenes leaves the unit to them; MuJoCo takes degrees."""
    lid = LID.format(more=SOLID).replace("0 90", limits).replace('name="lid"', f'name="lid" {turned}')
    made = urdf_of_mjcf(written(tmp_path, BODY.format(more=lid), rest), tmp_path)
    found = made.robot.find("joint[@name='hinge']/limit")
    assert found is not None and float(str(found.get("upper"))) == pytest.approx(upper, rel=1e-3)
    assert ("read as radians" in str(made.notes)) == (upper in (1.57, 3.0))


def test_boxes_of_a_class_named_collision_are_not_seen_on_bodies_that_have_looks(tmp_path: Path) -> None:
    classes = (
        "<default><default class='looks'><geom contype='0' conaffinity='0' group='1'/></default>"
        "<default class='collision'><geom group='0' rgba='1 0 0 .5'/></default></default>"
    )
    body = "<geom class='looks' type='sphere' size='.1'/><geom class='collision' type='box' size='.1 .1 .1'/>"
    bare = "<body><joint/><geom class='collision' type='box' size='.1 .1 .1' mass='1'/></body>"
    converted = urdf_of_mjcf(written(tmp_path, f"<body>{body}{bare}</body>", classes), tmp_path)
    whole, alone = converted.robot.findall("link")
    assert len(whole.findall("visual")) == len(whole.findall("collision")) == 1
    assert whole.find("visual/geometry/sphere") is not None
    assert alone.find("visual") is not None, "there is nothing else to see"


def test_a_material_keeps_its_name_and_that_of_its_picture_whose_mean_tints_it(tmp_path: Path) -> None:
    paints = (
        '<asset><texture name="oak" type="2d" builtin="flat" rgb1="0.6 0.4 0.2" width="4" height="4"/>'
        '<material name="front" texture="oak" rgba="1 1 1 0.5"/>'
        '<material name="black_metal" rgba="0.1 0.1 0.1 1"/></asset>'
    )
    solid = SOLID.replace("/>", ' material="front"/>') + SOLID.replace("/>", ' material="black_metal"/>')
    solid += SOLID.replace("/>", ' material="black_metal" rgba="1 0 0 1"/>')
    file = written(tmp_path, BODY.format(more=LID.format(more=solid)), paints)
    work = tmp_path / "work"
    work.mkdir()
    found = {
        str(paint.get("name")): [round(float(value), 2) for value in str(color.get("rgba")).split()]
        for paint in urdf_of_mjcf(file, work).robot.iter("material")
        for color in paint.findall("color")
    }
    assert found == {
        "front oak": [0.6, 0.4, 0.2, 0.5],
        "black_metal": [0.1, 0.1, 0.1, 1.0],
        "black_metal 3": [1.0, 0.0, 0.0, 1.0],
        "color_0": [0.5, 0.5, 0.5, 1.0],
    }


ARM = """
<body name="door" pos="0 0 0"><joint name="hinge" axis="0 0 1" range="0 60"/>
  <geom type="box" pos="0.4 0 0" size="0.4 0.02 0.5" mass="20"/></body>
<body name="arm" pos="0 {pivot} 0"><joint name="motor" axis="0 0 1"/>
  <geom type="box" pos="0.2 0 0" size="0.2 0.01 0.01"/>
  <body name="rod" pos="0.4 0 0"><joint name="pin" axis="0 0 1"/>
    <geom type="box" pos="0 -{half} 0" size="0.01 {half} 0.01"/>
</body></body>
"""
CONNECT = '<equality><connect body1="rod" body2="door" anchor="0 -{pivot} 0"/></equality>'


@pytest.mark.parametrize("pivot", [0.3, 0.15], ids=["a parallelogram", "a shorter one"])
def test_what_a_loop_ties_to_a_door_follows_it(pivot: float, tmp_path: Path) -> None:
    file = written(tmp_path, ARM.format(pivot=pivot, half=pivot / 2), CONNECT.format(pivot=pivot))
    work = tmp_path / "work"
    work.mkdir()
    made = urdf_of_mjcf(file, work)
    follows = {str(joint.get("name")): item for joint in made.robot.iter("joint") for item in joint.findall("mimic")}
    assert {name: str(item.get("joint")) for name, item in follows.items()} == {"motor": "hinge", "pin": "hinge"}
    assert [float(str(follows[name].get("multiplier"))) for name in ("motor", "pin")] == pytest.approx([1.0, -1.0])
    assert any("the loop that 'hinge' moves" in note for note in made.notes)


def test_a_loop_that_a_weld_closes_is_tied_as_one_that_a_connect_closes(tmp_path: Path) -> None:
    end = '<body name="end" pos="0 -0.3 0"><joint name="tip" axis="0 0 1"/><geom size="0.01"/></body></body></body>'
    world = ARM.format(pivot=0.3, half=0.15).rstrip().removesuffix("</body></body>") + end
    weld = '<equality><weld body1="door" body2="end"/></equality>'
    (work := tmp_path / "work").mkdir()
    made = urdf_of_mjcf(written(tmp_path, world, weld), work)
    ratios = {str(joint.get("name")): float(str(item.get("multiplier")))
              for joint in made.robot.iter("joint") for item in joint.findall("mimic")}  # fmt: skip
    assert ratios == pytest.approx({"motor": 1.0, "pin": -1.0, "tip": 1.0}, abs=1e-4)


def test_where_no_line_meets_a_loops_way_all_but_its_leading_joint_is_held(tmp_path: Path) -> None:
    connect = CONNECT.format(pivot=0.3).replace('anchor="0', 'anchor="-0.3')
    file = written(tmp_path, ARM.format(pivot=0.3, half=0.15).replace("0 60", "0 150"), connect)
    work = tmp_path / "work"
    work.mkdir()
    made = urdf_of_mjcf(file, work)
    kinds = {str(joint.get("name")): str(joint.get("type")) for joint in made.robot.iter("joint")}
    assert [kinds[name] for name in ("hinge", "motor", "pin")] == ["revolute", "fixed", "fixed"]
    assert any("the loop that 'hinge' moves" in note and note.endswith("held") for note in made.notes), made.notes
    apart = {
        frozenset((str(item.get("link1")), str(item.get("link2")))) for item in made.robot.iter("disable_collisions")
    }
    assert apart == {frozenset(("door", "arm")), frozenset(("door", "rod"))}, "the door opens through what is held"


def test_a_loop_is_closed_over_the_range_of_its_door_also_where_that_counts_from_another_angle(tmp_path: Path) -> None:
    """Over 5° a straight line meets the way that it misses over 150°, whatever the hinge's drawn position is called."""
    connect = CONNECT.format(pivot=0.3).replace('anchor="0', 'anchor="-0.3')
    found = []
    for number, limits in enumerate(('range="0 5"', 'range="120 125" ref="120"')):
        folder = tmp_path / str(number)
        (folder / "work").mkdir(parents=True)
        file = written(folder, ARM.format(pivot=0.3, half=0.15).replace('range="0 60"', limits), connect)
        made = urdf_of_mjcf(file, folder / "work")
        found.append([float(str(item.get("multiplier"))) for item in made.robot.iter("mimic")])
    assert len(found[0]) == 2 and found[1] == pytest.approx(found[0])


def test_bodies_that_only_mark_a_place_are_no_links(tmp_path: Path) -> None:
    mark = '<body name="goal" pos="0 0 1"><body name="tip"><site name="s"/></body></body>'
    other = mark.replace("goal", "grip").replace("tip", "end").replace('"s"', '"t"')
    file = written(tmp_path, mark + BODY.format(more=other + LID.format(more=SOLID)))
    links, _ = links_and_notes(file, tmp_path / "work")
    assert links == ["base", "lid"]


def test_a_gripper_that_motors_move_about_and_the_scenes_table_are_left_out(tmp_path: Path) -> None:
    slides = "".join(f'<joint name="ee_{axis}" type="slide" axis="{way}" range="-1 1"/>'
                     for axis, way in (("x", "1 0 0"), ("y", "0 1 0"), ("z", "0 0 1")))  # fmt: skip
    finger = '<body name="finger"><joint name="finger" type="slide" axis="0 1 0" range="0 1"/>{solid}</body>'
    gripper = f'<body name="ee" pos="0 0 0">{slides}{SOLID}{finger.format(solid=SOLID)}</body>'
    table = '<geom name="table" type="box" size="1 1 0.02" pos="0 0 -0.02"/>'
    cabinet = BODY.format(more=LID.format(more=SOLID)).replace("<geom", '<geom pos="0 0 0.1"', 1)
    motors = "".join(f'<position joint="{name}"/>' for name in ("ee_x", "ee_y", "ee_z", "finger"))
    work = tmp_path / "work"
    work.mkdir()
    file = written(tmp_path, table + gripper + cabinet, f"<actuator>{motors}</actuator>")
    made = without_robots(urdf_of_mjcf(file, work))
    assert {"base", "lid"} <= {str(link.get("name")) for link in made.robot.findall("link")}
    assert not [name for name in ("ee", "finger") if made.robot.find(f"link[@name='{name}']") is not None]
    assert any("geom 'table' is left out" in note for note in made.notes), "its fingers reach into it as drawn"


def test_a_file_called_mjcf_is_an_asset_and_may_be_included(tmp_path: Path) -> None:
    folder = tmp_path / "box"
    folder.mkdir()
    (folder / "lid.mjcf").write_text(f"<mujocoinclude>{LID.format(more=SOLID)}</mujocoinclude>", encoding="utf-8")
    written(folder, BODY.format(more='<include file="lid.mjcf"/>')).rename(folder / "box.mjcf")
    (ref,) = load_dataset(tmp_path)
    assert ref.fault is None and ref.asset_id == "box"
    links, _ = links_and_notes(folder / "box.mjcf", tmp_path / "work")
    assert links == ["base", "lid"]


@pytest.mark.parametrize(("unit", "ends"), [("radian", "0 2.7"), ("degree", "0 155")])
def test_a_range_that_is_stated_is_taken_though_nothing_is_limited_to_it(unit: str, ends: str, tmp_path: Path) -> None:
    lid = LID.replace('range="0 90"', f'range="{ends}" limited="false"').format(more=SOLID)
    file = written(tmp_path, BODY.format(more=lid), f'<compiler angle="{unit}"/>')
    work = tmp_path / "work"
    work.mkdir()
    made = urdf_of_mjcf(file, work)
    upper = [float(str(item.get("upper"))) for item in made.robot.iter("limit")]
    assert upper == pytest.approx([2.7], abs=0.01) and any("the range that it states" in note for note in made.notes)


def meshed(name: str, at: str, half: tuple[float, float, float]) -> tuple[str, str]:
    """A box as a mesh: its asset and its geom."""
    corners = " ".join(f"{x * half[0]} {y * half[1]} {z * half[2]}" for x, y, z in product((-1, 1), repeat=3))
    return f'<mesh name="{name}" vertex="{corners}"/>', f'<geom type="mesh" mesh="{name}" pos="{at}"/>'


def boxed(name: str, at: str, half: tuple[float, float, float]) -> tuple[str, str]:
    """A box as a primitive: no asset, and its geom."""
    return "", f'<geom name="{name}" type="box" size="{" ".join(map(str, half))}" pos="{at}"/>'


@pytest.mark.parametrize("made", [meshed, boxed])
def test_a_door_without_a_range_opens_as_far_as_its_box_lets_it(
    made: Callable[[str, str, tuple[float, float, float]], tuple[str, str]], tmp_path: Path
) -> None:
    back, left, right, leaf = (
        made("back", "0 0.3 0", (0.3, 0.01, 0.3)), made("left", "-0.29 0 0", (0.01, 0.3, 0.3)),
        made("right", "0.29 0 0", (0.01, 0.3, 0.3)), made("leaf", "0.3 0 0", (0.3, 0.01, 0.3)),
    )  # fmt: skip
    door = f'<body name="door" pos="-0.3 -0.32 0"><joint name="hinge" axis="0 0 1"/>{leaf[1]}</body>'
    folder = tmp_path / "cupboard"
    folder.mkdir()
    assets = "".join(asset for asset, _ in (back, left, right, leaf))
    written(folder, f'<body name="box">{back[1]}{left[1]}{right[1]}{door}</body>', f"<asset>{assets}</asset>")
    mended, found = validate_authored(read(folder), PhysicsSettings())
    hinge = mended.features.joint("hinge")
    assert "limits_found" in {item.code for item in found} and hinge.lower is not None and hinge.upper is not None
    assert hinge.upper < 0.1 and hinge.lower < -3.0


def test_what_an_actuator_pulls_over_a_tendon_is_driven(tmp_path: Path) -> None:
    """A finger of two joints that its tendon spans, on an arm that it does not move, beside a lid."""
    finger = (
        '<body name="arm"><joint name="shoulder"/><geom size="0.1"/><site name="s0"/>'
        '<body name="one" pos="0 0 0.2"><joint name="first"/><geom size="0.1"/>'
        '<body name="two" pos="0 0 0.2"><joint name="second"/><geom size="0.1"/><site name="s1"/></body></body></body>'
    )
    rest = (
        '<tendon><spatial name="flexor"><site site="s0"/><site site="s1"/></spatial></tendon>'
        '<actuator><motor tendon="flexor"/></actuator>'
    )
    (work := tmp_path / "work").mkdir()
    made = urdf_of_mjcf(written(tmp_path, BODY.format(more=LID.format(more=SOLID)) + finger, rest), work)
    assert made.driven == {"first", "second"}


def test_a_bound_that_is_only_seen_is_no_part_beside_what_is_free(tmp_path: Path) -> None:
    """Robot hands' cubes have their bounds drawn round them: a body in the world that nothing weighs or touches."""
    seen = 'type="box" size="1 1 1" mass="0" contype="0" conaffinity="0" rgba="1 0 0 0.1"'
    bound = f'<body name="bound"><geom {seen}/></body>'
    cube = '<body name="cube"><freejoint/><geom type="box" size="0.1 0.1 0.1"/>' + LID.format(more=SOLID) + "</body>"
    made = urdf_of_mjcf(written(tmp_path, cube + bound), tmp_path)
    assert [link.get("name") for link in made.robot.findall("link")] == ["cube", "lid"] and not made.free
    solid = urdf_of_mjcf(written(tmp_path, cube + bound.replace('"1 0 0 0.1"', '"1 0 0 1"')), tmp_path)
    assert "bound" in [link.get("name") for link in solid.robot.findall("link")], "what one sees is not lost"
