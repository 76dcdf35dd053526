"""Which end of a joint is closed: small furniture whose answer anyone can see, with both directions of its axis."""

import math
from collections.abc import Callable, Mapping

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from asset2sim.assets.meshes.openness import DrawnTree, JointEnds, joint_ends, opening_profile
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint
from schemas.base import Vector3
from tests.builders import corners, tree_joint

BODY = corners((-0.25, -0.25, 0.0), (0.25, 0.25, 0.5))
"""A cupboard of half a metre, its front at y = -0.25, its origin in the middle of its floor."""


def ends(joint: TreeJoint, part: Array, lower: float, upper: float, body: Array = BODY) -> JointEnds:
    points: Mapping[str, Array] = {"body": body, "part": part}
    whole = np.vstack(list(points.values()))
    return joint_ends(
        DrawnTree([joint], "body", points), joint, lower, upper, float(np.linalg.norm(np.ptp(whole, axis=0)))
    )


def facing(kind: str, axis: Vector3, sign: float, xyz: Vector3) -> TreeJoint:
    """A joint of the part, its axis as given (sign 1) or the other way round (sign -1)."""
    return tree_joint("j", kind, "body", "part", (sign * axis[0], sign * axis[1], sign * axis[2]), xyz)


def span(sign: float, low: float, high: float) -> tuple[float, float]:
    """The limits of the same range of motion along an axis turned round."""
    return (low, high) if sign > 0 else (-high, -low)


DRAWER = corners((-0.2, -0.24, 0.1), (0.2, 0.2, 0.3))
Shut = tuple[TreeJoint, Array, float, float, Array, float | None]
SHUT: dict[str, Callable[[float], Shut]] = {
    "a drawer inside its cupboard": lambda sign: (
        facing("prismatic", (0, -1, 0), sign, (0, 0, 0)), DRAWER, 0.0, 0.35, BODY, 1.0
    ),
    # Modelled pulled out by 0.35: zero is the open end.
    "a drawer that is drawn open": lambda sign: (
        facing("prismatic", (0, -1, 0), sign, (0, -0.35, 0)), DRAWER, -0.35, 0.0, BODY, 1.0
    ),
    # Hinged at the front's left edge; the panel lies along x while shut and swings out to -y.
    "a door in its frame": lambda sign: (
        facing("revolute", (0, 0, -1), sign, (-0.25, -0.25, 0)), corners((0.0, -0.02, 0.0), (0.5, 0.0, 0.5)),
        0.0, math.pi / 2, BODY, 1.0,
    ),
    "a folding screen on its keyboard": lambda sign: (
        facing("revolute", (-1, 0, 0), sign, (0, 0.12, 0.015)), corners((-0.17, -0.24, 0.0), (0.17, 0.0, 0.008)),
        0.0, 2.0, corners((-0.17, -0.12, 0.0), (0.17, 0.12, 0.015)), 1.0,
    ),
    # Drawn upright, and it goes back alone: flat it is most compact, within the range.
    "a screen that may lie flat beyond its keyboard": lambda sign: (
        facing("revolute", (1, 0, 0), sign, (0, 0, 0)), corners((-0.15, -0.005, 0.0), (0.15, 0.005, 0.2)),
        0.0, 2.2, corners((-0.15, 0.0, -0.01), (0.15, 0.22, 0.0)), None,
    ),
}  # fmt: skip
"""Joint, part, positions where it is shut and open, body, confidence or None for any, by the sign of the axis."""


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("name", SHUT)
def test_what_is_shut_is_known_whichever_way_its_axis_points(name: str, sign: float) -> None:
    joint, part, low, high, body, confidence = SHUT[name](sign)
    found = ends(joint, part, *span(sign, low, high), body=body)
    assert (found.closed, found.open) == pytest.approx((sign * low, sign * high)) and confidence in (
        None,
        found.confidence,
    )


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("offset", [0.0, 1.0])
def test_a_lid_is_closed_on_its_box_wherever_zero_is(sign: float, offset: float) -> None:
    # Hinged at the back's upper edge; at `offset` beyond shut the zero of the joint is half open.
    joint = tree_joint("j", "revolute", "body", "part", (-sign, 0, 0), (0, 0.25, 0.5), (-offset, 0, 0))
    found = ends(joint, corners((-0.25, -0.5, 0.0), (0.25, 0.0, 0.02)), *span(sign, -offset, 1.9 - offset))
    assert (found.closed, found.open) == pytest.approx((-sign * offset, sign * (1.9 - offset)))
    assert found.confidence > 0.9


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_flap_that_swings_to_either_side_is_closed_where_it_hangs(sign: float) -> None:
    frame = corners((-0.12, -0.02, 0.0), (0.12, 0.02, 0.3))
    flap = corners((-0.1, -0.005, -0.2), (0.1, 0.005, 0.0))
    found = ends(facing("revolute", (1, 0, 0), sign, (0, 0.03, 0.25)), flap, -1.2, 1.2, body=frame)
    assert abs(found.closed) < 0.4


