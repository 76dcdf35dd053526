"""What tips a block over and slides it, and where a hand takes hold of a part: against figures worked out by hand."""

import math

import numpy as np
import pytest

from asset2sim.physics.grip import grip_on
from asset2sim.physics.support_polygon import LEANING_RAD, leaning_on, standing_on
from tests.builders import standing_block

UP = np.array([0.0, 0.0, 1.0])
G = 9.81


def test_a_block_is_tipped_by_its_weight_times_half_its_depth_over_the_height_of_the_push() -> None:
    stands = standing_on(standing_block(0.2, 0.4, 0.6), np.array([0.0, 0.0, 0.3]), 5.0, UP)
    push = stands.tips_at(np.array([0.1, 0.0, 0.6]), np.array([1.0, 0.0, 0.0]))
    assert push == pytest.approx(5.0 * G * 0.1 / 0.6)
    assert stands.tips_at(np.array([0.1, 0.0, 0.3]), np.array([1.0, 0.0, 0.0])) == pytest.approx(5.0 * G * 0.1 / 0.3)
    lift = stands.tips_at(np.array([0.1, 0.0, 0.6]), UP)
    assert lift == pytest.approx(5.0 * G * 0.1 / 0.2), "lifted at one edge it turns about the other"
    assert stands.tips_at(np.array([0.0, 0.0, 0.6]), -UP) is None, "nothing tips it that presses it down"


def test_its_margin_is_the_angle_at_which_its_centre_of_mass_is_over_the_edge() -> None:
    stands = standing_on(standing_block(0.2, 0.4, 0.6), np.array([0.02, 0.0, 0.3]), 5.0, UP)
    assert stands.margin_rad == pytest.approx(math.atan2(0.08, 0.3))
    assert stands.rise == pytest.approx(math.hypot(0.08, 0.3) - 0.3)
    assert stands.furthest == pytest.approx(0.2)
    beyond = standing_on(standing_block(0.2, 0.4, 0.6), np.array([0.2, 0.0, 0.3]), 5.0, UP)
    assert beyond.margin_rad == 0.0 and beyond.tips_at(np.array([0.1, 0.0, 0.6]), np.array([1.0, 0.0, 0.0])) == 0.0
    needle = standing_on(np.array([(0.0, 0.0, 0.0), (0.0, 0.0, 0.3)]), np.array([0.0, 0.0, 0.1]), 1.0, UP)
    assert needle.margin_rad == needle.rise == 0.0


def test_on_feet_at_its_front_alone_it_leans_back_onto_its_rear_edge_and_no_further() -> None:
    """A box 40 cm deep on feet 1 cm high under its front; the rear ones are missing."""
    box = standing_block(0.4, 0.6, 0.2) + np.array([0.0, 0.0, 0.01])
    feet = np.array([(x, y, 0.0) for x in (0.15, 0.2) for y in (-0.3, 0.3)])
    points, center = np.vstack([box, feet]), np.array([0.0, 0.0, 0.11])
    assert standing_on(points, center, 5.0, UP).nearest == 0.0
    leans = leaning_on(points, center, 5.0, UP)
    angle = math.atan2(0.01, 0.15 + 0.2)
    assert math.acos(leans.up @ UP) == pytest.approx(angle) and angle < LEANING_RAD
    # Its rear edge along the floor that it leans to, from under its centre of mass; its front feet are further.
    assert leans.nearest == pytest.approx(0.2 * math.cos(angle) - 0.1 * math.sin(angle))
    high = points + np.vstack([np.tile([0.0, 0.0, 0.05], (8, 1)), np.zeros((4, 3))])
    assert leaning_on(high, center, 5.0, UP).nearest == 0.0, "with feet of 6 cm it would tip over"
    stands = standing_block(0.2, 0.4, 0.6)
    assert leaning_on(stands, np.array([0.0, 0.0, 0.3]), 5.0, UP).up is UP


def test_it_slides_at_the_friction_of_its_weight_and_less_where_the_push_lifts() -> None:
    stands = standing_on(standing_block(0.2, 0.4, 0.6), np.array([0.0, 0.0, 0.3]), 5.0, UP)
    assert stands.slides_at(np.array([1.0, 0.0, 0.0]), 0.4) == pytest.approx(0.4 * 5.0 * G)
    slanted = np.array([1.0, 0.0, 1.0]) / math.sqrt(2.0)
    assert stands.slides_at(slanted, 0.4) == pytest.approx(0.4 * 5.0 * G * math.sqrt(2.0) / 1.4)
    assert stands.slides_at(-UP, 0.4) is None


def test_a_lid_is_gripped_at_the_edge_across_from_its_hinge_and_a_drawer_at_its_front() -> None:
    lid = standing_block(0.3, 0.2, 0.01) + np.array([0.15, 0.0, 0.0])
    grip = grip_on(lid, np.array([0.0, -1.0, 0.0]), np.zeros(3), slides=False, opens=1.0)
    assert grip is not None and grip.lever == pytest.approx(0.3, rel=0.01)
    assert grip.direction == pytest.approx([0.0, 0.0, 1.0], abs=0.03), "it opens upwards"
    drawer = grip_on(standing_block(0.3, 0.2, 0.1), np.array([1.0, 0.0, 0.0]), np.zeros(3), slides=True, opens=-1.0)
    assert drawer is not None and drawer.lever == 1.0
    assert drawer.point == pytest.approx([-0.15, 0.0, 0.05]), "its front is where it opens to"
    knob = grip_on(standing_block(0.04, 0.04, 0.02), UP, np.zeros(3), slides=False, opens=1.0)
    assert knob is not None and knob.lever == pytest.approx(0.02 * math.sqrt(2.0))
    assert grip_on(np.zeros((0, 3)), UP, np.zeros(3), slides=False, opens=1.0) is None
