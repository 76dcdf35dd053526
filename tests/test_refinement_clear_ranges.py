"""Joints that hulls stop get their hulls cut, those that meshes stop their limits drawn in; the rest is told."""

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
import trimesh

from asset2sim.assets.authored_overlap import authored_shapes
from asset2sim.assets.extract import Extraction
from asset2sim.assets.hulls import Hulls, collision_hulls, write_hulls
from asset2sim.engines.contacts import by_pair
from asset2sim.engines.static_object import MARGIN_M, contacts_at
from asset2sim.physics.kinematics import apply, link_to_root, tree_of
from asset2sim.refinement.collision.clear_ranges import Cleared, clear_ranges
from asset2sim.refinement.collision.travel import range_of, sampled_positions, stance_at, travel
from asset2sim.refinement.collision.trim import CLEARANCE_M, contact_pairs
from schemas.settings import EngineSettings
from schemas.vocabulary import OverlapCause
from tests.assets import box_obj, joint, link, mesh, read, robot, written
from tests.builders import UrdfJoint, UrdfLink, joint_features, write_urdf
from tests.builders import mesh as mesh_geometry

pytestmark = pytest.mark.system

DOOR = box_obj((0.02, -0.01, -0.1), (0.4, 0.01, 0.1))
"""A door that turns about the origin's z axis."""
HINGE = joint("hinge", "revolute", "base", "door", axis="0 0 1", limit="0 2")
POST = joint("weld", "fixed", "base", "post")


def prism(outline: list[tuple[float, float]], height: float = 0.2) -> str:
    """The OBJ of a polygon (counter-clockwise, star-shaped about its first corner) drawn up along z."""
    count = len(outline)
    vertices = [(x, y, z) for z in (-height / 2.0, height / 2.0) for x, y in outline]
    faces = [(0, i + 1, i) for i in range(1, count - 1)] + [
        (count, count + i, count + i + 1) for i in range(1, count - 1)
    ]
    for i in range(count):
        j = (i + 1) % count
        faces += [(i, j, count + j), (i, count + j, count + i)]
    lines = [f"v {x} {y} {z}" for x, y, z in vertices] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
    return "\n".join(lines) + "\n"


ANGLE = prism([(0.5, 0.5), (0.0, 0.5), (0.0, 0.45), (0.45, 0.45), (0.45, 0.0), (0.5, 0.0)])
"""Two walls in a corner, outside of the circle that the door's tip draws; their hull reaches 8 cm into it."""


def thing(folder: Path, meshes: Mapping[str, str], *joints: str) -> Extraction:
    """An asset whose links have one OBJ each, beside a base without any."""
    links = [link("base")] + [link(name, mesh(f"{name}.obj")) for name in meshes]
    return read(written(folder, robot(*links, *joints), {f"{name}.obj": text for name, text in meshes.items()}))


def limits_of(item: Extraction) -> dict[str, tuple[float, float]]:
    return {j.name: (j.lower, j.upper) for j in item.features.joints if j.lower is not None and j.upper is not None}


def clear(item: Extraction, **initial: float) -> tuple[Hulls, Cleared]:
    hulls, joints = collision_hulls(item, 1.0), item.features.joints
    pairs = list(contact_pairs(joints, [one.name for one in item.features.links]))
    shapes = authored_shapes(item, 1.0)
    return hulls, clear_ranges(hulls, tree_of(joints), item.features.root, limits_of(item), initial, pairs, shapes)


def deepest(folder: Path, hulls: Hulls, poses: Mapping[str, np.ndarray]) -> float:
    """The deepest overlap in PyBullet of links glued at these poses, loaded from what is written; margins count."""
    files = write_hulls({name: tuple(apply(poses[name], p) for p in own) for name, own in hulls.items()}, folder)
    links = [UrdfLink("root")] + [
        UrdfLink(name, shapes=tuple((mesh_geometry(str(f)), (0.0, 0.0, 0.0)) for f in own))
        for name, own in files.items()
    ]
    urdf = write_urdf(folder, links, [UrdfJoint(f"to_{name}", "continuous", "root", name) for name in files])
    return max((p.depth_m for p in by_pair(contacts_at(urdf, {}, EngineSettings()))), default=0.0)


def over_range(folder: Path, item: Extraction, hulls: Hulls, name: str, lower: float, upper: float) -> float:
    tree = tree_of(item.features.joints)
    folder.mkdir(exist_ok=True)
    return max(
        deepest(folder, hulls, link_to_root(tree, item.features.root, {name: float(q)}))
        for q in np.linspace(lower, upper, 13)
    )


