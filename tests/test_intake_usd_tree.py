"""USD whose joints make no plain tree: a body of several joints, loops, hundreds of bodies that nothing holds."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from asset2sim.assets.urdf.read import element_joint
from asset2sim.assets.urdf.references import ANYWHERE
from asset2sim.intake.formats.usd import urdf_of_usd
from asset2sim.physics.kinematics import link_to_root, parents_first
from tests.usd_stages import at, body, joint, limits, plate, prim, usda

pytest.importorskip("pxr", reason="usd-core is not installed")
CUBE = prim("Cube", "cube", "double size = 0.1", apis=("PhysicsCollisionAPI",))
BODIES = [body(name, at((0.5 * n, 0.0, 0.0)), CUBE, mass=1.0) for n, name in enumerate("abc")]
KINEMATIC = "bool physics:kinematicEnabled = true"
SPARE = "bool physics:excludeFromArticulation = true"


def made(folder: Path, *inside: str) -> tuple[Any, str]:
    """The URDF of a stage, and its notes."""
    (folder / "thing.usda").write_text(usda(prim("Xform", "Thing", *inside)))
    found = urdf_of_usd(folder / "thing.usda", folder, ANYWHERE)
    return found.robot, "; ".join(found.notes)


def hinge(name: str, ends: tuple[str, str], axis: str, *more: str) -> str:
    first, second = ends
    across = 0.5 * ("abc".index(second) - "abc".index(first))
    line = f'uniform token physics:axis = "{axis}"'
    return joint("Revolute", name, (f"/Thing/{first}", f"/Thing/{second}"), line, *more, frame0=f"{across} 0 0")


def ways(robot: Any) -> dict[str, tuple[str, str]]:
    """Joint → its parent and child."""
    return {
        str(item.get("name")): (str(item.find("parent").get("link")), str(item.find("child").get("link")))
        for item in robot.findall("joint")
    }


def test_joints_of_one_body_follow_each_other_in_their_order(tmp_path: Path) -> None:
    robot, notes = made(tmp_path, *BODIES[:2], *(hinge(f"turn_{axis}", ("a", "b"), axis) for axis in "XYZ"))
    assert ways(robot) == {"turn_X": ("a", "b_1"), "turn_Y": ("b_1", "b_2"), "turn_Z": ("b_2", "b")}
    assert "loop" not in notes
    tree = parents_first([element_joint(item) for item in robot.findall("joint")])
    angles = {"turn_X": 0.3, "turn_Y": -0.4, "turn_Z": 0.7}
    turned = link_to_root(tree, "a", angles)["b"]
    expected = Rotation.from_euler("XYZ", [*angles.values()]).as_matrix()
    assert turned[:3, :3] == pytest.approx(expected, abs=1e-9)
    assert turned[:3, 3] == pytest.approx([0.5, 0.0, 0.0], abs=1e-9)


@pytest.mark.system
def test_leaves_of_one_pin_are_one_hinge(tmp_path: Path) -> None:
    robot, notes = made(tmp_path, *BODIES[:2], hinge("low", ("a", "b"), "Z"), hinge("high", ("a", "b"), "Z"))
    assert ways(robot) == {"low": ("a", "b")} and "'/Thing/high' following" in notes


@pytest.mark.system
@pytest.mark.parametrize(("kind", "said"), [("Fixed", "is stiff"), ("Spherical", "'/Thing/weld' closes a loop")])
def test_what_is_excluded_from_the_articulation_is_left_out_first(tmp_path: Path, kind: str, said: str) -> None:
    weld = joint(kind, "weld", ("/Thing/a", "/Thing/c"), SPARE)
    robot, notes = made(tmp_path, *BODIES, weld, hinge("near", ("a", "b"), "Z"), hinge("far", ("b", "c"), "Z"))
    assert ways(robot) == {"near": ("a", "b"), "far": ("b", "c")} and said in notes


def test_a_joint_follows_another_as_mujoco_s_equality_says(tmp_path: Path) -> None:
    tie = "rel mjc:target = </Thing/near>\nuniform double mjc:coef0 = 0.5\nuniform double mjc:coef1 = -1.5"
    robot, _ = made(tmp_path, *BODIES, hinge("near", ("a", "b"), "Z"), hinge("far", ("b", "c"), "Z", tie))
    mimic = dict(robot.find("joint[@name='far']/mimic").attrib)
    assert mimic == {"joint": "near", "multiplier": "-1.5", "offset": "0.5"}


def test_links_between_a_joint_s_axes_have_names_of_their_own(tmp_path: Path) -> None:
    bodies = (body("a", mass=1.0), body("link", at((0.5, 0, 0)), CUBE, mass=1.0), body("link_1", CUBE, mass=1.0))
    ball = joint("Spherical", "ball", ("/Thing/a", "/Thing/link"), frame0="0.5 0 0")
    near = joint("Revolute", "ball_1", ("/Thing/a", "/Thing/link_1"))
    robot, _ = made(tmp_path, *bodies, ball, near)
    for tag in ("link", "joint"):
        names = [item.get("name") for item in robot.findall(tag)]
        assert len({*names}) == len(names), names


def test_a_thousand_bodies_that_nothing_holds_are_parts_at_once(tmp_path: Path) -> None:
    bodies = (body(f"b{n}", at((0.2 * n, 0.0, 0.0)), CUBE if n < 2 else "", mass=1.0) for n in range(1050))
    (tmp_path / "thing.usda").write_text(usda(prim("Xform", "Thing", *bodies)))
    assert len(urdf_of_usd(tmp_path / "thing.usda", tmp_path, ANYWHERE).free) == 1050


def test_a_capsule_weighs_what_its_formula_says(tmp_path: Path) -> None:
    shape = prim("Capsule", "tube", "double radius = 0.1\ndouble height = 0.4", apis=("PhysicsCollisionAPI",))
    loose = prim("Xform", "a", shape, "float physics:density = 500", apis=("PhysicsRigidBodyAPI", "PhysicsMassAPI"))
    robot, _ = made(tmp_path, loose)
    tube, ball = 500.0 * math.pi * 0.004, 500.0 * math.pi * 0.004 / 3.0
    assert float(robot.find("link/inertial/mass").get("value")) == pytest.approx(tube + ball, rel=1e-7)
    along = tube * 0.01 / 2.0 + ball * 0.4 * 0.01
    half = 3.0 / 8.0 * 0.1  # how far the middle of half a ball lies from its face
    across = tube * (3.0 * 0.01 + 0.16) / 12.0 + ball * (83.0 / 320.0 * 0.01 + (0.2 + half) ** 2)
    inertia = robot.find("link/inertial/inertia")
    found = [float(inertia.get(key)) for key in ("ixx", "iyy", "izz")]
    assert found == pytest.approx([across, across, along], rel=1e-7)


def test_boards_of_one_mesh_that_meet_at_their_corners_weigh_what_each_does(tmp_path: Path) -> None:
    edges = [((0.4, 0.2, 0.01), (0.0, 0.0, 0.005)), ((0.01, 0.2, 0.19), (-0.195, 0.0, 0.105)),
             ((0.01, 0.2, 0.19), (0.195, 0.0, 0.105))]  # fmt: skip
    boxes = [trimesh.creation.box(size).apply_translation(place) for size, place in edges]
    boards: Any = trimesh.util.concatenate(boxes)
    points = ", ".join(f"({x}, {y}, {z})" for x, y, z in boards.vertices.tolist())
    corners = ", ".join(map(str, boards.faces.flatten().tolist()))
    shape = prim("Mesh", "boards", f"point3f[] points = [{points}]", f"int[] faceVertexIndices = [{corners}]",
        f"int[] faceVertexCounts = {[3] * len(boards.faces)}", apis=("PhysicsCollisionAPI",))  # fmt: skip
    loose = prim("Xform", "a", shape, "float physics:density = 500", apis=("PhysicsRigidBodyAPI", "PhysicsMassAPI"))
    robot, _ = made(tmp_path, loose)
    assert float(robot.find("link/inertial/mass").get("value")) == pytest.approx(500.0 * boards.volume, rel=1e-5)


@pytest.mark.parametrize(
    ("kind", "axis", "turn", "moved", "start"),
    [("Revolute", "Z", 0.6, (0.5, 0.0, 0.0), 0.6), ("Prismatic", "X", 0.0, (0.7, 0.0, 0.0), 0.2),
     ("Revolute", "Z", 0.0, (0.5, 0.0, 0.0), None), ("Revolute", "Z", 0.6, (0.5, 0.0, 0.3), 0.6),
     ("Fixed", "Z", 0.0, (0.5, 0.0, 0.3), None)],
)  # fmt: skip
def test_a_joint_starts_where_its_bodies_stand_on_the_stage(
    tmp_path: Path, kind: str, axis: str, turn: float, moved: tuple[float, ...], start: float | None
) -> None:
    """A body that stands off its joint's freedom is named: the joint's frames decide, as in PhysX."""
    quaternion = (np.cos(turn / 2), 0.0, 0.0, np.sin(turn / 2))
    line = "" if kind == "Fixed" else f'uniform token physics:axis = "{axis}"'
    part = body("b", at(moved, quaternion), plate("mesh", (0.3, 0.3, 0.3)), mass=1.0)
    robot, notes = made(tmp_path, BODIES[0], part, joint(kind, "j", ("/Thing/a", "/Thing/b"), line, frame0="0.5 0 0"))
    stated = robot.find("joint/dynamics[@start]")
    assert (None if stated is None else float(stated.get("start"))) == (start and pytest.approx(start))
    assert ("/Thing/j stand 0.3 m and 0 degrees off its frames" in notes) == (moved[2] > 0.0)


@pytest.mark.parametrize(
    ("mass", "density", "kept"),
    [("1.0", 1000.0, None), ("", 1000.0, None), ("1.02", 1000.0, None), ("3.0", 1000.0, 3.0), ("", 700.0, 0.7)],
)
def test_a_mass_at_mujocos_default_density_is_nobodys(
    tmp_path: Path, mass: str, density: float, kept: float | None
) -> None:
    apis = ("PhysicsCollisionAPI", "PhysicsMassAPI", "MjcCollisionAPI")
    cube = prim("Cube", "cube", "double size = 0.1", f"float physics:density = {density}", apis=apis)
    stated = f"float physics:mass = {mass}" if mass else ""
    robot, notes = made(tmp_path, prim("Xform", "b", stated, cube, apis=("PhysicsRigidBodyAPI", "PhysicsMassAPI")))
    found = robot.find("link/inertial/mass")
    assert (None if found is None else float(found.get("value"))) == (kept and pytest.approx(kept))
    assert ("at the density of water" in notes) == (kept is None)


def test_a_joint_limited_to_nothing_in_five_ways_is_a_hinge(tmp_path: Path) -> None:
    bounds = dict.fromkeys(("transX", "transY", "transZ", "rotX", "rotY"), (0.0, 0.0)) | {"rotZ": (-90.0, 90.0)}
    lines = [f"float limit:{name}:physics:{side} = {value}" for name, ends in bounds.items()
             for side, value in zip(("low", "high"), ends, strict=True)]  # fmt: skip
    robot, _ = made(tmp_path, *BODIES[:2], joint("", "d6", ("/Thing/a", "/Thing/b"), *lines, frame0="0.5 0 0"))
    assert [(item.get("name"), item.get("type")) for item in robot.findall("joint")] == [("d6", "revolute")]


def test_a_subset_without_material_has_its_mesh_s_colour(tmp_path: Path) -> None:
    subset = 'uniform token elementType = "face"\nuniform token familyName = "materialBind"\nint[] indices = [0, 1]'
    colour = "color3f[] primvars:displayColor = [(0.2, 0.4, 0.6)]"
    part = body("b", plate("mesh", (0.3, 0.3, 0.3), colour, prim("GeomSubset", "half", subset)), mass=1.0)
    robot, _ = made(tmp_path, part)
    colours = [[float(word) for word in item.get("rgba").split()] for item in robot.iter("color")]
    assert colours == [pytest.approx([0.2, 0.4, 0.6, 1.0], abs=1e-6)] * 2


@pytest.mark.parametrize(("height", "plain"), [(0.4, True), (0.4 / 12.0, False)])
def test_frames_of_a_scaled_body_are_read_as_its_bodies_stand(tmp_path: Path, height: float, plain: bool) -> None:
    """UsdPhysics has a position in the scale of its body; some write it without, 48 m off for a mast of 1.2 m."""
    cube = prim("Cube", "cube", "double size = 0.1", apis=("PhysicsCollisionAPI",))
    mast = body("mast", at((0.0, 0.0, 0.6), scale=(1.0, 1.0, 12.0)), cube, mass=20.0)
    lift = body("lift", at((0.0, 0.0, 1.0), scale=(3.0, 3.0, 1.0)), cube, mass=2.0)
    slide = joint("Prismatic", "slide", ("/Thing/mast", "/Thing/lift"), limits(-0.8, 0.0, "Z"), frame0=f"0 0 {height}")
    robot, notes = made(tmp_path, mast, lift, slide)
    place = [float(word) for word in robot.find("joint/origin").get("xyz").split()]
    assert place == pytest.approx([0.0, 0.0, 0.4]) and ("not in the scale of what it names" in notes) is plain


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("", ""),
        (prim("PhysicsFixedJoint", "anchor", "rel physics:body1 = </Thing/a>"), "its file joins it to the world"),
        (KINEMATIC, "its file has a program alone move its root"),
    ],
    ids=["free", "joined", "kinematic"],
)
def test_what_a_file_holds_where_it_is_is_held(tmp_path: Path, more: str, said: str) -> None:
    first = BODIES[0].replace("{", "{\n" + more, 1) if more == KINEMATIC else BODIES[0]
    parts = [first, BODIES[1], hinge("turn", ("a", "b"), "Z"), *([more] if more and more != KINEMATIC else [])]
    (tmp_path / "thing.usda").write_text(usda(prim("Xform", "Thing", *parts)))
    assert urdf_of_usd(tmp_path / "thing.usda", tmp_path, ANYWHERE).held == said


def test_what_moves_on_what_stands_still_is_held_by_it(tmp_path: Path) -> None:
    base = prim("Cube", "base", "double size = 0.3", apis=("PhysicsCollisionAPI",))
    lift = joint("Prismatic", "lift", ("/Thing/base", "/Thing/a"), limits(0.0, 1.0, "Z"), frame0="0 0 0.2")
    (tmp_path / "thing.usda").write_text(usda(prim("Xform", "Thing", base, BODIES[0], lift)))
    assert urdf_of_usd(tmp_path / "thing.usda", tmp_path, ANYWHERE).held == "its file has shapes in the world itself"
