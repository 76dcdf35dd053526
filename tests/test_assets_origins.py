"""URDFs from elsewhere, from the folder to every engine: each kind refined, exported and loaded."""

import math
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
import pytest
from lxml import etree

from asset2sim.assets.exports.mjcf import HOME
from asset2sim.assets.exports.refined_object import MJCF_NAME, USD_NAME
from asset2sim.assets.urdf.read import read_urdf
from asset2sim.engines.registry import installed, open_world
from asset2sim.physics.inertia import tensor_of
from schemas.asset import AssetRecord, AssetRef
from schemas.overlay import LinkPhysics
from schemas.vocabulary import Engine, Export, Severity, Status
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, prior, written
from tests.origins import (
    CAPSULE_LENGTH,
    CAPSULE_RADIUS,
    EXTRAS,
    NAMES,
    ORIGINS,
    WEDGE_M3,
    Origin,
    extras,
    floats,
    gears,
    unsupported,
)

pytestmark = pytest.mark.system
SETTINGS = NO_VIEWS.model_copy(update={"exports": (Export.MJCF, Export.USD)})


def refined(name: str, origin: Origin, folder: Path) -> tuple[AssetRecord, Path]:
    """The record of an asset, and its refined folder."""
    raw = written(folder / "raw" / name, "", origin.files)
    (raw / "mobility.urdf").write_bytes(origin.urdf.encode() if isinstance(origin.urdf, str) else origin.urdf)
    record = refine_asset(AssetRef(asset_id=name, path=str(raw)), folder / "out", SETTINGS, prior)
    return record, folder / "out" / "assets" / name


@cache
def done(name: str) -> tuple[AssetRecord, Path]:
    """One of ``ORIGINS``, refined once for all tests of this process."""
    return refined(name, ORIGINS[name], Path(mkdtemp(prefix="origins")))


def mass_of(record: AssetRecord, link: str) -> LinkPhysics:
    assert record.overlay is not None
    return next(item for item in record.overlay.links if item.name == link)


def attributes(folder: Path, path: str) -> Mapping[str, str]:
    found = etree.parse(str(folder / "mobility.urdf")).getroot().find(path)
    assert found is not None, path
    return {str(key): str(value) for key, value in found.attrib.items()}


@pytest.mark.parametrize("name", ORIGINS)
def test_every_kind_is_refined_and_loads_in_every_engine(name: str) -> None:
    """Ready, and the same links and joints in each engine, in its own file and in plain loaders of the exports."""
    record, folder = done(name)
    assert record.status is Status.OK, record.reason
    assert record.overlay is not None and record.features is not None
    links = {link.name for link in record.features.links}
    joints = {joint.name: joint.initial_position for joint in record.overlay.all_joints}
    for engine in installed():
        with open_world(
            engine, folder / "mobility.urdf", plane=True, timestep_s=1 / 240, contact_friction=0.5
        ) as world:
            assert world.console == () and set(world.link_names) == links and set(world.joint_names) == set(joints)
            world.place(joints)
            placed = dict(zip(world.joint_names, world.positions(), strict=True))
            assert placed == pytest.approx(joints, abs=1e-6)
    if Engine.MUJOCO in installed():
        import mujoco

        model = mujoco.MjModel.from_xml_path(str(folder / MJCF_NAME))
        home = model.key(HOME).qpos
        assert {name: home[model.joint(name).qposadr[0]] for name in joints} == pytest.approx(joints)
    usd = pytest.importorskip("pxr.Usd")
    stage = usd.Stage.Open(str(folder / USD_NAME))
    named = {prim.GetDisplayName() for prim in stage.Traverse()}
    assert links | set(joints) <= named


