"""The measures and the verdicts: pure functions over recorded numbers, each able to fail, each saying why."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from asset2sim.checks.at_rest import measurement_verdict, oscillates, oscillating_joints
from asset2sim.checks.declared_check import interaction_verdicts
from asset2sim.checks.rest import STILL, amplitude, drift, sign_changes
from asset2sim.checks.sweep import hull_loss
from asset2sim.engines.contacts import ContactPoint, by_pair, penetration
from schemas.interaction import Drop, Hold, Interaction, Nudge, Obstacle, Opening, Release, Reset, Sweep
from schemas.overlay import PhysicsOverlay
from schemas.settings import Thresholds
from schemas.verdict import CheckVerdict
from schemas.vocabulary import Engine, FailureMode, OverlapCause, Source
from tests.factories import make_joint, make_measurement, make_motion

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


LIMITS = Thresholds()
OVERLAY = PhysicsOverlay(
    asset_id="1", scale=1.0, scale_source=Source.RULE, contact_friction=0.5, links=(),
    joints=(make_joint("hinge"), make_joint("slide", "prismatic")),
)  # fmt: skip
DROP = Drop(
    timestep_s=1 / 240, height_m=0.05, seconds=0.6, peak_speed_m_s=1.0, final_speed_m_s=1e-4, sink_m=1e-5, finite=True
)
NUDGE = Nudge(joint="hinge", speed=1.0, final_speed=1e-3, peak_speed_m_s=0.3, seconds=1.0, finite=True)
SWEEP = Sweep(joint="slide", lower=0.0, upper=1.0, free_share=1.0, free_lower=0.0, free_upper=1.0)
HOLD = Hold(joint="slide", position=0.5, moved=1e-3, seconds=2.0)
RELEASE = Release(joint="hinge", by="gravity", start=0.5, target=0.0, end=0.01, seconds=0.4)
OPENING = Opening(joint="slide", opening=2.0, closing=None, effort_limit=100.0)
RESET = Reset(offset_m=(0.02, 0.02, 0.02), tilt_rad=(0.03, 0.03, 0.03), peak_speed_m_s=1.0, final_speed_m_s=1e-3,
              turned_rad=0.01, joint_motion=0.01, finite=True)  # fmt: skip
GOOD = Interaction(
    engine=Engine.MUJOCO, drops=(DROP, DROP.model_copy(update={"timestep_s": 1 / 60})), nudges=(NUDGE,),
    sweeps=(SWEEP,), holds=(HOLD,), releases=(RELEASE,), openings=(OPENING,), resets=(RESET, RESET),
)  # fmt: skip


def verdicts(**changes: object) -> dict[tuple[FailureMode, str], CheckVerdict]:
    found = interaction_verdicts(GOOD.model_copy(update=changes), OVERLAY, LIMITS)
    keyed = {(item.test, item.subject): item for item in found}
    assert len(keyed) == len(found), "a test and subject has one verdict"
    return keyed


def failed(**changes: object) -> CheckVerdict:
    (verdict,) = [item for item in verdicts(**changes).values() if not item.passed]
    assert "mujoco" in verdict.reason and verdict.value is not None and verdict.limit is not None
    return verdict


def test_what_behaves_passes_every_test() -> None:
    found = verdicts()
    assert all(item.passed for item in found.values())
    assert set(found) == {
        (FailureMode.DROP, "240 Hz"), (FailureMode.DROP, "60 Hz"), (FailureMode.NUDGE, "hinge"),
        (FailureMode.JAM, "slide"), (FailureMode.HOLD, "slide"), (FailureMode.RELEASE, "hinge"),
        (FailureMode.RESET, "start 1"), (FailureMode.RESET, "start 2"),
    }  # fmt: skip


@pytest.mark.parametrize(
    ("what", "changes", "value", "says"),
    [
        (DROP, {"peak_speed_m_s": 60.0}, 60.0, "explodes"),
        (DROP, {"finite": False, "peak_speed_m_s": 1e9}, 1e9, "explodes"),
        (DROP, {"final_speed_m_s": 0.2}, 0.2, "still moves at 0.2 m/s after 0.6 s"),
        (DROP, {"sink_m": 0.02}, 0.02, "20 mm deep"),
        (NUDGE, {"final_speed": 0.5}, 0.5, "moves at 0.5 rad/s after 1 s"),
        (NUDGE, {"speed": -2.0, "final_speed": 0.5}, 0.25, "nudged to -2 rad/s"),
        (NUDGE, {"peak_speed_m_s": 100.0}, 100.0, "explodes"),
        (NUDGE, {"finite": False}, 0.3, "explodes"),
        (RELEASE, {"end": 0.3, "seconds": None}, None, "does not get there"),
        (RELEASE, {"end": 0.2, "seconds": 0.4}, None, "ends at 0.2 rad"),
        (RELEASE, {"end": 0.0, "seconds": None}, None, "does not get there"),
        (RESET, {"peak_speed_m_s": 50.0}, 50.0, "reaches 50 m/s"),
        (RESET, {"final_speed_m_s": 0.4}, 0.4, "still moves"),
        (RESET, {"turned_rad": math.pi / 2}, math.pi / 2, "1.57 rad from where it rests"),
        (RESET, {"joint_motion": 0.3}, 0.3, "0.3 of its range"),
        (RESET, {"finite": False, "peak_speed_m_s": 1e9}, 1e9, "reaches"),
    ],
)
def test_what_misbehaves_fails_with_its_number(
    what: Drop | Nudge | Release | Reset, changes: dict[str, object], value: float | None, says: str
) -> None:
    kind = type(what).__name__.lower()
    bad = (*((RESET,) if what is RESET else ()), what.model_copy(update=changes))
    verdict = failed(**{f"{kind}s": bad})
    assert verdict.test == kind and verdict.subject in ("240 Hz", "hinge", "start 2") and says in verdict.reason
    assert value is None or verdict.value == pytest.approx(value)


def blocked(*, low: OverlapCause | None = None, high: OverlapCause | None = None, free: tuple[float, float]) -> Sweep:
    obstacles = [
        Obstacle(position=position, link_a="drawer", link_b="frame", depth_m=0.004, cause=cause)
        for position, cause in ((free[0] - 0.01, low), (free[1] + 0.01, high))
        if cause is not None
    ]
    return SWEEP.model_copy(
        update={"free_lower": free[0], "free_upper": free[1], "free_share": free[1] - free[0], "start": sum(free) / 2,
                "obstacles": tuple(obstacles)}
    )  # fmt: skip


def test_a_hull_in_the_way_fails_and_authored_geometry_does_not() -> None:
    hull, authored = OverlapCause.HULL, OverlapCause.AUTHORED
    verdict = failed(sweeps=(blocked(high=hull, free=(0.0, 0.5)),))
    assert verdict.value == pytest.approx(0.5) and "'drawer' and 'frame' overlap by 4 mm at 0.51 m" in verdict.reason
    passed = verdicts(sweeps=(blocked(high=authored, free=(0.0, 0.5)),))[FailureMode.JAM, "slide"]
    assert passed.passed and "authored geometry stops it" in passed.reason and passed.value == pytest.approx(0.5)
    mixed = blocked(low=hull, high=authored, free=(0.04, 0.5))
    assert hull_loss(mixed) == pytest.approx(0.04) and verdicts(sweeps=(mixed,))[FailureMode.JAM, "slide"].passed
    assert failed(sweeps=(blocked(low=hull, high=authored, free=(0.2, 0.5)),)).value == pytest.approx(0.8)
    assert verdicts(sweeps=(blocked(high=hull, free=(0.0, 0.95)),))[FailureMode.JAM, "slide"].passed


def test_a_joint_that_no_effort_moves_is_jammed_unless_authored_geometry_holds_it() -> None:
    stuck = OPENING.model_copy(update={"opening": None, "stuck": True})
    verdict = failed(openings=(stuck,))
    assert verdict.test is FailureMode.JAM and verdict.limit == 100.0
    still = blocked(high=OverlapCause.AUTHORED, free=(0.0, 0.31))
    assert all(item.passed for item in verdicts(openings=(stuck,), sweeps=(still,)).values())


def test_the_worst_hold_of_a_joint_decides() -> None:
    sags = HOLD.model_copy(update={"position": 0.25, "moved": 0.03})
    verdict = failed(holds=(HOLD, sags))
    assert verdict.value == 0.03 and verdict.limit == LIMITS.hold_m and "0.25 m" in verdict.reason
    assert failed(holds=(HOLD.model_copy(update={"joint": "hinge", "moved": 0.03}),)).limit == LIMITS.hold_rad
