"""What it takes to topple an object, against the geometry of a box, and how a reset's verdict uses it."""

import math
from pathlib import Path

import numpy as np
import pytest

from asset2sim.checks.reset import reset_verdict
from asset2sim.physics.support_polygon import standing_on
from schemas.interaction import Interaction, Reset
from schemas.vocabulary import Engine, FailureMode
from tests.assets import near
from tests.builders import UrdfLink, standing_block
from tests.interaction_objects import LIMITS, SETTINGS, interaction, solid, subject

UP = np.array([0.0, 0.0, 1.0])


def rise(points: np.ndarray, center: np.ndarray, up: np.ndarray) -> tuple[float, float]:
    """What topples a body, m, and the longest way from under its centre to an edge, m."""
    support = standing_on(points, center, 1.0, up)
    return support.rise, support.furthest


@pytest.mark.parametrize(
    ("center", "up", "tips"),
    [
        ((0.02, 0.0, 0.3), (0.0, 0.0, 1.0), math.hypot(0.08, 0.3) - 0.3), ((0.3, 0.0, 0.3), (0.0, 0.0, 1.0), 0.0),
        ((0.1, 0.0, 0.3), (0.0, 0.0, 1.0), 0.0), ((0.0, 0.0, 0.3), (1.0, 0.0, 0.0), math.hypot(0.2, 0.1) - 0.1),
    ],
    ids=["over its nearest edge", "leaning over an edge", "on an edge", "on another side"],
)  # fmt: skip
def test_a_box_tips_over_its_nearest_edge(center: tuple[float, ...], up: tuple[float, ...], tips: float) -> None:
    found, support = rise(standing_block(0.2, 0.4, 0.6), np.array(center), np.array(up))
    assert found == pytest.approx(tips, abs=1e-12)
    assert center[0] != 0.02 or near(support, 0.2)


def test_what_stands_on_an_edge_or_a_point_needs_nothing() -> None:
    wedge = np.array([[0.0, -0.1, 0.0], [0.0, 0.1, 0.0], [0.1, 0.0, 0.3], [-0.1, 0.0, 0.3]])
    assert rise(wedge, np.array([0.0, 0.0, 0.2]), UP) == (0.0, 0.0)


def start(turned: float, final: float = 0.0) -> Reset:
    return Reset(
        offset_m=(0.02, 0.02, 0.02), tilt_rad=(0.03, 0.0, 0.0), peak_speed_m_s=1.0, final_speed_m_s=final,
        turned_rad=turned, joint_motion=0.0, finite=True,
    )  # fmt: skip


def test_what_the_start_can_topple_may_topple_and_no_more() -> None:
    narrow = Interaction(engine=Engine.PYBULLET, tip_rise_m=0.005, support_m=0.05)
    stable = narrow.model_copy(update={"tip_rise_m": 0.03})
    toppled = reset_verdict(start(1.57), 0, narrow, LIMITS)
    assert toppled.passed and "a rise of 5 mm does" in toppled.reason and "21.5 mm" in toppled.reason
    assert not reset_verdict(start(1.57), 0, stable, LIMITS).passed
    assert not reset_verdict(start(1.57, final=0.3), 0, narrow, LIMITS).passed, "it must come to rest"
    assert reset_verdict(start(0.01), 0, stable, LIMITS).passed


@pytest.mark.system
def test_a_pole_s_support_is_measured_in_the_engine(tmp_path: Path) -> None:
    item = subject(tmp_path, [solid("pole", (0.02, 0.04, 0.6))], [])
    seen = interaction(Engine.PYBULLET, item)
    assert seen.tip_rise_m is not None and near(seen.tip_rise_m, math.hypot(0.01, 0.3) - 0.3, 1e-3)
    assert near(seen.support_m, 0.02, 1e-3)


@pytest.mark.system
def test_a_lamp_may_roll_on_the_rim_of_its_foot_for_longer_than_a_drop(tmp_path: Path) -> None:
    # Its centre of mass is 0.6 m over a disc of 0.3 m, which tips at 14°; what rocks so, comes to rest in under 6 s.
    disc = '<cylinder radius="0.15" length="0.02"/>'
    lamp = UrdfLink("lamp", 5.0, (0.0, 0.0, 0.6), (2.0, 0.0, 0.0, 2.0, 0.0, 0.02), ((disc, (0.0, 0.0, 0.01)),))
    item = subject(tmp_path, [lamp], [])
    seen = interaction(Engine.PYBULLET, item, only=FailureMode.RESET)
    verdicts = [reset_verdict(one, index, seen, LIMITS) for index, one in enumerate(seen.resets)]
    assert len(verdicts) == SETTINGS.resets and [one.reason for one in verdicts if not one.passed] == []
