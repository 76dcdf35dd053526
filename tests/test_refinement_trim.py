"""Hulls that reach into each other are cut apart: by the right amount, on the right side, and no more than allowed."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from asset2sim.assets.hulls import (
    MOST_POINTS,
    SHEET_THICKNESS_M,
    Hulls,
    simplified,
    thickened_sheet,
    without_enclosed,
    write_hulls,
)
from asset2sim.engines.contacts import penetration
from asset2sim.engines.static_object import MARGIN_M, contacts_at
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import apply, origin_transform
from asset2sim.refinement.collision.part_links import cut_until_clear
from asset2sim.refinement.collision.pybullet_hulls import quaternion
from asset2sim.refinement.collision.trim import (
    CLEARANCE_M,
    Key,
    Overlap,
    TrimBound,
    Trimmer,
    contact_pairs,
    cut_again,
    cuts_of,
    trim,
)
from schemas.recipe import CutHull
from schemas.settings import EngineSettings
from tests.builders import ORIGIN, UrdfJoint, UrdfLink, corners, joint_features, mesh, shifted, write_urdf

HERE = np.eye(4)
X = np.array([1.0, 0.0, 0.0])
GAP = 2.0 * MARGIN_M + CLEARANCE_M
"""What two hulls must be apart so that PyBullet sees no contact."""
UNIT = corners((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
LEFT = corners((0.0, 0.0, 0.0), (0.2, 0.1, 0.1))


def volume(points: Array) -> float:
    return float(ConvexHull(points).volume)


def everywhere(hulls: Hulls) -> dict[str, Array]:
    return dict.fromkeys(hulls, HERE)


def along_x(a: Key, b: Key, depth: float) -> Overlap:
    """An overlap of two hulls whose links stand in the root's frame."""
    return Overlap(a, b, HERE, HERE, X, depth)


def phi(folder: Path, hulls: Hulls, poses: dict[str, Array]) -> float:
    """Φ in PyBullet of links glued beside each other on one root, loaded from the OBJ files that are written."""
    files = write_hulls(hulls, folder)
    links = [UrdfLink("root")] + [
        UrdfLink(name, shapes=tuple((mesh(str(f)), ORIGIN) for f in files[name])) for name in hulls
    ]
    joints = [UrdfJoint(f"to_{name}", "continuous", "root", name, xyz=tuple(poses[name][:3, 3])) for name in hulls]
    turned = {f"to_{name}": math.atan2(poses[name][1, 0], poses[name][0, 0]) for name in hulls}
    return penetration(contacts_at(write_urdf(folder, links, joints), turned, EngineSettings()))


@pytest.mark.parametrize(
    ("normal", "offset", "expected"),
    [
        ((1, 0, 0), 0.25, 0.75),
        ((0, -1, 0), -0.4, 0.4),
        ((1, 1, 1), 0.3, 1.0 - 0.3**3 / 6.0),  # a corner off
        ((-1, -1, -1), -2.5, 1.0 - 0.5**3 / 6.0),
        ((1, 1, 0), 1.0, 0.5),  # through two edges
        ((1, 0, 0), -0.5, 1.0),
    ],
)
def test_a_clipped_cube_has_the_volume_of_the_textbook(
    normal: tuple[float, ...], offset: float, expected: float
) -> None:
    direction = np.array(normal, dtype=float)
    length = float(np.linalg.norm(direction))
    kept = trim(UNIT, direction / length, offset / length)
    assert kept is not None
    assert volume(kept) == pytest.approx(expected, rel=1e-9)
    assert float((kept @ direction).min()) >= offset - 1e-9


def test_nothing_is_left_beyond_the_plane_or_on_it() -> None:
    assert trim(UNIT, X, 1.5) is None
    assert trim(UNIT, X, 1.0) is None


@pytest.mark.system
def test_two_boxes_that_overlap_are_cleared_and_each_loses_half(tmp_path: Path) -> None:
    hulls: Hulls = {"left": (LEFT,), "right": (shifted(LEFT, 0.19),)}
    assert phi(tmp_path, hulls, everywhere(hulls)) == pytest.approx(0.012, abs=1e-5)  # 10 mm and both margins
    result, cuts = cut_until_clear(hulls, everywhere(hulls), [("left", "right")])
    assert phi(tmp_path, result, everywhere(hulls)) < 1e-6
    lost = (0.01 + GAP) / 2.0
    assert result["left"][0][:, 0].max() == pytest.approx(0.2 - lost, abs=1e-6)
    assert result["right"][0][:, 0].min() == pytest.approx(0.19 + lost, abs=1e-6)
    assert volume(result["left"][0]) == pytest.approx(0.002 - lost * 0.01, rel=1e-4)
    assert {(cut.link, cut.other) for cut in cuts} == {("left", "right"), ("right", "left")}
    np.testing.assert_allclose([(cut.depth_m, cut.share) for cut in cuts], [(lost, lost / 0.2)] * 2, rtol=1e-3)


