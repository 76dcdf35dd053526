"""Stands, state and effort: objects that pass each, and objects that fail each for a reason that can be worked out."""

import math
from pathlib import Path

import pytest

from asset2sim.checks.declared_check import interaction_verdicts
from asset2sim.checks.effort import efforts
from asset2sim.checks.opening import openings
from asset2sim.checks.set_down import point_clouds, set_down
from asset2sim.checks.state import settled_positions
from schemas.interaction import Effort
from schemas.mechanism import EffortRange
from schemas.vocabulary import Engine, FailureMode
from tests.builders import UrdfJoint
from tests.interaction_objects import ENGINES, LIMITS, SETTINGS, Subject, interaction, opened, solid, subject

pytestmark = pytest.mark.system
HAND = EffortRange(kind="lid", least_n=0.0, most_n=22.2, source="a table")


def box_with_lid(folder: Path, *, friction: float, start: float, lid_kg: float = 0.5, box_kg: float = 2.0) -> Subject:
    """A box of 30 × 20 × 20 cm whose lid lies level at 0 and opens upwards about its back edge, at x = −0.15 m."""
    links = [
        solid("box", (0.3, 0.2, 0.2), (0.0, 0.0, 0.1), box_kg),
        solid("lid", (0.3, 0.2, 0.01), (0.15, 0.0, 0.005), lid_kg),
    ]
    joint = UrdfJoint("hinge", "revolute", "box", "lid", (0.0, -1.0, 0.0), (-0.15, 0.0, 0.2), 0.0, 1.5, 0.02, friction)
    item = subject(folder, links, [joint], start={"hinge": start}, holds=["hinge"])
    asked = [entry.model_copy(update={"asked_position": start, "effort_range": HAND}) for entry in item.overlay.joints]
    return Subject(item.urdf, item.overlay.model_copy(update={"joints": tuple(asked)}))


def failures(item: Subject, engine: Engine, only: FailureMode) -> list[str]:
    seen = interaction(engine, item, only=only)
    found = [verdict for verdict in interaction_verdicts(seen, item.overlay, LIMITS) if verdict.test is only]
    assert found, "the check has a verdict"
    return [verdict.reason for verdict in found if not verdict.passed]


@pytest.mark.parametrize("engine", ENGINES)
def test_a_block_stands_and_a_pole_that_leans_beyond_its_foot_does_not(tmp_path: Path, engine: Engine) -> None:
    squat = subject(tmp_path, [solid("block", (0.3, 0.3, 0.2))], [])
    assert failures(squat, engine, FailureMode.STANDS) == []
    with opened(squat, engine, plane=True) as world:
        record, _, support = set_down(world, squat.item, point_clouds(squat.urdf), SETTINGS)
    assert record.tilt_rad < 1e-3 and record.travel_m < 1e-3 and record.peak_speed_m_s < 0.1
    assert record.margin_rad == pytest.approx(math.atan2(0.15, 0.1), rel=1e-3)
    assert record.tip_energy_j == pytest.approx(9.81 * (math.hypot(0.15, 0.1) - 0.1), rel=1e-3)
    assert support.nearest == pytest.approx(0.15, rel=1e-3)
    foot = solid("foot", (0.1, 0.1, 0.02), mass=0.1)
    head = solid("head", (0.1, 0.1, 0.1), (0.12, 0.0, 0.3), 1.0)
    leaning = subject(tmp_path, [foot, head], [UrdfJoint("neck", "fixed", "foot", "head")])
    (reason,) = failures(leaning, engine, FailureMode.STANDS)
    assert "tilts by" in reason and "lean it on something" in reason


@pytest.mark.parametrize(("half_m", "kg", "fails"), [(0.005, 1.0, True), (0.005, 40.0, False), (0.01, 1.0, False)])
def test_what_stands_on_an_edge_that_a_touch_takes_it_over_does_not_stand(
    tmp_path: Path, half_m: float, kg: float, fails: bool
) -> None:
    """A plate on its edge: 1.4° and 0.6 mJ, which a finger has; heavier it takes 25 mJ, and thicker it has 2.9°."""
    plate = subject(tmp_path, [solid("plate", (2.0 * half_m, 0.4, 0.4), mass=kg)], [])
    reasons = failures(plate, Engine.PYBULLET, FailureMode.STANDS)
    assert bool(reasons) is fails, reasons
    assert not fails or "a touch tips it over" in reasons[0]


