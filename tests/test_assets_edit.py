"""Editing a URDF: the refined document compared as a parsed model with values worked out by hand."""

import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import yourdfpy
from lxml import etree

from asset2sim.assets.folder import Folder, replace_hulls, write_folder, write_urdf
from asset2sim.assets.hulls import collision_hulls
from asset2sim.assets.urdf.edit import short_number
from asset2sim.assets.urdf.read import read_urdf
from asset2sim.validation.validate import validate
from schemas.overlay import JointProposal, LinkProposal, Overlay, PhysicsOverlay
from schemas.settings import PhysicsSettings
from schemas.vocabulary import CollisionMode, Source
from tests.assets import box_obj, fingerprint, joint, link, mesh, near, read, robot, shape, written
from tests.test_assets_surface import shell_moments

PHYSICS = PhysicsSettings()
S = 0.5
GOLDEN = """<?xml version="1.0"?>
<!-- drawn by hand -->
<robot name="press">
  <!-- a note that stays -->
  <!-- asset2sim: scale 3; initial joint positions (rad, m): old = 1 -->
  <material name="red"><color rgba="1 0 0 1"/></material>
  <link name="body" custom="yes">
    <inertial><mass value="99"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <visual name="shell">
      <origin xyz="0 0 0.5" rpy="0 0 1.5"/><geometry><box size="2 1 1"/></geometry><material name="red"/>
    </visual>
    <collision><origin xyz="0 0 0.5" rpy="0 0 1.5"/><geometry><box size="2 1 1"/></geometry></collision>
    <kept_by_us attribute="7"/>
  </link>
  <link name="door">
    <visual><origin xyz="0.1 0 0"/><geometry><mesh filename="meshes/door.obj" scale="2 1 1"/></geometry></visual>
    <collision><geometry><mesh filename="meshes/door.obj"/></geometry></collision>
  </link>
  <link name="pin">
    <visual><geometry><cylinder radius="0.2" length="0.6"/></geometry></visual>
    <collision><geometry><cylinder radius="0.2" length="0.6"/></geometry></collision>
    <visual><origin xyz="0 0 0.4"/><geometry><sphere radius="0.1"/></geometry></visual>
  </link>
  <link name="tip"><visual><geometry><box size="0.2 0.2 0.2"/></geometry></visual>
    <collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link>
  <joint name="door_hinge" type="revolute">
    <origin xyz="1 0.5 0.25" rpy="0.1 0.2 0.3"/><parent link="body"/><child link="door"/>
    <axis xyz="0 0 2"/><limit lower="-0.5" upper="1.5" effort="7" velocity="3"/>
    <calibration rising="0.25"/><safety_controller k_velocity="5"/>
  </joint>
  <joint name="pin_slide" type="prismatic">
    <origin xyz="0 0 1.5"/><parent link="body"/><child link="pin"/>
    <axis xyz="0 0 1"/><limit lower="0" upper="0.8"/><dynamics damping="0.1" other="kept"/>
  </joint>
  <joint name="tip_weld" type="fixed"><origin xyz="0 0 1"/><parent link="pin"/><child link="tip"/></joint>
  <gazebo reference="body"><mu1>0.7</mu1></gazebo>
  <transmission name="drive"><type>simple</type><joint name="door_hinge"/></transmission>
</robot>
"""
PROPOSAL = Overlay(
    scale=S,
    links=(
        LinkProposal(name="body", density_kg_m3=800.0, hollow_factor=0.5),
        LinkProposal(name="door", density_kg_m3=500.0, hollow_factor=1.0),
        LinkProposal(name="pin", density_kg_m3=1000.0, hollow_factor=1.0),
        LinkProposal(name="tip", mass_kg=0.25),
    ),
    joints=(
        JointProposal(name="door_hinge", friction=0.125, damping=0.0625),
        JointProposal(name="pin_slide", coast_s=0.5, friction=0.75),
    ),
    initial_joint_positions={"door_hinge": 0.75, "pin_slide": 0.4},
    asked=("scale", "door_hinge", "pin_slide"),
)
near9 = partial(near, tolerance=1e-8)


@dataclass(frozen=True)
class Refined:
    """One asset before and after."""

    folder: Folder
    overlay: PhysicsOverlay
    model: yourdfpy.Robot
    root: etree._Element

    def joint(self, name: str) -> yourdfpy.Joint:
        return next(item for item in self.model.joints if item.name == name)

    def link(self, name: str) -> yourdfpy.Link:
        return next(item for item in self.model.links if item.name == name)