@pytest.mark.system
def test_the_longer_box_gives_the_larger_part(tmp_path: Path) -> None:
    short = corners((0.19, 0.0, 0.0), (0.24, 0.1, 0.1))
    hulls: Hulls = {"left": (LEFT,), "right": (short,)}
    result, cuts = cut_until_clear(hulls, everywhere(hulls), [("left", "right")])
    assert phi(tmp_path, result, everywhere(hulls)) < 1e-6
    depth = {cut.link: cut.depth_m for cut in cuts}
    # 0.2 and 0.05 m long: four parts to one, the same share of each.
    assert depth["left"] == pytest.approx(0.8 * (0.01 + GAP), rel=2e-3)
    assert depth["right"] == pytest.approx(0.2 * (0.01 + GAP), rel=2e-3)
    assert len({round(cut.share, 4) for cut in cuts}) == 1


@pytest.mark.system
@pytest.mark.parametrize(("gap", "touched"), [(0.0, True), (0.0015, True), (0.00205, True), (0.0025, False)])
@pytest.mark.parametrize("pair", [("left", "right"), ("right", "left")])
def test_boxes_within_the_engines_margins_touch_and_others_do_not(
    tmp_path: Path, gap: float, touched: bool, pair: tuple[str, str]
) -> None:
    hulls: Hulls = {"left": (LEFT,), "right": (shifted(LEFT, 0.2 + gap),)}
    result, cuts = cut_until_clear(hulls, everywhere(hulls), [pair])
    assert bool(cuts) is touched
    assert phi(tmp_path, result, everywhere(hulls)) < 1e-6
    assert result["right"][0][:, 0].min() - result["left"][0][:, 0].max() == pytest.approx(max(gap, GAP), abs=1e-6)


@pytest.mark.system
@pytest.mark.parametrize("angle", [0.4, -2.0])
def test_links_that_are_turned_and_moved_are_cut_in_their_own_frames(tmp_path: Path, angle: float) -> None:
    poses = {
        "left": origin_transform((0.3, 0.2, 0.0), (0.0, 0.0, angle)),
        "right": origin_transform((-0.1, 0.4, 0.0), (0.0, 0.0, 1.0)),
    }
    turn = origin_transform(ORIGIN, (0.0, 0.0, 0.6))  # how the pair lies in the root's frame
    placed = {"left": apply(turn, LEFT), "right": apply(turn, shifted(LEFT, 0.19))}
    hulls: Hulls = {
        name: (apply(np.asarray(np.linalg.inv(poses[name]), dtype=float), points),) for name, points in placed.items()
    }
    assert phi(tmp_path, hulls, poses) > 0.01
    result, _ = cut_until_clear(hulls, poses, [("left", "right")])
    assert phi(tmp_path, result, poses) < 1e-6
    back = np.linalg.inv(turn) @ poses["left"]
    np.testing.assert_allclose(
        apply(back, result["left"][0]).max(axis=0), [0.2 - (0.01 + GAP) / 2.0, 0.1, 0.1], atol=1e-5
    )


@pytest.mark.system
def test_a_bar_through_two_posts_is_cleared_of_both(tmp_path: Path) -> None:
    hulls: Hulls = {
        "bar": (corners((-0.01, 0.0, 0.0), (0.31, 0.05, 0.05)),),
        "posts": (corners((-0.1, -0.1, -0.1), (0.0, 0.15, 0.15)), corners((0.3, -0.1, -0.1), (0.4, 0.15, 0.15))),
    }
    result, cuts = cut_until_clear(hulls, everywhere(hulls), [("bar", "posts")])
    assert phi(tmp_path, result, everywhere(hulls)) < 1e-6
    ends = result["bar"][0][:, 0]
    assert float(np.ptp(ends)) == pytest.approx(0.32 - 2.0 * (0.32 / 0.42) * (0.01 + GAP), rel=0.01)
    assert len(result["posts"]) == 2
    assert sum(cut.link == "bar" for cut in cuts) == 1  # of the two ends the deeper, under one name


@pytest.mark.system
def test_a_cap_of_more_than_half_is_refused_and_both_hulls_stay() -> None:
    hulls: Hulls = {"left": (UNIT,), "right": (shifted(UNIT, 1e-4),)}
    result, cuts = cut_until_clear(hulls, everywhere(hulls), [("left", "right")])
    assert cuts == ()
    for name in hulls:
        np.testing.assert_array_equal(result[name][0], hulls[name][0])


