"""Guards over rollouts written by hand: what the arm did, what the asset did, and what was done before it began."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("gymnasium", reason="gymnasium is not installed: it comes with the extra learn")
pytest.importorskip("mujoco", reason="MuJoCo is not installed here")
from asset2sim.gym.guards import Rollout, guard, solved_at_start
from schemas.learning_settings import GuardSettings

N = 1000
TIMES = np.arange(N) * 0.004
SETTINGS = GuardSettings()
LEVEL = np.full(N, 0.3)
STILL, UPRIGHT = np.zeros((N, 3)), np.tile([0.0, 0.0, 1.0], (N, 1))


def pushed(begins: float, ends: float, touch: tuple[float, float], joules: float = 0.1) -> Rollout:
    """A drawer of 0.2 m that goes from 0.1 m to 0, evenly, touched over a time."""
    since, until = touch
    touched = (since <= TIMES) & (until > TIMES)
    positions = 0.1 * (1.0 - np.clip((TIMES - begins) / (ends - begins), 0.0, 1.0))
    return Rollout(
        positions, touched, touched * (joules / touched.sum() if touched.any() else 0.0), LEVEL, STILL, UPRIGHT,
        0.0, 0.2, 0.0,
    )  # fmt: skip


def test_a_part_that_moves_while_it_is_touched_is_used() -> None:
    found = guard(pushed(1.0, 2.0, (0.9, 2.2)), SETTINGS)
    assert not found.degenerate
    assert (found.untouched_share, found.drift_share, found.spring_share) == (0.0, 0.0, 0.0)


def test_a_part_that_drifts_there_untouched_is_found() -> None:
    found = guard(pushed(1.0, 2.0, (3.0, 3.5)), SETTINGS)
    assert found.drifted and found.moved_untouched and found.degenerate
    assert found.untouched_share == pytest.approx(1.0) and found.drift_share == pytest.approx(1.0)
    assert guard(pushed(1.0, 2.0, (9.0, 9.5)), SETTINGS).drifted, "it was never touched"


@pytest.mark.parametrize(("released", "fires"), [(1.6, False), (1.4, True)])
def test_a_part_that_goes_most_of_its_way_by_itself_is_found(released: float, fires: bool) -> None:
    found = guard(pushed(1.0, 2.0, (0.9, released)), SETTINGS)
    assert found.untouched_share == pytest.approx(2.0 - released, abs=0.01)
    assert found.moved_untouched == fires and not found.drifted


def test_a_lid_that_falls_shut_once_it_was_pushed_over_is_used_and_one_that_falls_first_is_not() -> None:
    touched_first = pushed(1.0, 2.0, (0.9, 1.1))
    found = guard(replace(touched_first, heights=0.2 + touched_first.positions), SETTINGS)
    assert found.fallen_share == pytest.approx(0.9, abs=0.01) and found.untouched_share == 0.0 and not found.degenerate
    held = guard(replace(touched_first, heights=0.2 + touched_first.positions, holds=True), SETTINGS)
    assert held.moved_untouched and held.fallen_share == 0.0, (
        "what its friction bears swings on as the object is shoved"
    )
    touched_late = pushed(1.0, 2.0, (1.9, 2.2))
    found = guard(replace(touched_late, heights=0.2 + touched_late.positions), SETTINGS)
    assert found.drift_share == pytest.approx(0.9, abs=0.01) and found.drifted
    assert found.untouched_share == pytest.approx(0.9, abs=0.01) and found.moved_untouched and found.fallen_share == 0.0


@pytest.mark.parametrize(
    ("hops", "fires"), [((), True), ((1.06, 1.1, 1.14, 1.2, 1.3), True), (np.arange(1.02, 1.7, 0.03), False)]
)
def test_a_lid_that_is_struck_and_coasts_down_is_not_used_and_one_that_is_pushed_in_hops_is(
    hops: Sequence[float], fires: bool
) -> None:
    """Its speed falls to e⁻¹ of what it was in 0.3 s; the hand is at it until 1 s, and again at each hop."""
    struck = pushed(1.0, 2.0, (0.98, 1.0))
    positions = 0.1 * np.exp(-np.maximum(TIMES - 1.0, 0.0) / 0.3)
    touched = struck.touched | np.isin(np.arange(N), np.rint(np.array(hops) / 0.004).astype(int))
    found = guard(replace(struck, positions=positions, touched=touched, heights=0.2 + positions), SETTINGS)
    assert found.moved_untouched == fires and not found.drifted


@pytest.mark.parametrize(
    ("seconds", "edge_m", "terms", "fires"),
    [
        (0.2, 1.0, {}, False), (0.15, 1.0, {}, True), (0.15, 0.5, {}, False), (0.07, 0.5, {}, True),
        (0.15, 1.0, {"falls": True}, False), (0.15, 1.0, {"falls": True, "holds": True}, True),
    ],
)  # fmt: skip
def test_a_part_that_goes_faster_than_a_hand_is_struck_though_it_is_touched_all_along_unless_it_falls(
    seconds: float, edge_m: float, terms: dict[str, bool], fires: bool
) -> None:
    """It goes 0.1 m, or rad, in this time: 0.6 m/s at its edge are 0.167 s of a slider, 0.083 s of a hinge of 0.5 m."""
    struck = replace(pushed(1.0, 1.0 + seconds, (0.9, 2.2)), edge_m=edge_m, holds="holds" in terms)
    found = guard(replace(struck, heights=0.2 + struck.positions) if "falls" in terms else struck, SETTINGS)
    assert found.struck == found.degenerate == fires and found.struck_share == pytest.approx(float(fires), abs=0.05)


def test_a_sprung_part_that_swings_to_and_fro_once_it_is_let_go_of_is_not_struck() -> None:
    """Pressed in a second from 0.1 m to 0, it swings about 0.1 m by 0.1 m, at up to 2 m/s."""
    led = pushed(1.0, 2.0, (0.9, 2.0))
    swings = np.where(TIMES < 2.0, led.positions, 0.1 - 0.1 * np.cos(20.0 * (TIMES - 2.0)))
    assert guard(replace(led, positions=swings), SETTINGS).struck_share == 0.0


def test_drift_before_the_touch_is_found_even_where_the_push_does_the_rest() -> None:
    found = guard(pushed(1.0, 2.0, (1.08, 2.2)), SETTINGS)
    assert found.drift_share == pytest.approx(0.08, abs=0.005) and found.drifted and not found.moved_untouched


def test_what_moves_away_from_the_target_untouched_is_no_cheat() -> None:
    opened = replace(pushed(1.0, 2.0, (3.0, 3.5)), target=0.2)
    found = guard(opened, SETTINGS)
    assert found.untouched_share == found.drift_share == 0.0 and not found.degenerate


@pytest.mark.parametrize(
    ("stiffness", "rest", "share"), [(10.0, -0.2, 0.2), (10.0, 0.0, 1 / 3), (40.0, -0.05, 0.4 / 0.5)]
)
def test_a_spring_that_does_most_of_the_work_is_found(stiffness: float, rest: float, share: float) -> None:
    work = 0.5 * stiffness * ((0.1 - rest) ** 2 - rest**2)
    given = work * (1.0 - share) / share
    rollout = replace(pushed(1.0, 2.0, (0.9, 2.2), given), stiffness=stiffness, spring_reference=rest)
    found = guard(rollout, SETTINGS)
    assert found.spring_share == pytest.approx(share) and found.spring_did_it == (share > 0.5)


def test_a_spring_that_is_wound_up_by_the_arm_is_no_cheat() -> None:
    found = guard(replace(pushed(1.0, 2.0, (0.9, 2.2)), stiffness=50.0, spring_reference=0.1), SETTINGS)
    assert found.spring_share == 0.0 and not found.degenerate


@pytest.mark.parametrize(
    ("tilt_rad", "shift_m", "fires"),
    [
        (0.2, (0.0, 0.0, 0.0), False), (0.3, (0.0, 0.0, 0.0), True),
        (0.0, (0.03, 0.03, 0.0), False), (0.0, (0.04, -0.04, 0.0), True),
        (0.0, (0.0, 0.0, 0.02), False), (0.0, (0.0, 0.0, 0.04), True), (0.0, (0.0, 0.0, -0.04), False),
    ],
)  # fmt: skip
def test_an_object_that_was_tipped_shoved_or_lifted_on_the_way_was_not_used(
    tilt_rad: float, shift_m: tuple[float, float, float], fires: bool
) -> None:
    there_and_back = np.sin(np.linspace(0.0, np.pi, N))[:, None]
    angles = tilt_rad * there_and_back[:, 0]
    ups = np.stack([np.sin(angles), np.zeros(N), np.cos(angles)], axis=1)
    rollout = replace(pushed(1.0, 2.0, (0.9, 2.2)), centers=there_and_back * np.array(shift_m), ups=ups)
    found = guard(rollout, SETTINGS)
    assert found.displaced == found.degenerate == fires
    assert found.tilted_rad == pytest.approx(tilt_rad, abs=1e-3)
    assert found.travelled_m == pytest.approx(np.hypot(*shift_m[:2]), abs=1e-6)
    assert found.lifted_m == pytest.approx(max(shift_m[2], 0.0), abs=1e-6)


def test_a_part_that_rebounds_from_its_other_stop_is_found() -> None:
    """It is flicked open, away from its target, and comes back from the stop by itself."""
    out_and_back = 0.1 + np.interp(TIMES, [0.0, 1.0, 1.5, 2.5], [0.0, 0.0, 0.1, -0.1])
    touched = (TIMES > 0.9) & (TIMES < 1.4)
    found = guard(replace(pushed(1.0, 2.0, (0.9, 2.2)), positions=out_and_back, touched=touched), SETTINGS)
    assert found.untouched_share > 1.0 and found.moved_untouched


def test_limits_that_are_too_wide_make_the_start_the_goal() -> None:
    assert not solved_at_start(0.1, 0.0, 0.0, 0.2, SETTINGS)
    assert solved_at_start(0.1, 0.0, 0.0, 20.0, SETTINGS)
    assert guard(replace(pushed(1.0, 2.0, (0.9, 2.2)), upper=20.0), SETTINGS).degenerate
