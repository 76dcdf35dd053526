"""An object stays what it is however its file describes it: turned frames, flipped axes, other names, another size."""

import shutil
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from lxml import etree
from scipy.spatial.transform import Rotation

from asset2sim.assets.surfaces.scene import load_scene
from asset2sim.assets.urdf.read import element_pose, numbers_of_attribute
from asset2sim.models.motion_facts import joint_motions
from asset2sim.models.object_facts import axis_names, candidate_sizes
from asset2sim.physics.arrays import Array
from schemas.asset import AssetRef
from schemas.features import Features
from schemas.overlay import JointPhysics, PhysicsOverlay
from schemas.settings import Settings
from tasks.extract import extract_asset
from tasks.progress import AssetJob
from tests.assets import prior, sample, validated

SAMPLES = (
    *("bucket_yellow", "storage_sideboard", "laptop_silver", "suitcase_business", "microwave_kitchen", "stapler_desk"),
    *("table_two_drawers", "toilet_white", "trashcan_pedal", "scissors_paper", "chair_folding", "box_chest"),
)
ALIKE_AJAR = ("laptop_silver", "microwave_kitchen", "stapler_desk", "table_two_drawers", "scissors_paper")
"""Those that are refined alike drawn ajar, too: what is "small" is as small as it is drawn, a pedal rests so, and which
end of a folding chair is unfolded is told by where it is drawn."""
THIN = ("suitcase_business", "with_parts_fixed_on")
"""Its handle is of two thin pieces: each is at most solid in its own hull, together they are at most so in theirs."""
LARGER = 2.7
MOVES = ("revolute", "continuous", "prismatic")
SLACK = 0.04
"""Share by which masses and loads may differ: walls are sampled along fixed directions."""


def placed(element: "etree._Element", pose: Array) -> None:
    """Give an element this (4, 4) origin."""
    origin = element.find("origin")
    origin = etree.SubElement(element, "origin") if origin is None else origin
    origin.set("xyz", " ".join(map(repr, pose[:3, 3].tolist())))
    origin.set("rpy", " ".join(map(repr, Rotation.from_matrix(pose[:3, :3]).as_euler("xyz").tolist())))


def part(element: "etree._Element", tag: str) -> "etree._Element":
    """The child of that tag, which is there."""
    found = element.find(tag)
    assert found is not None
    return found


def with_axis(joint: "etree._Element", axis: Array) -> None:
    part(joint, "axis").set("xyz", " ".join(map(repr, axis.tolist())))


def turn_of(matrix: Array) -> Array:
    pose = np.eye(4)
    pose[:3, :3] = matrix
    return pose


def moved_root(robot: "etree._Element", pose: Array) -> None:
    for joint in robot.iter("joint"):
        if part(joint, "parent").get("link") == "base":
            placed(joint, pose @ element_pose(joint))


def in_turned_frames(robot: "etree._Element") -> None:
    """Every link but the root in a frame of its own that is turned at random."""
    random = np.random.default_rng(3)
    turns = {link.get("name"): turn_of(Rotation.random(random_state=random).as_matrix()) for link in robot.iter("link")}
    turns["base"] = np.eye(4)
    for link in robot.iter("link"):
        for shape in (*link.iter("visual"), *link.iter("collision")):
            placed(shape, turns[link.get("name")].T @ element_pose(shape))
    for joint in robot.iter("joint"):
        parent, child = (turns[part(joint, end).get("link")] for end in ("parent", "child"))
        placed(joint, parent.T @ element_pose(joint) @ child)
        if joint.find("axis") is not None:
            with_axis(joint, child[:3, :3].T @ numbers_of_attribute(joint.find("axis"), "xyz", "1 0 0"))


def about_flipped_axes(robot: "etree._Element") -> None:
    """Every joint about the opposite axis, from minus its upper to minus its lower limit."""
    for joint in robot.iter("joint"):
        if joint.get("type") in MOVES:
            with_axis(joint, -np.asarray(numbers_of_attribute(joint.find("axis"), "xyz", "1 0 0")))
            limit = joint.find("limit")
            if limit is not None and limit.get("lower") is not None:
                lower, upper = (float(limit.get(end, "")) for end in ("lower", "upper"))
                limit.set("lower", repr(-upper))
                limit.set("upper", repr(-lower))


