"""The paper's reward and S, each term beside what a pocket calculator says."""

import math

import numpy as np
import pytest

pytest.importorskip("gymnasium", reason="gymnasium is not installed: it comes with the extra learn")
pytest.importorskip("mujoco", reason="MuJoCo is not installed here")
from asset2sim.gym.reward import Terms, reward_terms, success
from schemas.learning_settings import RewardSettings

SETTINGS = RewardSettings(
    reach_weight=2.0, reach_m=0.5, reach_xy_weight=3.0, reach_xy_m=0.1, joint_weight=7.0, joint_decay=2.0, gate_m=0.25,
    opening_weight=0.4, tilt_weight=0.6, off_xy_weight=0.8,
)  # fmt: skip
DOWN = (0.0, 0.0, -1.0)


def terms(
    to_part: tuple[float, ...] = (0.0, 0.0, 0.0), x: tuple[float, ...] = (0.5,), target: tuple[float, ...] = (0.5,),
    opening: float = 0.0, axis: tuple[float, ...] = DOWN, settings: RewardSettings = SETTINGS,
) -> Terms:  # fmt: skip
    vector, now, wanted, toward = (np.array([value], dtype=float) for value in (to_part, x, target, axis))
    return reward_terms(vector, now, wanted, np.array([opening]), toward, 0.04, settings)


def test_at_the_part_and_at_the_target_all_is_paid_and_nothing_taken() -> None:
    found = terms()
    assert (found.reach[0], found.reach_xy[0], found.joint[0], found.gate[0]) == (2.0, 3.0, 7.0, 1.0)
    assert found.opening[0] == found.tilt[0] == found.off_xy[0] == 0.0
    assert found.reward[0] == pytest.approx(0.04 * 12.0)


def test_reach_falls_with_the_distance_and_reach_xy_with_its_planar_part() -> None:
    found = terms(to_part=(0.03, -0.04, 0.12))  # 0.13 m away, 0.05 m in the plane
    assert found.reach[0] == pytest.approx(2.0 * (1.0 - math.tanh(0.26)))
    assert found.reach_xy[0] == pytest.approx(3.0 * (1.0 - math.tanh(0.5)))
    assert found.off_xy[0] == pytest.approx(-0.8 * 0.05)


def test_the_joint_pays_by_the_sum_of_all_joints_errors() -> None:
    found = terms(x=(0.9, 0.2), target=(0.6, 0.3))
    assert found.joint[0] == pytest.approx(7.0 * math.exp(-2.0 * 0.4))


@pytest.mark.parametrize(("away", "paid"), [(0.249, 7.0), (0.25, 0.0), (0.4, 0.0)])
def test_the_joint_pays_nothing_while_the_arm_is_far(away: float, paid: float) -> None:
    found = terms(to_part=(0.0, 0.0, away))
    assert (found.joint[0], found.gate[0]) == (paid, float(paid > 0.0))


@pytest.mark.parametrize(("axis", "taken"), [
    (DOWN, 0.0), ((1.0, 0.0, 0.0), -0.6), ((0.0, 0.0, 1.0), -1.2), ((0.6, 0.0, -0.8), -0.12),
])  # fmt: skip
def test_a_hand_that_does_not_point_down_costs(axis: tuple[float, ...], taken: float) -> None:
    assert terms(axis=axis).tilt[0] == pytest.approx(taken)


def test_an_open_gripper_costs() -> None:
    assert terms(opening=0.25).opening[0] == pytest.approx(-0.1)


def test_the_reward_is_the_sum_of_the_six_times_the_time_of_a_step() -> None:
    found = terms((0.1, 0.0, 0.1), (0.2,), (0.5,), 0.5, (0.6, 0.0, -0.8))
    six = [found.reach, found.reach_xy, found.joint, found.opening, found.tilt, found.off_xy]
    assert found.reward[0] == pytest.approx(0.04 * sum(float(term[0]) for term in six))


def test_many_environments_at_once_are_as_one_by_one() -> None:
    rng = np.random.default_rng(1)
    to_part, x, target, opening = (
        rng.normal(0.0, 0.2, (64, 3)),
        rng.random((64, 2)),
        rng.random((64, 2)),
        rng.random(64),
    )
    axis = rng.normal(size=(64, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    whole = reward_terms(to_part, x, target, opening, axis, 0.04, SETTINGS)
    assert whole.reward.shape == (64,) and 0 < whole.gate.sum() < 64
    for n in range(64):
        one = terms(tuple(to_part[n]), tuple(x[n]), tuple(target[n]), float(opening[n]), tuple(axis[n]))
        assert one.reward[0] == pytest.approx(whole.reward[n], abs=1e-12)


@pytest.mark.parametrize(("x", "expected"), [
    (0.6, 0.0), (0.35, 0.5), (0.1, 1.0), (0.15, 0.9), (0.0, 0.8), (0.9, 0.0),
])  # fmt: skip
def test_success_is_the_share_of_the_way_that_is_done_and_never_under_zero(x: float, expected: float) -> None:
    found = success(np.array([[x]]), np.array([[0.6]]), np.array([[0.1]]), SETTINGS)
    assert found == pytest.approx([expected])


def test_success_of_a_way_shorter_than_epsilon_is_of_epsilon() -> None:
    settings = RewardSettings(least_way=0.1)
    start, target = np.array([[0.32], [0.3]]), np.array([[0.3], [0.3]])
    assert success(start, start, target, settings) == pytest.approx([0.8, 1.0])


def test_our_weights_pay_more_for_the_part_than_for_being_near_and_penalties_least() -> None:
    ours = RewardSettings()
    near = ours.reach_weight + ours.reach_xy_weight
    assert terms(x=(1.0,), target=(0.0,), settings=ours).joint[0] < ours.reach_weight < near
    assert terms(x=(0.05,), target=(0.0,), settings=ours).joint[0] > 5.0 * near
    assert ours.opening_weight + 2.0 * ours.tilt_weight + ours.off_xy_weight < near / 2.0