def test_a_mirrored_mesh_weighs_what_it_mirrors() -> None:
    """The wedge's centre of mass is at a third of its legs; a mirror image has it on the other side, and the products
    of inertia across the mirror turn their sign."""
    record, _ = done("mirrored")
    assert record.features is not None and record.overlay is not None
    right, left, wide = (record.features.link(name) for name in ("right", "left", "stretched"))
    assert [item.volume_m3 for item in (right, left, wide)] == pytest.approx([WEDGE_M3] * 3)
    assert right.center == pytest.approx((0.1, 0.05, 0.1))
    assert left.center == pytest.approx((-0.1, 0.05, 0.1))
    assert wide.center == pytest.approx((-0.2, -0.05, 0.05))
    x, y, z = mass_of(record, "right").com
    assert mass_of(record, "left").com == pytest.approx((-x, y, z)) and x > 0.0
    mirror = np.diag([-1.0, 1.0, 1.0])
    own, other = tensor_of(left.unit_inertia), tensor_of(right.unit_inertia)
    assert own == pytest.approx(mirror @ other @ mirror)
    # A right triangle of legs a, over the mass: Ixz about its centre is a²/36, and a²/18 + b²/12 along a leg.
    assert other[0, 2] == pytest.approx(0.3**2 / 36.0)
    assert other[0, 0] == pytest.approx(0.3**2 / 18.0 + 0.1**2 / 12.0)
    assert not [finding for finding in record.findings if finding.code == "inside_out"]


def test_a_capsule_is_written_as_what_every_loader_knows() -> None:
    record, folder = done("primitives")
    assert record.features is not None and record.overlay is not None
    bar, radius, length = record.features.link("bar"), CAPSULE_RADIUS, CAPSULE_LENGTH
    volume = math.pi * radius**2 * (length + 4.0 / 3.0 * radius)
    assert bar.volume_m3 == pytest.approx(volume, rel=0.02)
    assert bar.box_size == pytest.approx((2 * radius, 2 * radius, length + 2 * radius), rel=0.01)
    shapes = next(link for link in read_urdf(folder / "mobility.urdf").links if link.name == "bar").collisions
    scale = record.overlay.scale
    balls = [item for item in shapes if item.geometry.sphere is not None]
    assert sorted(item.origin[2, 3] for item in balls) == pytest.approx([-scale * length / 2, scale * length / 2])
    assert [item.geometry.sphere.radius for item in balls] == pytest.approx([scale * radius] * 2)
    straight = next(item.geometry.cylinder for item in shapes if item.geometry.cylinder is not None)
    assert (straight.radius, straight.length) == pytest.approx((scale * radius, scale * length))
    # About its middle: a cylinder and two half balls, 3/8 of their radius beyond its ends.
    body, caps = math.pi * radius**2 * length, 4.0 / 3.0 * math.pi * radius**3
    across = body * (radius**2 / 4 + length**2 / 12)
    across += caps * (83.0 / 320.0 * radius**2 + (length / 2 + 3.0 / 8.0 * radius) ** 2)
    assert bar.unit_inertia[0] == pytest.approx(across / (body + caps), rel=0.02)


def test_materials_keep_their_pictures_and_colours() -> None:
    record, folder = done("painted")
    assert attributes(folder, "material[@name='wood']/texture")["filename"] == "textures/wood.png"
    assert (folder / "textures/wood.png").read_bytes() == ORIGINS["painted"].files["textures/wood.png"]
    document = etree.parse(str(folder / MJCF_NAME)).getroot()
    colours = {str(item.get("rgba")) for item in document.iter("material") if item.get("texture") is None}
    assert {"1 0 0 1", "0 0 1 1"} <= colours
    assert [item.get("rgba") for item in document.iter("material") if item.get("texture")] == ["1 1 1 1"]
    door = next(link for link in read_urdf(folder / "mobility.urdf").links if link.name == "door")
    assert (len(door.visuals), len(door.collisions)) == (2, 2)
    assert record.overlay is not None
    assert mass_of(record, "looks").mass_kg > 0.0 and mass_of(record, "solid").mass_kg > 0.0