@pytest.mark.parametrize(
    ("lower", "upper", "nearest", "other"),
    [(0.0, 0.002, 0.0, 0.002), (-0.002, 0.0, 0.0, -0.002), (0.001, 0.003, 0.001, 0.003)],
)
def test_of_a_button_geometry_says_nothing_and_the_end_nearest_zero_is_taken(
    lower: float, upper: float, nearest: float, other: float
) -> None:
    button = corners((-0.01, -0.01, 0.0), (0.01, 0.01, 0.01))
    found = ends(facing("prismatic", (0, 0, 1), 1.0, (0, 0, 0.1)), button, lower, upper)
    assert found == JointEnds(nearest, other, 0.0)


def test_a_drawer_that_passes_through_is_closed_in_the_middle() -> None:
    part = corners((-0.2, -0.25, 0.1), (0.2, 0.25, 0.3))
    found = ends(facing("prismatic", (0, 1, 0), 1.0, (0, 0, 0)), part, -0.3, 0.3)
    assert found.closed == pytest.approx(0.0)
    assert abs(found.open) == pytest.approx(0.3)
    assert 0.0 < found.confidence < 1.0


@pytest.mark.parametrize(("at", "lower", "upper"), [(-1.2, 0.0, 2.4), (1.2, -2.4, 0.0), (0.0, -1.2, 1.2)])
def test_leaves_that_pass_each_other_are_closed_where_they_are_drawn(at: float, lower: float, upper: float) -> None:
    wall = corners((-2.5, -0.07, 0.0), (2.5, 0.07, 2.7))
    leaf = corners((at - 0.6, -0.06, 0.0), (at + 0.6, -0.05, 2.0))
    found = ends(facing("prismatic", (1, 0, 0), 1.0, (0, 0, 0)), leaf, lower, upper, body=wall)
    assert found.closed == pytest.approx(0.0)


def test_a_drawer_that_passes_further_one_way_opens_that_way() -> None:
    part = corners((-0.2, -0.25, 0.1), (0.2, 0.25, 0.3))
    found = ends(facing("prismatic", (0, 1, 0), 1.0, (0, 0, 0)), part, -0.3, 0.2)
    assert found.open == pytest.approx(-0.3)
    assert abs(found.closed) <= 0.5 / 8 / 2  # the nearest of nine samples


def test_without_a_range_or_a_size_nothing_is_claimed() -> None:
    joint, part = facing("prismatic", (0, 1, 0), 1.0, (0, 0, 0)), corners((0.0, 0, 0), (1, 1, 1))
    assert ends(joint, part, 0.2, 0.2) == JointEnds(0.2, 0.2, 0.0)
    item = DrawnTree([joint], "body", {"body": BODY, "part": part})
    assert joint_ends(item, joint, 0.0, 0.5, 0.0) == JointEnds(0.0, 0.5, 0.0)
    empty = DrawnTree([joint], "body", dict.fromkeys(("body", "part"), np.zeros((0, 3))))
    assert joint_ends(empty, joint, -0.5, 0.1, 1.0) == JointEnds(0.1, -0.5, 0.0)