def test_a_hull_that_fills_a_corner_is_cut_until_the_door_passes(tmp_path: Path) -> None:
    item = thing(tmp_path, {"door": DOOR, "post": ANGLE}, HINGE, POST)
    hulls, found = clear(item)
    assert over_range(tmp_path / "before", item, hulls, "hinge", 0.0, 1.57) > 0.05
    assert over_range(tmp_path / "after", item, found.hulls, "hinge", 0.0, 1.57) <= 2.0 * MARGIN_M
    assert found.limits == {} and found.jams == ()
    assert {cut.link for cut in found.cuts} <= {"door", "post"} and found.cuts
    assert all(cut.share <= 0.5 for cut in found.cuts)
    # The walls themselves, at the ends of the corner, are still there.
    assert np.ptp(found.hulls["post"][0], axis=0).max() == pytest.approx(0.5, abs=1e-6)


def test_a_limit_is_drawn_in_to_where_the_meshes_meet(tmp_path: Path) -> None:
    item = thing(tmp_path, {"door": DOOR, "post": box_obj((-0.05, 0.3, -0.1), (0.05, 0.4, 0.1))}, HINGE, POST)
    hulls, found = clear(item)
    # The door's face is 10 mm ahead of its middle: it meets the corner at (0.05, 0.3), less 1.9 mm that margins keep.
    meets = math.atan2(0.3, 0.05) - math.asin(0.0119 / math.hypot(0.3, 0.05))
    assert list(found.limits) == ["hinge"] and found.limits["hinge"][0] == 0.0
    assert meets - 2e-3 < found.limits["hinge"][1] <= meets + 1e-4
    stop = found.stops["hinge"]
    assert (stop.joint, {stop.link_a, stop.link_b}, stop.cause) == ("hinge", {"door", "post"}, OverlapCause.AUTHORED)
    assert found.jams == ()
    for name in ("door", "post"):
        np.testing.assert_array_equal(found.hulls[name][0], hulls[name][0])


def test_a_limit_is_not_drawn_in_beyond_half_nor_past_the_initial_position(tmp_path: Path) -> None:
    early = box_obj((0.25, 0.2, -0.1), (0.3, 0.25, 0.1))  # met at about 0.6 rad of 2
    item = thing(tmp_path / "early", {"door": DOOR, "post": early}, HINGE, POST)
    _, found = clear(item)
    assert found.limits == {}
    assert [(jam.joint, jam.cause) for jam in found.jams] == [("hinge", OverlapCause.AUTHORED)]
    assert 0.6 < found.jams[0].position < 1.0 and found.jams[0].depth_m > 0.01
    late = box_obj((0.0, 0.3, -0.1), (0.02, 0.32, 0.1))  # about 1.5 rad: beyond it the door starts
    item = thing(tmp_path / "late", {"door": DOOR, "post": late}, HINGE, POST)
    _, found = clear(item, hinge=1.9)
    assert found.limits == {} and [jam.joint for jam in found.jams] == ["hinge"]
    _, found = clear(item, hinge=0.5)
    assert list(found.limits) == ["hinge"] and found.jams == ()


def test_a_drawer_behind_a_closed_door_is_not_jammed(tmp_path: Path) -> None:
    slide = joint("slide", "prismatic", "base", "drawer", xyz="0.2 -0.2 0", axis="0 1 0", limit="0 0.15")
    meshes = {"door": DOOR, "drawer": box_obj((-0.1, 0.0, -0.05), (0.1, 0.185, 0.05))}
    item = thing(tmp_path, meshes, HINGE, slide)
    hulls, found = clear(item)
    assert over_range(tmp_path / "slides", item, hulls, "slide", 0.0, 0.15) > 0.02  # the way it is blocked is real
    assert (found.cuts, found.limits, found.jams) == ((), {}, ())


def test_an_arm_that_its_own_elbow_frees_keeps_its_limits_and_is_told(tmp_path: Path) -> None:
    elbow = joint("elbow", "revolute", "door", "arm", xyz="0.4 0 0", axis="0 0 1", limit="-2.5 0")
    arm = box_obj((0.02, -0.01, -0.1), (0.3, 0.01, 0.1))
    post = box_obj((-0.05, 0.5, -0.1), (0.05, 0.6, 0.1))  # out of the door's reach, within the arm's
    item = thing(tmp_path, {"door": DOOR, "arm": arm, "post": post}, HINGE, elbow, POST)
    _, found = clear(item)
    assert found.limits == {}
    assert [(jam.joint, jam.link_a, jam.freed_by) for jam in found.jams] == [("hinge", "arm", "elbow")]