def test_cuts_add_up_against_the_original_extent() -> None:
    trimmer = Trimmer({"a": (UNIT,), "b": (shifted(UNIT, -0.4),)})
    wedge = along_x(("a", 0), ("b", 0), 0.6)
    assert trimmer.clear(wedge, 0.0)  # 0.6 between two of length 1: each loses 0.3
    assert volume(trimmer.hulls["a"][0]) == pytest.approx(0.7, abs=1e-4)
    # 0.45 of the original is within the half; 0.55 is not, though it takes only 0.18 of what is then left.
    within = trimmer._cut(("a", 0), HERE, X, 0.45, TrimBound())
    assert within is not None and volume(within[0]) == pytest.approx(0.55, abs=1e-9)
    trimmer.hulls["a"][0] = within[0]
    assert trimmer._cut(("a", 0), HERE, X, 0.55, TrimBound()) is None


def test_the_deepest_cut_against_a_link_is_what_is_told() -> None:
    trimmer = Trimmer({"a": (UNIT, UNIT, UNIT), "b": (shifted(UNIT, -0.8),) * 3})
    for index, reach in enumerate((-0.8, -0.6, -0.7)):
        trimmer.hulls["b"][index] = trimmer.original[("b", index)] = shifted(UNIT, reach)
        assert trimmer.clear(along_x(("a", index), ("b", index), 1.0 + reach), 0.0)
    cut = trimmer.cuts[("a", "b")]
    assert (cut.link, cut.other) == ("a", "b")
    assert (cut.depth_m, cut.share) == pytest.approx((0.2, 0.2), abs=1e-4)


def test_an_overlap_that_one_side_cannot_give_way_to_leaves_both_whole() -> None:
    hulls: Hulls = {"a": (UNIT,), "b": (shifted(UNIT, -0.75),)}
    trimmer = Trimmer(hulls, exact=frozenset({"a"}))
    assert not trimmer.clear(along_x(("a", 0), ("b", 0), 0.25), 0.0)
    assert not trimmer.cuts
    for name in hulls:
        np.testing.assert_array_equal(trimmer.hulls[name][0], hulls[name][0])


def test_one_side_alone_can_give_way_and_a_bound_on_depth_holds() -> None:
    trimmer = Trimmer({"a": (UNIT,), "b": (shifted(UNIT, -0.9),)})
    overlap = along_x(("a", 0), ("b", 0), 0.1)
    assert not trimmer.clear(overlap, 0.0, part_a=1.0, bound=TrimBound(depth_m=0.09))
    before = trimmer.state(("a", 0), ("b", 0))
    assert trimmer.clear(overlap, 0.0, part_a=1.0, bound=TrimBound(depth_m=0.11))
    assert volume(trimmer.hulls["a"][0]) == pytest.approx(0.9 - CLEARANCE_M, abs=1e-6)
    np.testing.assert_array_equal(trimmer.hulls["b"][0], shifted(UNIT, -0.9))
    assert [cut.link for cut in trimmer.cuts.values()] == ["a"]
    trimmer.restore(before, ("a", 0), ("b", 0))
    assert not trimmer.cuts and trimmer.hulls["a"][0] is UNIT


def test_a_pose_turned_about_any_axis_becomes_the_same_rotation_in_the_engine() -> None:
    turns = [*Rotation.random(50, rng=3), *Rotation.from_euler("xyz", np.pi * np.eye(3)), Rotation.identity()]
    for turn in turns:
        pose = np.eye(4)
        pose[:3, :3] = turn.as_matrix()
        np.testing.assert_allclose(Rotation.from_quat(quaternion(pose)).as_matrix(), turn.as_matrix(), atol=1e-9)


def test_hulls_are_cut_again_as_recorded_to_the_last_bit() -> None:
    turn = Rotation.from_euler("xyz", (0.3, -0.2, 0.7)).as_matrix()
    whole: Hulls = {"a": (shifted(UNIT, y=3.0), UNIT @ turn.T), "b": (shifted(UNIT, -0.9),), "c": (UNIT,)}
    trimmer = Trimmer(whole)
    before = trimmer.state(("a", 1), ("b", 0))
    assert trimmer.clear(along_x(("a", 1), ("b", 0), 0.2), MARGIN_M)
    trimmer.restore(before, ("a", 1), ("b", 0))  # the way back is no part of the record
    assert trimmer.clear(along_x(("a", 1), ("b", 0), 0.2), MARGIN_M, 0.7)
    assert trimmer.clear(Overlap(("a", 1), ("b", 0), HERE, HERE, turn[:, 2], 0.2), MARGIN_M)
    final = trimmer.result() | {"a": (trimmer.result()["a"][1],)}  # a piece may be gone
    cuts = cuts_of(whole, final, trimmer.planes)
    assert {link: [(way.hull, len(way.planes)) for way in ways] for link, ways in cuts.items()} == {
        "a": [(1, 2)], "b": [(0, 2)]}  # fmt: skip
    kept = {link: [CutHull.model_validate_json(way.model_dump_json()) for way in ways] for link, ways in cuts.items()}
    again = cut_again(whole, kept)
    for link, pieces in final.items():
        assert [one.tobytes() for one in again[link]] == [one.tobytes() for one in pieces]
    with pytest.raises(ValueError, match="hull 4 is not there"):
        cut_again(whole, {"c": [CutHull(hull=4)]})