def test_the_profile_of_a_drawer_is_what_a_ruler_says() -> None:
    joint = facing("prismatic", (0, -1, 0), 1.0, (0, 0, 0))
    # A drawer as wide and high as the cupboard: the hull grows by 0.25 m² for every metre it is pulled.
    points = {"body": BODY, "part": BODY}
    positions, volumes, gaps = opening_profile(DrawnTree([joint], "body", points), joint, 0.0, 0.4)
    np.testing.assert_allclose(positions, np.linspace(0.0, 0.4, 9))
    np.testing.assert_allclose(volumes, 0.125 + 0.25 * positions)
    np.testing.assert_allclose(gaps, positions, atol=1e-12)


def test_what_a_door_carries_moves_with_it() -> None:
    door = tree_joint("door", "prismatic", "body", "part", (1, 0, 0))
    handle = tree_joint("handle", "fixed", "part", "knob", xyz=(0, 0, 1))
    knob = corners((-0.01, -0.01, 0.0), (0.01, 0.01, 0.02))
    item = DrawnTree([door, handle], "body", {"body": BODY, "part": np.zeros((0, 3)), "knob": knob})
    _, _, gaps = opening_profile(item, door, 0.0, 0.8)
    np.testing.assert_allclose(gaps, np.hypot(np.linspace(0.0, 0.8, 9), 1.01 - 0.25))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("start", [0.0, 4.5])
def test_a_lid_that_may_hang_behind_its_bin_is_closed_where_it_covers_it(sign: float, start: float) -> None:
    """Hanging down behind, it makes the object hardly larger than lying on top; ``start`` is where it is drawn."""
    bin_ = corners((-0.2, -0.2, 0.0), (0.2, 0.2, 0.6))
    lid = corners((-0.2, -0.4, 0.0), (0.2, 0.0, 0.02))
    turned = Rotation.from_rotvec([-start, 0.0, 0.0]).apply(lid)
    joint = facing("revolute", (-1, 0, 0), sign, (0, 0.2, 0.6))
    found = ends(joint, turned, *span(sign, -start, 4.5 - start), body=bin_)
    assert found.closed == pytest.approx(-sign * start) and found.confidence >= 0.3


@pytest.mark.parametrize("limits", [(-1.5, 1.5), (-16.0, 16.0)])
def test_a_handle_that_lies_on_either_side_and_a_reel_stay_guesses(limits: tuple[float, float]) -> None:
    hoop = corners((-0.2, -0.01, 0.0), (0.2, 0.01, 0.2))
    joint = facing("revolute", (-1, 0, 0), 1.0, (0, 0, 0.5))
    assert ends(joint, hoop, *limits).confidence < 0.3


def test_a_seesaw_that_stands_on_end_either_way_is_closed_at_neither() -> None:
    board, foot = corners((-0.75, -0.4, 0.02), (0.75, 0.4, 0.06)), corners((-0.1, -0.4, -0.26), (0.1, 0.4, 0.0))
    joint = tree_joint("j", "revolute", "body", "part", (0, 1, 0), (0, 0, 0))
    found = ends(joint, board, -math.pi, math.pi, body=foot)
    assert found.confidence == 0.0, "it starts where its file has it"


def test_where_nothing_stands_still_the_end_at_which_it_is_drawn_is_closed() -> None:
    """A leaf on a root without a shape, wherever that lies."""
    joint = tree_joint("j", "revolute", "body", "part", (0.0, 0.0, 1.0), (0.85, 0.0, 1.0))
    leaf = corners((-0.03, 0.0, -0.9), (0.03, 0.76, 0.9))
    found = joint_ends(DrawnTree([joint], "body", {"part": leaf}), joint, -0.1, 1.5, 2.0)
    assert (found.closed, found.open, found.confidence) == (-0.1, 1.5, 0.0)