def far_from_its_origin(robot: "etree._Element") -> None:
    pose = np.eye(4)
    pose[:3, 3] = (3.0, -2.0, 5.0)
    moved_root(robot, pose)


def in_other_frames(robot: "etree._Element") -> None:
    """All three at once: what depends on one of them shows, in two thirds less time."""
    for way in (in_turned_frames, about_flipped_axes, far_from_its_origin):
        way(robot)


def facing_along_y(robot: "etree._Element") -> None:
    moved_root(robot, turn_of(Rotation.from_euler("z", np.pi / 2.0).as_matrix()))


def in_other_units(robot: "etree._Element") -> None:
    """All lengths times a factor: of meshes by their scale."""
    for element in (*robot.iter("visual"), *robot.iter("collision"), *robot.iter("joint")):
        pose = element_pose(element)
        pose[:3, 3] *= LARGER
        placed(element, pose)
    for mesh in robot.iter("mesh"):
        scales = numbers_of_attribute(mesh, "scale", "1 1 1")
        mesh.set("scale", " ".join(repr(LARGER * scale) for scale in scales))
    for limit in robot.iterfind("joint[@type='prismatic']/limit"):
        for end in ("lower", "upper"):
            limit.set(end, repr(LARGER * float(limit.get(end, ""))))


def with_parts_fixed_on(robot: "etree._Element") -> None:
    """The last shape of every link that has several as a link of its own, fixed to it."""
    for link in list(robot.iter("link")):
        looks, solids = link.findall("visual"), link.findall("collision")
        if len(looks) > 1 and len(solids) in (0, len(looks)):
            on = etree.SubElement(robot, "link", name=f"{link.get('name')}_part")
            on.extend([looks[-1], *solids[-1:]])
            fixed = etree.SubElement(robot, "joint", name=f"{link.get('name')}_fixed", type="fixed")
            etree.SubElement(fixed, "parent", link=link.get("name", ""))
            etree.SubElement(fixed, "child", link=on.get("name", ""))


def drawn_ajar(robot: "etree._Element") -> None:
    """Every joint's zero where it is open by 60 % of its range, as in files that are drawn ajar."""
    for joint in robot.iter("joint"):
        limit = joint.find("limit")
        if joint.get("type") not in ("revolute", "prismatic") or limit is None:
            continue
        lower, upper = (float(limit.get(end, "")) for end in ("lower", "upper"))
        axis = np.asarray(numbers_of_attribute(joint.find("axis"), "xyz", "1 0 0"))
        moved, at = np.eye(4), lower + 0.6 * (upper - lower)
        if joint.get("type") == "revolute":
            moved[:3, :3] = Rotation.from_rotvec(at * axis / np.linalg.norm(axis)).as_matrix()
        else:
            moved[:3, 3] = at * axis / np.linalg.norm(axis)
        placed(joint, element_pose(joint) @ moved)
        limit.set("lower", repr(lower - at))
        limit.set("upper", repr(upper - at))


WAYS: tuple[Callable[["etree._Element"], None], ...] = (
    in_other_frames, facing_along_y, in_other_units, with_parts_fixed_on,
)  # fmt: skip


@cache
def as_it_is(asset_id: str) -> PhysicsOverlay:
    """The physics of a sample as its own file describes it."""
    with TemporaryDirectory() as out:
        return validated(sample(asset_id), Path(out)).overlay


def share_open(joint: JointPhysics) -> float:
    way = joint.open - joint.closed
    return (joint.initial_position - joint.closed) / way if way else 0.0


def described(ref: AssetRef, way: Callable[["etree._Element"], None], folder: Path) -> AssetRef:
    """A copy of the asset in this folder that is described in another way."""
    shutil.copytree(ref.path, folder, ignore=shutil.ignore_patterns("images", "mobility_v2.json", "bounding_box.json"))
    tree = etree.parse(folder / "mobility.urdf")
    way(tree.getroot())
    tree.write(folder / "mobility.urdf")
    return ref.model_copy(update={"path": str(folder)})


def seen(ref: AssetRef, out: Path) -> Features:
    """The features of an asset as models are told them."""
    return extract_asset(AssetJob(ref, out, Settings(), prior), correct_joints=True).extraction.features


