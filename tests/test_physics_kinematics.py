"""Forward kinematics against positions worked out by hand."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import (
    TreeJoint,
    apply,
    joint_motion,
    link_to_root,
    moved_links,
    origin_transform,
    rpy_of,
    tree_of,
)
from schemas.base import Vector3
from tests.builders import ORIGIN, joint_features, tree_joint

QUARTER = math.pi / 2


def test_an_origin_turns_about_fixed_axes_roll_first() -> None:
    # Roll by 90° takes y to z; the yaw by 90° then leaves z: y ends at z, z ends at -y and then at x.
    matrix = origin_transform((1.0, 2.0, 3.0), (QUARTER, 0.0, QUARTER))
    np.testing.assert_allclose(apply(matrix, np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])), [[1, 2, 4], [2, 2, 3]])


@given(rpy=st.tuples(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1)))
@settings(deadline=None, derandomize=True)
def test_roll_pitch_and_yaw_come_back(rpy: Vector3) -> None:
    np.testing.assert_allclose(rpy_of(origin_transform(ORIGIN, rpy)[:3, :3]), rpy, atol=1e-9)


@pytest.mark.parametrize("pitch", [QUARTER, -QUARTER])
@pytest.mark.parametrize("roll", [0.0, 0.7, -2.0])
@pytest.mark.parametrize("yaw", [0.0, 1.3])
def test_at_gimbal_lock_the_same_rotation_comes_back(roll: float, pitch: float, yaw: float) -> None:
    rotation = origin_transform(ORIGIN, (roll, pitch, yaw))[:3, :3]
    found: Array = rpy_of(rotation)
    again = origin_transform(ORIGIN, (float(found[0]), float(found[1]), float(found[2])))[:3, :3]
    np.testing.assert_allclose(again, rotation, atol=1e-9)


def test_a_revolute_joint_turns_right_handed_and_a_prismatic_one_slides() -> None:
    point = np.array([[1.0, 0.0, 0.0]])
    np.testing.assert_allclose(
        apply(joint_motion(tree_joint("j", "revolute", "a", "b"), QUARTER), point), [[0, 1, 0]], atol=1e-12
    )
    np.testing.assert_allclose(
        apply(joint_motion(tree_joint("j", "continuous", "a", "b", (0, 1, 0)), QUARTER), point),
        [[0, 0, -1]],
        atol=1e-12,
    )
    np.testing.assert_allclose(
        apply(joint_motion(tree_joint("j", "prismatic", "a", "b", (0, 2, 0)), 0.3), point), [[1, 0.3, 0]]
    )
    np.testing.assert_array_equal(joint_motion(tree_joint("j", "fixed", "a", "b"), 0.3), np.eye(4))


def test_a_two_link_arm_reaches_where_the_textbook_says() -> None:
    arm = (
        tree_joint("shoulder", "revolute", "base", "upper"),
        tree_joint("elbow", "revolute", "upper", "lower", xyz=(2, 0, 0)),
    )
    a, b = 0.4, 0.9
    poses = link_to_root(arm, "base", {"shoulder": a, "elbow": b})
    hand = apply(poses["lower"], np.array([[1.0, 0.0, 0.0]]))[0]
    np.testing.assert_allclose(
        hand, [2 * math.cos(a) + math.cos(a + b), 2 * math.sin(a) + math.sin(a + b), 0.0], atol=1e-12
    )
    np.testing.assert_allclose(link_to_root(arm, "base", {})["lower"][:3, 3], [2, 0, 0])  # joints not named are at zero


def test_an_axis_is_in_the_joints_own_turned_frame() -> None:
    # The frame is yawed by 90°, so a slide along its x goes along the root's y.
    slider = tree_joint("j", "prismatic", "base", "box", axis=(1, 0, 0), xyz=(0, 0, 1), rpy=(0, 0, QUARTER))
    np.testing.assert_allclose(link_to_root([slider], "base", {"j": 0.5})["box"][:3, 3], [0, 0.5, 1], atol=1e-12)


def test_a_tree_lists_parents_first_whatever_the_files_order() -> None:
    tree = tree_of(
        [
            joint_features("c", "fixed", "y", "z"),
            joint_features("b", "fixed", "x", "y"),
            joint_features("a", "fixed", "root", "x"),
        ]
    )
    assert [item.name for item in tree] == ["a", "b", "c"]


def test_scale_stretches_lengths_and_leaves_axes_alone() -> None:
    (item,) = tree_of([joint_features("a", "revolute", "root", "x", xyz=(1.0, 2.0, 3.0), axis=(0, 1, 0))], scale=0.5)
    np.testing.assert_allclose(item.child_to_parent[:3, 3], [0.5, 1.0, 1.5])
    np.testing.assert_array_equal(item.axis, [0, 1, 0])


def test_a_loop_beside_the_tree_is_refused() -> None:
    with pytest.raises(ValueError, match="do not form a tree: b, c"):
        tree_of(
            [
                joint_features("a", "fixed", "root", "x"),
                joint_features("b", "fixed", "y", "z"),
                joint_features("c", "fixed", "z", "y"),
            ]
        )


def test_a_subtree_is_the_child_and_all_beyond_and_nothing_beside() -> None:
    ends = {"a": ("root", "x"), "b": ("x", "y"), "c": ("x", "z"), "d": ("y", "w")}
    tree = tree_of([joint_features(name, "fixed", parent, child) for name, (parent, child) in ends.items()])
    assert set(moved_links(tree, "b")) == {"y", "w"}
    assert set(moved_links(tree, "a")) == {"x", "y", "z", "w"}
    assert moved_links(tree, "c") == ("z",)


def test_what_lies_beyond_a_joint_is_placed_alone_where_the_rest_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    keys = [
        tree_joint(f"j{i}", "revolute", "base", f"key{i}", xyz=(i, 0.0, 0.0), rpy=(0.1, 0.2, 0.3)) for i in range(9)
    ]
    tree = [*keys, tree_joint("cap", "fixed", "key3", "cap", xyz=(0.0, 0.0, 1.0))]
    turned, still = {"j3": 0.7}, link_to_root(tree, "base", {})
    calls: list[str] = []

    def counted(joint: TreeJoint, position: float) -> Array:
        calls.append(joint.name)
        return joint_motion(joint, position)

    monkeypatch.setattr("asset2sim.physics.kinematics.joint_motion", counted)
    alone = link_to_root([keys[3], tree[-1]], "base", turned, still)
    whole = link_to_root(tree, "base", turned)
    assert len(calls) == 2  # once each: at zero, and where it is fixed, a joint moves nothing
    for link, pose in whole.items():
        np.testing.assert_array_equal(alone[link], pose)