def test_a_mimic_is_kept_and_bound() -> None:
    """The follower goes to −2 q + 0.1 in the URDF, the overlay, the MJCF and the USD."""
    record, folder = done("gears")
    assert record.overlay is not None
    (drive,), (driven,) = record.overlay.joints, record.overlay.all_joints[1:]
    assert (driven.lower, driven.upper) == pytest.approx((-0.9, 1.1))
    assert driven.initial_position == pytest.approx(-2.0 * drive.initial_position + 0.1)
    stated = attributes(folder, "joint[@name='driven']/mimic")
    assert (stated["joint"], float(stated["multiplier"]), float(stated["offset"])) == ("drive", -2.0, 0.1)
    limit = attributes(folder, "joint[@name='driven']/limit")
    assert (float(limit["lower"]), float(limit["upper"])) == pytest.approx((-0.9, 1.1))
    equality = etree.parse(str(folder / MJCF_NAME)).getroot().find("equality/joint")
    assert equality is not None and (equality.get("joint1"), equality.get("joint2")) == ("driven", "drive")
    assert equality.get("polycoef") == "0.1 -2.0 0.0 0.0 0.0"
    usd = pytest.importorskip("pxr.Usd")
    stage = usd.Stage.Open(str(folder / USD_NAME))
    prim = next(item for item in stage.Traverse() if item.GetDisplayName() == "driven")
    degrees = math.degrees(0.1)
    assert prim.GetAttribute("physxMimicJoint:rotX:gearing").Get() == pytest.approx(2.0)
    assert prim.GetAttribute("physxMimicJoint:rotX:offset").Get() == pytest.approx(-degrees)
    assert prim.GetAttribute("newton:mimicCoef0").Get() == pytest.approx(degrees)
    assert prim.GetAttribute("newton:mimicCoef1").Get() == pytest.approx(-2.0)
    leader = prim.GetRelationship("newton:mimicJoint").GetTargets()
    assert leader == prim.GetRelationship("physxMimicJoint:rotX:referenceJoint").GetTargets()
    assert str(leader[0]).endswith("/joints/drive")


def test_a_mimic_holds_in_plain_mujoco() -> None:
    mujoco = pytest.importorskip("mujoco")
    _, folder = done("gears")
    model = mujoco.MjModel.from_xml_path(str(folder / MJCF_NAME))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key(HOME).id)
    drive, driven = (model.joint(name) for name in ("drive", "driven"))
    start = float(data.qpos[driven.qposadr[0]])
    friction = float(driven.frictionloss[0]) + float(drive.frictionloss[0]) / 2.0  # the drive turns half as far
    data.qfrc_applied[driven.dofadr[0]] = -1.1 * friction
    while data.time < 10.0 and start - data.qpos[driven.qposadr[0]] < 0.1:
        mujoco.mj_step(model, data)
    leader, follower = data.qpos[drive.qposadr[0]], data.qpos[driven.qposadr[0]]
    assert start - follower >= 0.1 and follower == pytest.approx(-2.0 * leader + 0.1, abs=2e-3)


def test_a_chain_of_mimics_across_kinds_scales_with_the_object() -> None:
    """dial = −10 · right + 0.2 and right = −left, so dial = 10 · left + 0.2, and at a scale 10 / scale · left + 0.2."""
    record, folder = done("gripper")
    assert record.overlay is not None
    scale, joints = record.overlay.scale, {joint.name: joint for joint in record.overlay.all_joints}
    assert set(joints) == {"left_slide", "right_slide", "dial_turn"} and len(record.overlay.joints) == 1
    assert joints["dial_turn"].mimic is not None and joints["dial_turn"].mimic.joint == "left_slide"
    assert joints["dial_turn"].mimic.multiplier == pytest.approx(10.0 / scale)
    assert (joints["dial_turn"].lower, joints["dial_turn"].upper) == pytest.approx((0.2, 1.2))
    stated = attributes(folder, "joint[@name='dial_turn']/mimic")
    assert stated["joint"] == "right_slide" and float(stated["multiplier"]) == pytest.approx(-10.0 / scale)


def test_mimics_that_mean_nothing_are_findings() -> None:
    record, folder = done("lost_mimics")
    told = {finding.joint: finding.message for finding in record.findings if finding.code == "mimic_unusable"}
    assert set(told) == {"lost", "own", "one", "two", "stuck"}
    assert (
        "'nowhere' is no joint" in told["lost"] and "itself" in told["own"] and "'foot' does not move" in told["stuck"]
    )
    assert etree.parse(str(folder / "mobility.urdf")).getroot().find(".//mimic") is None


def test_a_follower_that_ends_first_stops_its_leader(tmp_path: Path) -> None:
    """±2 rad at a ratio of −8 allow the leader ±0.25 rad about 0.0125, of its own ±0.5."""
    record, _ = refined("tight", gears(-8.0, 0.1), tmp_path)
    assert record.status is Status.OK and record.overlay is not None
    (drive,) = record.overlay.joints
    assert (drive.lower, drive.upper) == pytest.approx((-1.9 / 8.0, 2.1 / 8.0))
    assert [finding.joint for finding in record.findings if finding.code == "mimic_limits"] == ["drive"]


