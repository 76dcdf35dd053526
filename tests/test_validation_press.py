"""A press neither tips nor slides what it is on: a box of 2 kg with a pedal in front and a button on its face."""

import math

import numpy as np
import pytest

from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint
from asset2sim.validation.notes import Notes
from asset2sim.validation.press import Stand, bounded_press, far_edge, largest_press, reach_of, stands_on
from schemas.base import Vector3
from schemas.overlay import JointProposal
from schemas.settings import PhysicsSettings
from tests.builders import corners, tree_joint

SETTINGS = PhysicsSettings()
G = 9.81
BOX = corners((-0.1, -0.1, 0.0), (0.1, 0.1, 0.4))


def stand(points: Array, joint: TreeJoint, mass: float = 2.0, com: Vector3 = (0.0, 0.0, 0.2)) -> Stand:
    """The box with one part, friction 0.5."""
    child_to_root = joint.child_to_parent
    return Stand(
        tree=(joint,), poses={"box": np.eye(4), "part": child_to_root}, points={"box": BOX, "part": points},
        edges=stands_on(np.vstack([BOX, points]), 0.0), floor=0.0, mass=mass, com=np.array(com), friction=0.5,
    )  # fmt: skip


PEDAL = tree_joint("pedal", "revolute", "box", "part", axis=(0.0, 1.0, 0.0))
"""About y through the origin: its edge at x = 0.15 goes down as the angle grows."""
PEDAL_POINTS = corners((0.0, -0.02, 0.03), (0.15, 0.02, 0.04))
BUTTON = tree_joint("button", "prismatic", "box", "part", axis=(-1.0, 0.0, 0.0))
BUTTON_POINTS = corners((0.1, -0.01, 0.29), (0.11, 0.01, 0.31))


def test_a_pedal_is_reached_at_its_far_edge() -> None:
    item = stand(PEDAL_POINTS, PEDAL)
    assert reach_of(item, PEDAL) == pytest.approx(math.hypot(0.15, 0.04))
    assert reach_of(stand(BUTTON_POINTS, BUTTON), BUTTON) == 1.0
    np.testing.assert_allclose(far_edge(stand(BUTTON_POINTS, BUTTON), BUTTON)[0], (0.105, 0.0, 0.3))


def test_a_foot_on_the_pedal_does_not_tip_the_bin() -> None:
    lever, length = np.array([0.15, 0.0, 0.04]), math.hypot(0.15, 0.04)
    down, along = lever[0] / length, lever[2] / length
    # About the front edge at x = 0.1: the press goes down 5 cm before it and forward 4 cm above the floor.
    arm = down * (0.15 - 0.1) + along * 0.04
    expected = SETTINGS.press_margin * 2.0 * G * 0.1 / arm
    assert largest_press(stand(PEDAL_POINTS, PEDAL), PEDAL, 1.0, SETTINGS) == pytest.approx(expected)
    light = largest_press(stand(PEDAL_POINTS, PEDAL, mass=0.4), PEDAL, 1.0, SETTINGS)
    assert light == pytest.approx(expected / 5.0), "no hand holds a light bin down"


def test_a_finger_on_the_face_neither_slides_nor_tips_the_box() -> None:
    slides, tips = 0.5 * 2.0 * G, 2.0 * G * 0.1 / 0.3
    found = largest_press(stand(BUTTON_POINTS, BUTTON), BUTTON, 1.0, SETTINGS)
    assert found == pytest.approx(SETTINGS.press_margin * min(slides, tips))


def test_what_a_hand_holds_is_pressed_at_will() -> None:
    assert largest_press(stand(BUTTON_POINTS, BUTTON, mass=0.2), BUTTON, 1.0, SETTINGS) == math.inf
    lying = tree_joint("key", "prismatic", "box", "part", axis=(0.0, 0.0, -1.0))
    assert largest_press(stand(BUTTON_POINTS - [0.1, 0.0, 0.0], lying), lying, 1.0, SETTINGS) == math.inf


def test_on_a_line_nothing_is_known() -> None:
    assert stands_on(np.zeros((0, 3)), 0.0).shape == (0, 3)
    assert stands_on(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), 0.0).shape == (
        0,
        3,
    )


def test_a_press_that_is_too_strong_is_lowered_in_proportion_with_a_finding() -> None:
    notes, wanted = Notes(), JointProposal(name="pedal", press_start=15.0, press_end=25.0)
    assert bounded_press(wanted, 30.0, notes) == wanted and not notes.findings
    lowered = bounded_press(wanted, 5.0, notes)
    assert lowered.press_start == pytest.approx(3.0) and lowered.press_end == pytest.approx(5.0)
    (finding,) = notes.findings
    assert (finding.code, finding.joint, finding.value, finding.limit) == ("press_bounded", "pedal", 25.0, 5.0)