def test_hulls_that_are_apart_already_are_not_cut() -> None:
    trimmer = Trimmer({"a": (UNIT,), "b": (shifted(UNIT, -1.5),)})
    assert trimmer.clear(along_x(("a", 0), ("b", 0), 0.0), MARGIN_M)
    assert trimmer.cuts == {}


def test_a_link_and_its_parent_are_no_pair() -> None:
    joints = [
        joint_features("one", "revolute", "body", "door"),
        joint_features("two", "fixed", "door", "handle"),
        joint_features("three", "revolute", "body", "lid"),
    ]
    found = {frozenset(pair) for pair in contact_pairs(joints, ["body", "door", "handle", "lid"])}
    assert found == {frozenset(pair) for pair in (("body", "handle"), ("door", "lid"), ("handle", "lid"))}


@pytest.mark.system
def test_a_hinge_that_overlaps_its_parent_is_not_touched() -> None:
    joints = [joint_features("one", "revolute", "body", "door"), joint_features("two", "revolute", "body", "lid")]
    hulls: Hulls = {"body": (UNIT,), "door": (shifted(UNIT, 0.9),), "lid": (shifted(UNIT, y=0.9),)}
    result, cuts = cut_until_clear(hulls, everywhere(hulls), contact_pairs(joints, list(hulls)))
    np.testing.assert_array_equal(result["body"][0], UNIT)
    assert {cut.link for cut in cuts} <= {"door", "lid"}


def test_what_is_written_under_names_that_differ_only_in_a_slash_is_what_was_given(tmp_path: Path) -> None:
    sheet = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    files = write_hulls({"a/b": (UNIT, sheet), "a_b": (LEFT,), "none": ()}, tmp_path)
    assert [len(names) for names in files.values()] == [1, 1, 0]  # the sheet has no volume
    assert len({name for names in files.values() for name in names}) == 2
    text = (tmp_path / str(files["a/b"][0])).read_text()
    vertices = np.array([line.split()[1:] for line in text.splitlines() if line.startswith("v ")], dtype=float)
    assert len(vertices) == 8 and volume(vertices) == pytest.approx(1.0)
    write_hulls({"a": (UNIT,)}, tmp_path)
    assert [path.name for path in (tmp_path / "collision").iterdir()] == ["a_0_0.obj"]  # what was there is gone


def test_pieces_wholly_inside_another_are_left_out_and_the_order_is_kept() -> None:
    inner, beside = 0.5 * UNIT + 0.25, shifted(0.5 * UNIT, 0.75)  # the second sticks out by 0.25
    kept = without_enclosed([inner, UNIT, beside])
    assert [id(piece) for piece in kept] == [id(UNIT), id(beside)]
    assert len(without_enclosed([UNIT, UNIT.copy()])) == 1  # of two alike one stays


def test_a_piece_in_the_box_but_not_in_the_hull_of_another_stays() -> None:
    pyramid = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    corner = 0.1 * UNIT + 0.85
    assert len(without_enclosed([pyramid, corner])) == 2


def test_a_sheet_is_given_its_thickness_on_both_sides_of_its_plane() -> None:
    turn = origin_transform((0.1, 0.2, 0.3), (0.4, -0.9, 0.2))
    sheet = apply(turn, np.array([[0.0, 0, 0], [0.3, 0, 0], [0.3, 0.2, 0], [0, 0.2, 0]]))
    thick = thickened_sheet(sheet)
    assert volume(thick) == pytest.approx(0.3 * 0.2 * SHEET_THICKNESS_M)
    np.testing.assert_allclose(thick.mean(axis=0), sheet.mean(axis=0), atol=1e-12)


def test_a_hull_of_very_many_points_is_thinned_within_three_per_cent() -> None:
    directions = np.random.default_rng(1).normal(size=(5000, 3))
    ball = directions / np.linalg.norm(directions, axis=1)[:, None]
    thin = simplified(ball)
    assert len(thin) <= MOST_POINTS
    depth = -ConvexHull(thin).equations[:, 3].max()  # of the face nearest the centre
    assert depth > 0.97  # 200 directions lie 15° apart: a face between three of them is about 2 % inside
    assert simplified(UNIT) is UNIT