def test_an_object_that_floats_on_an_empty_root_is_free() -> None:
    record, folder = done("floats")
    assert [link.name for link in read_urdf(folder / "mobility.urdf").links] == ["body", "door"]
    assert [finding.severity for finding in record.findings if finding.code == "root_floats"] == [Severity.INFO]


def test_a_link_may_be_named_world(tmp_path: Path) -> None:
    """MuJoCo has a body of that name already."""
    urdf = str(floats().urdf).replace('type="floating"', 'type="fixed"')
    record, folder = refined("fixed", Origin(urdf), tmp_path)
    assert record.status is Status.OK, record.reason
    assert {report.engine for report in record.reports if report.problem is None} == set(installed())
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_path(str(folder / MJCF_NAME))
    assert [model.body(index).name for index in range(model.nbody)] == ["world", "world_link", "body", "door"]


@pytest.mark.parametrize(("kind", "code"), [("planar", "joint_in_steps"), ("floating", "part_floats")])
def test_planar_and_floating_parts_are_refined(tmp_path: Path, kind: str, code: str) -> None:
    record, folder = refined(kind, unsupported(kind), tmp_path)
    assert record.status is Status.OK, record.reason
    assert code in {finding.code for finding in record.findings if finding.joint == "move"}
    assert record.overlay is not None
    masses = {item.name: item.mass_kg for item in record.overlay.links}
    assert sum(masses.values()) - masses["body"] < 1.3 * masses["puck"], "its steps take from it, not from the body"
    moving = sorted(item.type for item in read_urdf(folder / "mobility.urdf").joints if item.type != "fixed")
    assert moving == (["continuous", "prismatic", "prismatic"] if kind == "planar" else [])


def test_tags_that_we_do_not_know_are_kept() -> None:
    _, folder = done("extras")
    kept = etree.parse(str(folder / "mobility.urdf"), etree.XMLParser(remove_blank_text=True)).getroot()
    given = etree.fromstring(f"<robot>{EXTRAS}</robot>", etree.XMLParser(remove_blank_text=True))
    found = [kept.find(f"{tag}[{number}]") for tag, number in
             (("transmission", 1), ("gazebo", 1), ("gazebo", 2), ("ros2_control", 1))]  # fmt: skip
    assert None not in found
    assert [etree.tostring(item, with_tail=False) for item in found if item is not None] == [
        etree.tostring(item, with_tail=False) for item in given
    ]
    assert attributes(folder, "link[@name='door']/verbose") == {"value": "yes"}
    assert attributes(folder, "joint[@name='hinge']/safety_controller") == {"k_velocity": "10", "soft_upper_limit": "1"}
    assert str(extras().urdf).count("gazebo") > 2


def test_what_a_urdf_leaves_out_is_completed() -> None:
    record, folder = done("sparse")
    assert record.features is not None and record.overlay is not None
    joint = record.features.joint
    assert joint("pan").axis == (0.0, 0.0, 1.0) and joint("roll").axis == (1.0, 0.0, 0.0)
    assert joint("roll").type == "continuous"
    assert (joint("pull").lower, joint("pull").upper) == (0.0, 0.1)
    assert attributes(folder, "joint[@name='stiff']")["type"] == "fixed"
    assert [mass_of(record, name).mass_kg > 0.0 for name in ("cross", "head", "body")] == [True] * 3


def test_names_of_any_kind_stay() -> None:
    record, folder = done("named")
    assert record.overlay is not None
    assert tuple(joint.name for joint in record.overlay.joints) == NAMES
    robot = read_urdf(folder / "mobility.urdf")
    assert tuple(joint.name for joint in robot.joints) == NAMES


def test_an_odd_document_reads_as_any_other() -> None:
    record, folder = done("document")
    assert record.features is not None
    assert record.features.link("door").box_size == pytest.approx((0.02, 0.3, 0.2))
    text = (folder / "mobility.urdf").read_bytes()
    assert text.startswith(b"<?xml") and b"\r" not in text
    root = etree.fromstring(text)
    assert (root.tag, root.get("name")) == ("robot", "document")
    assert [finding.code for finding in record.findings if finding.code == "robot_unnamed"] == ["robot_unnamed"]