def refine(source: Path, target: Path, proposal: Overlay) -> Refined:
    item = read(source)
    overlay, _ = validate(item, proposal, Source.MODEL, 0.5, PHYSICS)
    folder = write_folder(item, overlay, collision_hulls(item, overlay.scale), target, PHYSICS)
    return Refined(folder, overlay, read_urdf(folder.urdf), etree.parse(str(folder.urdf)).getroot())


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("golden") / "press"
    return written(folder, GOLDEN, {"meshes/door.obj": box_obj((0, 0, 0), (0.5, 0.1, 1.0))})


@pytest.fixture(scope="module")
def golden(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Refined:
    return refine(source, tmp_path_factory.mktemp("refined") / "press", PROPOSAL)


def test_links_and_joints_are_the_same(golden: Refined) -> None:
    assert [item.name for item in golden.model.links] == ["body", "door", "pin", "tip"]
    found = [(item.name, item.type, item.parent, item.child) for item in golden.model.joints]
    assert found == [
        ("door_hinge", "revolute", "body", "door"), ("pin_slide", "prismatic", "body", "pin"),
        ("tip_weld", "fixed", "pin", "tip"),
    ]  # fmt: skip


def rotation(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Yaw after pitch after roll, written out."""
    cr, sr, cp, sp, cy, sy = *cs(roll), *cs(pitch), *cs(yaw)
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return np.asarray(about_z @ about_y @ about_x)


def cs(angle: float) -> tuple[float, float]:
    return math.cos(angle), math.sin(angle)


def test_origins_move_and_do_not_turn(golden: Refined) -> None:
    origin = golden.joint("door_hinge").origin
    assert near9(origin[:3, 3], (0.5, 0.25, 0.125)) and near9(origin[:3, :3], rotation(0.1, 0.2, 0.3))
    assert near9(golden.joint("pin_slide").origin[:3, 3], (0, 0, 0.75))
    assert near9(golden.joint("tip_weld").origin[:3, 3], (0, 0, 0.5))
    (shell,) = golden.link("body").visuals
    (solid,) = golden.link("body").collisions
    for item in (shell, solid):
        assert near9(item.origin[:3, 3], (0, 0, 0.25)) and near9(item.origin[:3, :3], rotation(0, 0, 1.5))
        assert near9(item.geometry.box.size, (1.0, 0.5, 0.5))


def test_primitives_scale(golden: Refined) -> None:
    pin = golden.link("pin")
    cylinders = [item.geometry.cylinder for item in (*pin.visuals, *pin.collisions) if item.geometry.cylinder]
    assert len(cylinders) == 2
    for item in cylinders:
        assert near9((item.radius, item.length), (0.1, 0.3))
    ball = pin.visuals[1]
    assert near9(ball.geometry.sphere.radius, 0.05) and near9(ball.origin[:3, 3], (0, 0, 0.2))


def test_a_visual_mesh_scales_and_its_collision_is_a_hull(golden: Refined) -> None:
    (look,) = golden.link("door").visuals
    assert look.geometry.mesh.filename == "meshes/door.obj" and near9(look.geometry.mesh.scale, (1.0, 0.5, 0.5))
    assert near9(look.origin[:3, 3], (0.05, 0, 0))
    (solid,) = golden.link("door").collisions
    text = (golden.folder.path / solid.geometry.mesh.filename).read_text()
    corners = np.array([[float(v) for v in line.split()[1:]] for line in text.splitlines() if line.startswith("v ")])
    assert len(corners) == 8 and near9(corners.min(axis=0), (0, 0, 0)) and near9(corners.max(axis=0), (0.25, 0.05, 0.5))
    assert solid.origin is None or near9(solid.origin, np.eye(4))


def inertial(golden: Refined, name: str) -> tuple[float, np.ndarray, np.ndarray]:
    item = golden.link(name).inertial
    assert len(golden.root.findall(f"link[@name='{name}']/inertial")) == 1
    return item.mass, item.origin[:3, 3], item.inertia


def solid_box(mass: float, x: float, y: float, z: float) -> np.ndarray:
    return np.diag([y * y + z * z, x * x + z * z, x * x + y * y]) * mass / 12.0


def test_inertials_are_worked_out_by_hand(golden: Refined) -> None:
    mass, com, inertia = inertial(golden, "body")
    turned = rotation(0, 0, 1.5)
    assert near9(mass, 2.0 * S**3 * 800.0 * 0.5) and near9(com, (0, 0, 0.25))
    half_full = (solid_box(100.0, 1.0, 0.5, 0.5) + 100.0 * np.diag(shell_moments(1.0, 0.5, 0.5))) / 2.0
    assert near9(inertia, turned @ half_full @ turned.T)
    mass, com, inertia = inertial(golden, "door")
    assert near9(mass, 0.05 * S**3 * 500.0) and near9(com, (0.125, 0.025, 0.25))
    assert near9(inertia, solid_box(3.125, 0.25, 0.05, 0.5))
    mass, com, inertia = inertial(golden, "tip")
    assert near9(mass, 0.25) and near9(com, (0, 0, 0)) and near9(inertia, solid_box(0.25, 0.1, 0.1, 0.1))
    # A cylinder is drawn as a prism of 32 sides, a little less than round.
    mass, com, inertia = inertial(golden, "pin")
    assert near(mass, math.pi * 0.2**2 * 0.6 * S**3 * 1000.0, 0.01) and near9(com, (0, 0, 0))
    across = mass * (3.0 * 0.1**2 + 0.3**2) / 12.0
    assert near(np.diag(inertia), (across, across, mass * 0.1**2 / 2.0), 0.02)


def test_limits_and_dynamics(golden: Refined) -> None:
    hinge, slide = golden.joint("door_hinge"), golden.joint("pin_slide")
    assert near9(hinge.axis, (0, 0, 1)) and near9(slide.axis, (0, 0, 1))
    assert (hinge.limit.lower, hinge.limit.upper, hinge.limit.effort, hinge.limit.velocity) == (-0.5, 1.5, 7.0, 3.0)
    assert (slide.limit.lower, slide.limit.upper) == (0.0, 0.4)
    # The pin is heavy: what it takes to hold and to move it is more than the default.
    pull = (golden.link("pin").inertial.mass + 0.25) * 9.81
    needed = PHYSICS.effort_margin * (float(slide.dynamics.friction) + pull)
    assert near9((slide.limit.effort, slide.limit.velocity), (needed, PHYSICS.default_velocity))
    # A requested state is held with one and a half times gravity's pull there, or by as much as a bump pulls sideways.
    frame = rotation(0.1, 0.2, 0.3)
    arm = frame @ rotation(0, 0, 0.75) @ np.array((0.125, 0.025, 0.25))
    lever = np.cross(frame[:, 2], arm)
    held = 3.125 * 9.81 * max(2.0 * abs(lever[2]), 0.25 * float(np.linalg.norm(lever)))
    assert held > 0.125 and near9((hinge.dynamics.damping, hinge.dynamics.friction), (0.0625, held))
    # The pin carries its tip.
    load = (golden.link("pin").inertial.mass + 0.25) * 9.81
    # It is far too heavy for a hand, so that its friction only just holds it.
    assert near9(slide.dynamics.friction, PHYSICS.least_hold_margin * load)
    part = next(item for item in golden.overlay.joints if item.name == "pin_slide")
    assert near9(slide.dynamics.damping, part.effective_inertia / 0.5)
    written_terms = golden.root.find("joint[@name='pin_slide']/dynamics")
    assert written_terms is not None
    assert written_terms.get("spring_stiffness") == "0" and written_terms.get("other") == "kept"
    assert golden.root.find("joint[@name='tip_weld']/dynamics") is None


def plain(element: etree._Element) -> list[tuple[str, dict[str, str], str]]:
    """An element and all below it: tags, attributes and words."""
    items = [item for item in element.iter() if not isinstance(item, etree._Comment)]
    return [
        (str(item.tag), {str(k): str(v) for k, v in item.attrib.items()}, (item.text or "").strip()) for item in items
    ]


def test_everything_else_is_kept(golden: Refined, source: Path) -> None:
    before = etree.parse(str(source / "mobility.urdf")).getroot()
    for path in (
        "material", "gazebo", "transmission", "link[@name='body']/kept_by_us", "link[@name='body']/visual/material",
        "joint[@name='door_hinge']/calibration", "joint[@name='door_hinge']/safety_controller",
    ):  # fmt: skip
        old, new = before.find(path), golden.root.find(path)
        assert old is not None and new is not None, path
        assert plain(old) == plain(new)
    assert golden.root.get("name") == "press" and isinstance(golden.root[1], etree._Comment)
    assert golden.root.find("link[@name='body']").attrib == {"name": "body", "custom": "yes"}  # type: ignore[union-attr]


def test_a_comment_names_the_initial_positions(golden: Refined) -> None:
    texts = [str(item.text) for item in golden.root.iter(etree.Comment)]
    assert texts[0] == " asset2sim: scale 0.5; initial joint positions (rad, m): door_hinge = 0.75; pin_slide = 0.2 "
    assert " a note that stays " in texts
    assert sum("asset2sim" in text for text in texts) == 1, "that of an earlier run goes"
    assert golden.overlay.initial_positions == {"door_hinge": 0.75, "pin_slide": 0.2}


def test_the_input_is_not_written_to(source: Path, tmp_path: Path) -> None:
    before = fingerprint(source)
    refine(source, tmp_path / "out", PROPOSAL)
    assert fingerprint(source) == before


def test_refining_what_was_refined_changes_no_geometry(golden: Refined, tmp_path: Path) -> None:
    again = refine(golden.folder.path, tmp_path / "again", PROPOSAL.model_copy(update={"scale": 1.0}))
    for old, new in zip(golden.model.joints, again.model.joints, strict=True):
        assert near9(old.origin, new.origin), old.name
    old_mesh, new_mesh = (item.link("door").visuals[0].geometry.mesh for item in (golden, again))
    assert near9(old_mesh.scale, new_mesh.scale)
    assert len(again.link("door").collisions) == 1


def two_boxes(weld: str) -> str:
    return robot(link("a", shape("1 1 1")), link("b", shape("1 1 1")), weld)


@pytest.mark.parametrize(
    ("kind", "limit", "axis", "moved", "turned"),
    [
        ("prismatic", "0.5 0.5", "0 1 0", (0.0, 0.25, 1.0), np.eye(3)),
        ("revolute", "0.5 0.5", "0 0 1", (0.0, 0.0, 1.0), rotation(0, 0, 0.5)),
        ("revolute", "0 0", "0 0 1", (0.0, 0.0, 1.0), np.eye(3)),
    ],
)
def test_a_locked_joint_is_written_as_fixed_where_its_limits_hold_it(
    tmp_path: Path, kind: str, limit: str, axis: str, moved: tuple[float, ...], turned: np.ndarray
) -> None:
    terms = '<dynamics damping="1"/>'
    urdf = two_boxes(joint("stuck", kind, "a", "b", xyz="0 0 2", axis=axis, limit=limit, more=terms))
    refined = refine(written(tmp_path / "in", urdf), tmp_path / "out", Overlay(scale=0.5))
    stuck = refined.joint("stuck")
    assert stuck.type == "fixed" and near9(stuck.origin[:3, 3], moved) and near9(stuck.origin[:3, :3], turned)
    element = refined.root.find("joint[@name='stuck']")
    assert element is not None
    assert {child.tag for child in element} == {"origin", "parent", "child"}


def test_a_continuous_joint_gets_no_limits(tmp_path: Path) -> None:
    urdf = two_boxes(joint("spin", "continuous", "a", "b", xyz="0 0 2", axis="0 0 1"))
    refined = refine(written(tmp_path / "in", urdf), tmp_path / "out", Overlay(scale=0.5))
    limit = refined.root.find("joint[@name='spin']/limit")
    assert limit is not None and set(limit.attrib) == {"effort", "velocity"}


def test_names_that_a_comment_cannot_hold(tmp_path: Path) -> None:
    urdf = two_boxes(joint("a--b-", "revolute", "a", "b", xyz="0 0 2", axis="0 0 1", limit="0 1"))
    refined = refine(written(tmp_path / "in", urdf), tmp_path / "out", Overlay(scale=0.5))
    assert [item.name for item in refined.model.joints] == ["a--b-"]


@pytest.mark.parametrize(("value", "text"), [(0.5, "0.5"), (1.0, "1"), (1 / 3, "0.333333333"), (1e-9, "1e-09")])
def test_numbers_are_short(value: float, text: str) -> None:
    assert short_number(value) == text


def test_kept_collision_geometry_is_as_authored_only_scaled(source: Path, tmp_path: Path) -> None:
    item = read(source)
    overlay, _ = validate(item, PROPOSAL, Source.MODEL, 0.5, PHYSICS)
    hulls = collision_hulls(item, overlay.scale)
    folder = write_folder(item, overlay, hulls, tmp_path / "kept", PHYSICS, CollisionMode.KEEP)
    assert not (folder.path / "collision").exists() and replace_hulls(folder, hulls) == folder
    door = next(item for item in read_urdf(folder.urdf).links if item.name == "door")
    (shell,) = door.collisions
    assert (folder.path / shell.geometry.mesh.filename).is_file()
    assert near9(shell.geometry.mesh.scale, (S, S, S)), "the collision reference states no scale of its own"
    body = next(item for item in read_urdf(folder.urdf).links if item.name == "body")
    assert near9(body.collisions[0].geometry.box.size, (2 * S, S, S)) and len(body.collisions) == 1
    before = folder.urdf.read_bytes()
    write_urdf(item, overlay, folder, PHYSICS)
    assert folder.urdf.read_bytes() == before


def test_kept_collision_drops_missing_meshes_and_invents_none(tmp_path: Path) -> None:
    urdf = robot(
        link("a", shape("1 1 1", "visual")), link("b", shape("1 1 1") + mesh("gone.obj", "collision")),
        joint("j", "revolute", "a", "b", axis="0 0 1", limit="0 1"),
    )  # fmt: skip
    item = read(written(tmp_path / "in", urdf))
    overlay, _ = validate(item, Overlay(scale=1.0), Source.MODEL, 0.5, PHYSICS)
    hulls = collision_hulls(item, 1.0)
    kept = write_folder(item, overlay, hulls, tmp_path / "kept", PHYSICS, CollisionMode.KEEP)
    counts = {item.name: len(item.collisions) for item in read_urdf(kept.urdf).links}
    assert counts == {"a": 0, "b": 1}


def test_mimics_and_safety_limits_of_sliders_are_scaled(tmp_path: Path) -> None:
    urdf = robot(
        link("a", shape("1 1 1")), link("b", shape("1 1 1")), link("c", shape("1 1 1")), link("d", shape("1 1 1")),
        joint("turn", "revolute", "a", "b", axis="0 0 1", limit="0 1",
              more='<safety_controller k_velocity="1" soft_lower_limit="0.1"/>'),
        joint("slide", "prismatic", "a", "c", axis="0 0 1", limit="0 1",
              more='<mimic joint="turn" multiplier="2" offset="0.5"/><safety_controller k_velocity="1" '
                   'soft_upper_limit="0.8"/><calibration rising="0.2"/>'),
        joint("back", "revolute", "a", "d", axis="0 0 1", limit="0 1", more='<mimic joint="slide" offset="0.25"/>'),
    )  # fmt: skip
    found = refine(written(tmp_path / "in", urdf), tmp_path / "out", Overlay(scale=S)).root

    def stated(name: str, tag: str) -> dict[str, float]:
        element = next(item for item in found.findall("joint") if item.get("name") == name).find(tag)
        assert element is not None
        return {str(key): float(text) for key, text in element.items() if key != "joint"}

    assert stated("slide", "mimic") == {"multiplier": 2 * S, "offset": 0.5 * S}
    assert stated("back", "mimic") == {"multiplier": 1 / S, "offset": 0.25}
    assert stated("slide", "safety_controller") == {"k_velocity": 1.0, "soft_upper_limit": 0.8 * S}
    assert stated("slide", "calibration") == {"rising": 0.2 * S}
    assert stated("turn", "safety_controller")["soft_lower_limit"] == 0.1


def test_limits_that_the_loop_shortened_are_written(source: Path, tmp_path: Path) -> None:
    item = read(source)
    overlay, _ = validate(item, PROPOSAL, Source.MODEL, 0.5, PHYSICS)
    hinge = overlay.joints[0].model_copy(update={"upper": 1.25, "limits_source": Source.SEARCH})
    overlay = overlay.model_copy(update={"joints": (hinge, *overlay.joints[1:])})
    folder = write_folder(item, overlay, collision_hulls(item, S), tmp_path / "out", PHYSICS)
    limit = next(item for item in read_urdf(folder.urdf).joints if item.name == "door_hinge").limit
    assert near9((limit.lower, limit.upper), (-0.5, 1.25))