def test_drawers_show_where_the_front_is(tmp_path: Path) -> None:
    ref = sample("table_two_drawers")
    assert seen(ref, tmp_path).front == (-1.0, 0.0, 0.0) and "front is -x" in axis_names(seen(ref, tmp_path))
    turned = seen(described(ref, facing_along_y, tmp_path / "a"), tmp_path)
    assert turned.front == (0.0, -1.0, 0.0) and "front is -y, left (to someone who stands before it) is -x" in (
        axis_names(turned)
    )
    drawer = turned.movable_joints[0].name
    assert joint_motions(turned)[drawer].opens == joint_motions(seen(ref, tmp_path))[drawer].opens
    assert candidate_sizes(turned)[0] == candidate_sizes(seen(ref, tmp_path))[0]


def test_an_object_that_stands_turned_among_its_axes_is_as_large_as_it_is(tmp_path: Path) -> None:
    ref = sample("storage_sideboard")

    def askew(robot: "etree._Element") -> None:
        moved_root(robot, turn_of(Rotation.from_euler("z", 0.5).as_matrix()))

    turned = seen(described(ref, askew, tmp_path / "a"), tmp_path)
    assert turned.closed_size == pytest.approx(seen(ref, tmp_path).closed_size, rel=0.01)


def test_a_door_that_is_drawn_open_shows_no_front(tmp_path: Path) -> None:
    ref = sample("microwave_kitchen")
    assert seen(described(ref, drawn_ajar, tmp_path / "a"), tmp_path).front == seen(ref, tmp_path).front


@pytest.mark.parametrize(
    ("asset_id", "way"),
    [*((each, way) for each in SAMPLES for way in WAYS), *((each, drawn_ajar) for each in ALIKE_AJAR)],
    ids=lambda given: given if isinstance(given, str) else given.__name__,
)
def test_an_object_described_otherwise_is_refined_alike(
    asset_id: str, way: Callable[["etree._Element"], None], tmp_path: Path
) -> None:
    if (asset_id, way.__name__) == THIN:
        pytest.xfail("damping of its handle 14 % lower")
    ref = described(sample(asset_id), way, tmp_path / asset_id)
    one, other = as_it_is(asset_id), validated(ref, tmp_path).overlay
    larger = LARGER if way is in_other_units else 1.0
    assert other.scale * larger == pytest.approx(one.scale, rel=1e-3) and other.support.kind is one.support.kind
    assert other.mass_kg == pytest.approx(one.mass_kg, rel=SLACK)
    for ours, theirs in zip(one.joints, other.joints, strict=True):
        for term in ("damping", "friction", "stiffness"):
            assert getattr(theirs, term) == pytest.approx(getattr(ours, term), rel=2.0 * SLACK, abs=1e-6), ours.name
        assert abs(theirs.gravity_load) == pytest.approx(abs(ours.gravity_load), rel=2.0 * SLACK, abs=1e-3), ours.name
        assert share_open(theirs) == pytest.approx(share_open(ours), abs=0.01), ours.name
        assert (theirs.mechanism, theirs.holds) == (ours.mechanism, ours.holds), ours.name
        assert (theirs.effort_range and theirs.effort_range.kind) == (ours.effort_range and ours.effort_range.kind)


def test_pictures_show_the_front_that_the_drawers_show(tmp_path: Path) -> None:
    ref = described(sample("table_two_drawers"), facing_along_y, tmp_path / "a")
    overlay = validated(ref, tmp_path).overlay
    assert overlay.front == (0.0, -1.0, 0.0)
    urdf = Path(ref.path) / "mobility.urdf"
    assert load_scene(urdf, {}, front=overlay.front).front.tolist() == [0.0, -1.0, 0.0]
    assert load_scene(urdf, {}).front.tolist() == [-1.0, 0.0, 0.0], "by the custom of such files"
    (urdf.parent / "overlay.json").write_text(overlay.model_dump_json())
    assert load_scene(urdf, {}).front.tolist() == [0.0, -1.0, 0.0], "a refined folder says it"
    (urdf.parent / "overlay.json").write_text("[another's file]")
    assert load_scene(urdf, {}).front.tolist() == [-1.0, 0.0, 0.0]
