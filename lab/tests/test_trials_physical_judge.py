"""The physical judge, on recordings written by hand: each fault it finds, and what it lets pass."""

from dataclasses import replace

import numpy as np
import pytest

from lab.schemas.settings import TrialSettings
from lab.trials.physical_judge import FAULTS, judge, score
from lab.trials.record import Track

N, STEP = 1500, 0.004
TIMES = np.linspace(0.0, (N - 1) * STEP, N)
CONTACT = 750
"""The sample at which the tool first touches: after 3 s, until 4 s."""
MASS = 0.5


def still() -> Track:
    """Six seconds in which nothing moves but a tool that touches for one."""
    touched = np.zeros(N, dtype=bool)
    touched[CONTACT : CONTACT + 250] = True
    poses = np.tile(np.eye(4), (N, 2, 1, 1))
    none = np.zeros(N)
    return Track(
        TIMES, ("approach",) * N, ("base", "lid"), poses, ("hinge",), np.full((N, 1), 0.3), np.zeros((N, 1)),
        np.zeros((N, 3)), touched * 2.0, touched * 1e-4, touched, none, none, True,
    )  # fmt: skip


def judged(track: Track, *, sliders: tuple[str, ...] = (), free: tuple[str, ...] = ()) -> tuple[list[str], float]:
    """The faults, and the score of a task that was done."""
    found = judge(track, MASS, sliders, free, TrialSettings())
    faults = [*FAULTS]
    return [name for name in faults if getattr(found, name)], score(found, done=True, finite=track.finite)


def test_a_force_that_nothing_bears_and_an_object_that_is_tipped_take_from_the_score() -> None:
    """A blow of 750 N, and a bucket that lies on its side once it was touched, scored five of five."""
    blow = replace(still(), force_n=np.where(np.arange(N) == CONTACT + 9, 750.0, 2.0))
    assert judged(blow) == (["forced"], 4.0)
    assert judged(replace(still(), force_n=np.full(N, 120.0))) == ([], 5.0)
    over = still().poses.copy()
    angles = 1.5 * np.clip((TIMES - 3.2) / 0.5, 0.0, 1.0)
    over[:, :, 0, 0] = over[:, :, 2, 2] = np.cos(angles)[:, None]
    over[:, :, 0, 2], over[:, :, 2, 0] = np.sin(angles)[:, None], -np.sin(angles)[:, None]
    tipped = replace(still(), poses=over)
    assert judged(tipped) == (["tipped"], 3.5)
    assert not judge(tipped, MASS, (), (), TrialSettings(), carried=True).tipped, "what is carried may be tilted"


def with_hinge(positions: np.ndarray) -> Track:
    return replace(still(), positions=positions[:, None])


def test_what_is_only_touched_has_no_fault_and_full_score() -> None:
    assert judged(still()) == ([], 5.0)


def test_a_lid_that_closes_before_it_is_touched_is_a_fault_and_after_it_is_none() -> None:
    fall = 0.3 - 0.3 * np.clip((TIMES - 2.0) / 0.5, 0.0, 1.0)
    assert judged(with_hinge(fall)) == (["moved_before_contact"], 3.5)
    push = 0.3 - 0.3 * np.clip((TIMES - 3.2) / 0.5, 0.0, 1.0)
    assert judged(with_hinge(push)) == ([], 5.0)


def test_a_free_part_may_come_to_rest_in_the_first_second_and_not_later() -> None:
    early = 0.3 + 1.2 * np.clip(TIMES / 0.5, 0.0, 1.0)
    assert judged(with_hinge(early))[0] == ["moved_before_contact"]
    assert judged(with_hinge(early), free=("hinge",))[0] == []
    late = 0.3 + 1.2 * np.clip((TIMES - 1.5) / 0.5, 0.0, 1.0)
    assert judged(with_hinge(late), free=("hinge",))[0] == ["moved_before_contact"]


def test_an_object_that_slides_or_tips_by_itself_is_a_fault() -> None:
    slid, tipped = still(), still()
    slid.poses[100:, :, 0, 3] += 0.006
    assert judged(slid)[0] == ["moved_before_contact"]
    turn = 0.06
    tipped.poses[100:, :, :3, :3] = np.array(
        [[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]]
    )
    assert judged(tipped)[0] == ["moved_before_contact"]


@pytest.mark.parametrize(("joules", "spread", "faults"), [
    (0.9 * 0.002 * MASS * 9.81, 300, []),
    (1.1 * 0.002 * MASS * 9.81, 300, ["energy_appeared"]),
    (1.1 * 0.5 * MASS * 0.25**2, 1, ["energy_appeared", "jumped"]),
])  # fmt: skip
def test_energy_from_nowhere_counts_by_the_height_and_the_speed_it_gives(
    joules: float, spread: int, faults: list[str]
) -> None:
    given = np.zeros(N)
    given[800 : 800 + spread] = joules / spread
    assert judged(replace(still(), given_j=given))[0] == faults


def test_what_a_contact_takes_and_gives_back_within_a_picture_is_no_energy() -> None:
    given = np.zeros(N)
    given[800], given[801] = -0.5, 0.5
    assert judged(replace(still(), given_j=given))[0] == []


@pytest.mark.parametrize(("later_s", "faults"), [(0.2, []), (3.0, ["energy_appeared"])])
def test_a_stop_may_give_back_for_a_while_what_it_took_and_not_for_ever(later_s: float, faults: list[str]) -> None:
    given = np.zeros(N)
    given[500], given[500 + round(later_s / STEP)] = -0.03, 0.012
    assert judged(replace(still(), given_j=given))[0] == faults


def test_a_tool_inside_the_object_is_a_fault() -> None:
    deep = still().depth_m.copy()
    deep[900] = 0.004
    assert judged(replace(still(), depth_m=deep)) == (["overlapped"], 4.0)


@pytest.mark.parametrize(("amplitude", "kind", "faults"), [
    (0.06, (), ["rang"]), (0.02, (), []), (0.006, ("hinge",), ["rang"]), (0.002, ("hinge",), []),
])  # fmt: skip
def test_a_part_that_swings_after_it_was_let_go_rings(
    amplitude: float, kind: tuple[str, ...], faults: list[str]
) -> None:
    swing = 0.3 + np.where(TIMES > 4.1, amplitude * np.sin(2.0 * np.pi * 3.0 * (TIMES - 4.1)), 0.0)
    assert judged(with_hinge(swing), sliders=kind)[0] == faults


def test_scores_of_what_is_not_done_not_touched_and_gone() -> None:
    clean = judge(still(), MASS, (), (), TrialSettings())
    assert score(clean, done=False, finite=True) == 3.0
    untouched = judge(replace(still(), touched=np.zeros(N, dtype=bool)), MASS, (), (), TrialSettings())
    assert untouched.first_contact_s is None and score(untouched, done=False, finite=True) == 1.0
    assert score(clean, done=True, finite=False) == 0.0
