"""The measures and the verdict: pure functions over recorded numbers."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from asset2sim.checks.at_rest import measurement_verdict, oscillates, oscillating_joints
from asset2sim.checks.rest import STILL, amplitude, drift, sign_changes
from asset2sim.engines.contacts import ContactPoint, by_pair, penetration
from schemas.settings import Thresholds
from schemas.vocabulary import FailureMode
from tests.factories import make_measurement, make_motion

THRESHOLDS = Thresholds()
NONE: frozenset[str] = frozenset()


def test_drift_is_the_furthest_from_the_first_pose_not_the_last() -> None:
    positions = np.array([[1.0, 1, 1], [1.3, 1.4, 1], [1.1, 1, 1]])
    orientations = Rotation.from_rotvec([[0.2, 0, 0], [0.5, 0, 0], [0.1, 0, 0]]).as_quat()
    distance, turn = drift(positions, orientations)
    assert distance == pytest.approx(0.5)
    assert turn == pytest.approx(0.3)


def test_a_quaternion_and_its_negative_are_the_same_orientation() -> None:
    quaternion = Rotation.from_rotvec([0.0, 0.4, 0.0]).as_quat()
    assert drift(np.zeros((2, 3)), np.array([quaternion, -quaternion]))[1] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_what_is_no_number_has_drifted_without_end(bad: float) -> None:
    still = np.tile([0.0, 0.0, 0.0, 1.0], (2, 1))
    assert drift(np.array([[0.0, 0, 0], [0, bad, 0]]), still) == (math.inf, math.inf)
    still[1, 3] = bad
    assert drift(np.zeros((2, 3)), still) == (math.inf, math.inf)


def test_amplitude_is_the_range_of_positions() -> None:
    assert amplitude(np.array([0.1, -0.2, 0.05])) == pytest.approx(0.3)
    assert amplitude(np.array([0.1, math.nan])) == math.inf


def test_a_sine_changes_sign_twice_a_period() -> None:
    # Three and a half periods from a zero crossing turn at 1/4, 3/4, ...: seven times.
    assert sign_changes(np.sin(np.linspace(0.0, 7.0 * math.pi, 500))) == 7


def test_a_monotone_joint_and_a_still_one_never_change_sign() -> None:
    assert sign_changes(np.linspace(0.0, 1.0, 50)) == 0
    assert sign_changes(np.full(50, 0.3)) == 0
    assert sign_changes(np.array([0.3])) == 0


def test_trembling_below_the_last_digits_is_no_motion_and_a_pause_is_no_reversal() -> None:
    tremble = 0.4 * STILL * np.array([0, 1, 0, 1, 0, 1, 0])
    assert sign_changes(tremble) == 0
    assert sign_changes(10.0 * tremble) == 5
    assert sign_changes(np.array([0.0, 1, 1, 2, 2, 2, 3])) == 0
    assert sign_changes(np.array([0.0, 1, 1, 0])) == 1


def test_what_is_no_number_is_left_out_of_the_reversals() -> None:
    assert sign_changes(np.array([0.0, 1.0, math.nan, 1.0, 0.0])) == 1


def test_phi_adds_up_what_overlaps_and_leaves_out_gaps() -> None:
    seen = [("b", "a", -0.002), ("a", "b", -0.001), ("a", "c", -0.004), ("a", "c", 0.5)]
    points = [ContactPoint(*item) for item in seen]
    assert penetration(points) == pytest.approx(0.007)
    assert penetration([]) == 0.0
    worst, other = by_pair(points)
    assert (worst.link_a, worst.link_b, worst.n_points) == ("a", "c", 1)
    assert (other.link_a, other.link_b, other.n_points) == ("a", "b", 2)
    assert (other.depth_m, other.penetration_m) == pytest.approx((0.002, 0.003))


@pytest.mark.parametrize(
    ("field", "limit", "mode"),
    [
        ("penetration_m", 0.002, FailureMode.PENETRATION),
        ("drift_m", 1e-3, FailureMode.DRIFT),
        ("drift_rad", 1e-2, FailureMode.DRIFT),
        ("peak_speed_m_s", 6.0, FailureMode.DRIFT),
    ],
)
def test_each_bound_is_met_at_the_limit_and_broken_above(field: str, limit: float, mode: FailureMode) -> None:
    assert measurement_verdict(make_measurement(**{field: limit}), NONE, THRESHOLDS).passed
    verdict = measurement_verdict(make_measurement(**{field: 1.001 * limit}), NONE, THRESHOLDS)
    assert verdict.mode is mode
    assert (verdict.value, verdict.limit) == (1.001 * limit, limit)


def test_an_object_that_is_no_longer_a_number_explodes() -> None:
    verdict = measurement_verdict(make_measurement(finite=False), NONE, THRESHOLDS)
    assert verdict.mode is FailureMode.DRIFT and "explodes in pybullet" in verdict.reason


def test_an_overlap_names_its_worst_pair_in_millimetres() -> None:
    verdict = measurement_verdict(make_measurement(penetration_m=0.0123), NONE, THRESHOLDS)
    assert "12.3 mm" in verdict.reason and "'body' and 'door'" in verdict.reason


def test_oscillation_needs_both_reversals_and_amplitude() -> None:
    assert oscillates(make_motion("j", 0.051, 3), False, THRESHOLDS)
    assert not oscillates(make_motion("j", 0.051, 2), False, THRESHOLDS)
    assert not oscillates(make_motion("j", 0.05, 100), False, THRESHOLDS)


def test_a_slider_has_a_bound_of_its_own() -> None:
    seen = make_measurement(joints=(make_motion("hinge", 0.02, 9), make_motion("slider", 0.02, 9)))
    assert oscillating_joints(seen, frozenset({"slider"}), THRESHOLDS) == ("slider",)
    verdict = measurement_verdict(seen, frozenset({"slider"}), THRESHOLDS)
    assert verdict.mode is FailureMode.OSCILLATION
    assert "'slider'" in verdict.reason and "9 reversals" in verdict.reason
    assert verdict.limit == THRESHOLDS.oscillation_m
    assert measurement_verdict(seen, NONE, THRESHOLDS).passed


def test_the_first_failure_in_order_is_the_verdict() -> None:
    all_wrong = make_measurement(peak_speed_m_s=9.0, penetration_m=1.0, drift_m=1.0, joints=(make_motion("j", 1.0, 9),))
    order = []
    for cured in ({}, {"peak_speed_m_s": 0.1}, {"penetration_m": 0.0}, {"drift_m": 0.0}, {"joints": ()}):
        all_wrong = all_wrong.model_copy(update=cured)
        order.append(measurement_verdict(all_wrong, NONE, THRESHOLDS).mode)
    assert order == [
        FailureMode.DRIFT,
        FailureMode.PENETRATION,
        FailureMode.DRIFT,
        FailureMode.OSCILLATION,
        FailureMode.NONE,
    ]