@pytest.mark.parametrize("start", [{}, {"left": 0.5}])
def test_what_overlaps_at_joint_zero_is_parted_there_too(tmp_path: Path, start: dict[str, float]) -> None:
    """Two leaves that overlap by 6 mm where they meet, whether the object starts there or elsewhere."""
    leaves = (
        joint("left", "revolute", "base", "one", axis="0 0 1", limit="-1 1"),
        joint("right", "revolute", "base", "two", xyz="0.6 0 0", axis="0 0 1", limit="-1 1"),
    )
    meshes = {
        "one": box_obj((0.0, -0.01, -0.1), (0.303, 0.01, 0.1)),
        "two": box_obj((-0.303, -0.01, -0.1), (0.0, 0.01, 0.1)),
    }
    item = thing(tmp_path, meshes, *leaves)
    hulls, found = clear(item, **start)
    here = link_to_root(tree_of(item.features.joints), item.features.root, {})
    (tmp_path / "zero").mkdir()
    assert deepest(tmp_path / "zero", hulls, here) == pytest.approx(0.008, abs=1e-4)
    assert deepest(tmp_path / "zero", found.hulls, here) < 1e-6
    assert [jam for jam in found.jams if jam.joint is None] == []


@pytest.mark.parametrize(("sunk", "parted"), [(0.003, True), (0.03, False)])
def test_a_part_is_cleared_of_its_parent_where_that_takes_little(tmp_path: Path, sunk: float, parted: bool) -> None:
    panel = box_obj((-0.2, -0.2, -0.1), (0.2, 0.2, 0.0))
    knob = box_obj((-0.02, -0.02, -sunk), (0.02, 0.02, 0.04))
    turn = joint("turn", "continuous", "panel", "knob", axis="0 0 1")
    item = thing(tmp_path, {"panel": panel, "knob": knob}, joint("weld", "fixed", "base", "panel"), turn)
    hulls, found = clear(item)
    assert found.jams == () and found.limits == {}
    gap = found.hulls["knob"][0][:, 2].min() - found.hulls["panel"][0][:, 2].max()
    assert gap == pytest.approx(CLEARANCE_M, abs=1e-6) if parted else gap == pytest.approx(-sunk)
    assert bool(found.cuts) is parted
    assert found.hulls["panel"][0] is hulls["panel"][0] or parted


def test_the_same_asset_is_cleared_alike_each_time(tmp_path: Path) -> None:
    item = thing(tmp_path, {"door": DOOR, "post": ANGLE}, HINGE, POST)
    first, second = clear(item)[1], clear(item)[1]
    assert first.cuts == second.cuts
    for name, pieces in first.hulls.items():
        for one, two in zip(pieces, second.hulls[name], strict=True):
            np.testing.assert_array_equal(one, two)


def test_a_travel_is_what_forward_kinematics_says() -> None:
    joints = [
        joint_features("one", "revolute", "base", "a", xyz=(0.1, 0.2, 0.3), axis=(0.0, 0.6, 0.8)),
        joint_features("two", "prismatic", "a", "b", xyz=(0.3, 0.0, 0.0), axis=(1.0, 0.0, 0.0)),
        joint_features("three", "continuous", "b", "c", xyz=(0.0, 0.1, 0.0)),
    ]
    tree = tree_of(joints)
    start = {"one": 0.4, "two": 0.05, "three": -1.0}
    stance = stance_at(tree, "base", start)
    cloud = trimesh.creation.icosphere(1, 0.1).vertices
    for name, moved in (("one", ("a", "b", "c")), ("two", ("b", "c")), ("three", ("c",))):
        path = travel(tree, name, stance, np.array([-0.2, 0.0, 0.7]))
        assert path.links == moved
        for link_name in moved:
            for position, pose in zip(path.positions, path.poses(link_name), strict=True):
                there = link_to_root(tree, "base", {**start, name: float(position)})
                np.testing.assert_allclose(pose, there[link_name], atol=1e-12)
            steps = np.linalg.norm(
                apply(path.poses(link_name)[1], cloud) - apply(path.poses(link_name)[0], cloud), axis=1
            )
            assert steps.max() <= 0.2 * path.speed(link_name, cloud) + 1e-12


def test_ranges_are_sampled_with_their_ends_and_what_else_is_asked() -> None:
    tree = tree_of([joint_features("turn", "continuous", "base", "a"), joint_features("slide", "prismatic", "a", "b")])
    assert range_of(tree[0], {}) == (-math.pi, math.pi)
    assert range_of(tree[1], {}) is None and range_of(tree[1], {"slide": (0.1, 0.1)}) is None
    seen = sampled_positions(-1.0, 2.0, (0.01, 5.0))
    assert seen[0] == -1.0 and seen[-1] == 2.0 and 0.01 in seen and 5.0 not in seen