@pytest.mark.parametrize("engine", ENGINES)
def test_a_lid_that_falls_shut_has_lost_the_state_that_was_asked(tmp_path: Path, engine: Engine) -> None:
    load = 0.5 * 9.81 * math.hypot(0.15, 0.005)
    for friction, lost in ((1.5 * load, False), (0.1 * load, True)):
        item = box_with_lid(tmp_path, friction=friction, start=0.7)
        reasons = failures(item, engine, FailureMode.STATE)
        assert bool(reasons) is lost, reasons
    assert "asked to stand at 0.7 rad, settles at" in reasons[0]
    with opened(item, engine, plane=True) as world:
        _, resting, _ = set_down(world, item.item, point_clouds(item.urdf), SETTINGS)
    (record,) = settled_positions(item.item.joints, resting)
    assert record.settled == pytest.approx(0.0, abs=0.02) and record.share == pytest.approx(0.7 / 1.5, abs=0.02)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_lid_takes_its_load_and_its_friction_at_its_edge_and_tips_the_box_by_its_weight(
    tmp_path: Path, engine: Engine
) -> None:
    item = box_with_lid(tmp_path, friction=0.6, start=0.0)
    with opened(item, engine, plane=True) as world:
        _, _, support = set_down(world, item.item, point_clouds(item.urdf), SETTINGS)
    with opened(item, engine) as world:
        found = openings(world, item.item, SETTINGS)
    (record,) = efforts(item.item, point_clouds(item.urdf), found, support, 0.8, LIMITS)
    assert record.way == "opening" and record.lever_m == pytest.approx(0.3, rel=0.01)
    assert record.force_n == pytest.approx((0.5 * 9.81 * 0.15 + 0.6) / 0.3, rel=0.05)
    # Lifted at its front edge it turns about its back edge, half its depth behind both centres of mass.
    assert record.tips_at_n == pytest.approx(2.5 * 9.81 * 0.15 / 0.3, rel=0.02)
    assert failures(item, engine, FailureMode.EFFORT) == []
    firm = box_with_lid(tmp_path, friction=3.5, start=0.0)
    (reason,) = failures(firm, engine, FailureMode.EFFORT)
    assert "the object tips over at" in reason
    (reason,) = failures(box_with_lid(tmp_path, friction=8.0, start=0.0, box_kg=40.0), engine, FailureMode.EFFORT)
    assert "at most 22.2 N (a table): make the part lighter" in reason


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("below", "fails"), [(-0.02, False), (0.003, True)])
def test_a_drawer_that_stands_on_the_floor_is_pushed_there(
    tmp_path: Path, engine: Engine, below: float, fails: bool
) -> None:
    """Held by its root it takes 2 N; on the floor, on which most of the cabinet then stands, far more."""
    drawer = solid("drawer", (0.3, 0.3, 0.1), (0.0, 0.0, 0.05 - below), 4.0)
    walls = [solid(f"wall{i}", (0.4, 0.02, 0.5), (0.0, 0.2 - 0.4 * i, 0.25), 3.0) for i in range(2)]
    joints = [UrdfJoint("glue", "fixed", "wall0", "wall1"),
              UrdfJoint("slide", "prismatic", "wall0", "drawer", (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, 0.2,
                        friction=2.0)]  # fmt: skip
    item = subject(tmp_path, [*walls, drawer], joints)
    asked = tuple(entry.model_copy(update={"effort_range": HAND}) for entry in item.overlay.joints)
    item = Subject(item.urdf, item.overlay.model_copy(update={"joints": asked}))
    (record,) = interaction(engine, item, only=FailureMode.EFFORT).efforts
    assert record.on_floor is fails
    assert record.force_n > 22.2 if fails else record.force_n == pytest.approx(2.0, rel=0.05)
    assert bool(failures(item, engine, FailureMode.EFFORT)) is fails


def test_a_part_that_nothing_moves_has_no_effort(tmp_path: Path) -> None:
    item = box_with_lid(tmp_path, friction=0.6, start=0.0)
    with opened(item) as world:
        found = [entry.model_copy(update={"opening": None}) for entry in openings(world, item.item, SETTINGS)]
    assert efforts(item.item, point_clouds(item.urdf), found, None, 0.8, LIMITS) == ()
    assert Effort(joint="j", way="opening", effort=3.0, lever_m=0.5, tips_at_n=None, slides_at_n=None).force_n == 6.0
