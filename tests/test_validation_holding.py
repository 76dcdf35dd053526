"""What holds a part where it is left: friction that a hand can move, springs that carry an open door."""

import math

import numpy as np
import pytest

from asset2sim.guidance.tables import mechanism, part_effort
from asset2sim.physics.mass_matrix import Pull
from asset2sim.validation.handling import SAFE_SHARE, Handling, handling, standing_part
from asset2sim.validation.holding import NO_BALANCE, counterbalance, holding
from asset2sim.validation.joints import JointMechanics, held_where_left
from asset2sim.validation.limits import Range
from asset2sim.validation.positions import Start
from schemas.features import JointFeatures
from schemas.mechanism import EffortRange
from schemas.overlay import JointProposal, Level
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Source
from tests.factories import make_features

SETTINGS = PhysicsSettings()
ANY = EffortRange(kind="part", least_n=0.0, most_n=22.2, source="a table")
LID = Handling(ANY, anywhere=False, counterbalanced=False)
SCREEN = Handling(ANY, anywhere=True, counterbalanced=False)
LOAD = 2.0
"""Gravity's pull on the lid where it lies level, N·m."""


def joint(lower: float = 0.0, upper: float = math.pi / 2) -> JointFeatures:
    hinge = next(item for item in make_features("1").joints if item.type == "revolute")
    return hinge.model_copy(update={"lower": lower, "upper": upper})


def start(position: float, lower: float = 0.0, upper: float = math.pi / 2) -> Start:
    """A hinge that is closed at its lower limit, standing at ``position`` as it was asked to."""
    span = Range(joint(lower, upper), lower, upper, lower, upper, Source.AUTHORED)
    return Start(span, position, Source.USER, requested=True, asked=position)


def lid_pull(position: float) -> Pull:
    """A lid that lies level at 0, where gravity pulls it shut with ``LOAD``, and stands upright at π/2."""
    return Pull(position, -LOAD * math.cos(position), LOAD * math.sin(position))


def door_pull(position: float) -> Pull:
    """A door that stands upright at 0 and lies open, level, at π/2, where gravity pulls it open with ``LOAD``."""
    return Pull(position, LOAD * math.sin(position), LOAD * math.cos(position))


def friction(position: float, kind: Handling, pull: Pull, bump: float = 0.0, margin: float = 2.0) -> float:
    at = start(position)
    return holding(at, pull, LOAD, kind, NO_BALANCE, bump_share=bump, margin=margin, settings=SETTINGS).friction


def test_a_lid_is_held_where_it_is_asked_to_stand_and_not_for_the_worst_of_its_range() -> None:
    assert friction(1.2, LID, lid_pull(1.2)) == pytest.approx(2.0 * LOAD * math.cos(1.2))
    worst = friction(1.2, SCREEN, lid_pull(1.2))
    assert worst == pytest.approx(2.0 * LOAD * math.cos(math.pi / 8)), "a screen is left anywhere"
    low = friction(1.2, SCREEN, lid_pull(1.2), margin=SETTINGS.least_hold_margin)
    assert low == pytest.approx(1.25 * LOAD * math.cos(math.pi / 8)), "the least that holds it, where words ask for low"


@pytest.mark.parametrize(("level", "margin"), [(None, 1.5), ("low", 1.25), ("high", 1.5)])
def test_a_screen_holds_half_as_much_again_as_its_worst_load(level: Level | None, margin: float) -> None:
    mechanics = JointMechanics(0.1, 0.1, 0.1, lid_pull(1.2), LOAD, bears_most=False)
    asked = JointProposal(name="hinge", holds=True, damping_level=level)
    held = held_where_left(asked, start(1.2), mechanics, SCREEN, True, SETTINGS)
    assert held.friction == pytest.approx(margin * LOAD * math.cos(math.pi / 8))


def test_what_rests_on_its_stop_needs_no_friction() -> None:
    assert friction(0.0, LID, lid_pull(0.0)) == 0.0
    assert friction(math.pi / 2, LID, door_pull(math.pi / 2)) == 0.0
    assert friction(0.0, LID, lid_pull(0.0), bump=1.2) == pytest.approx(0.2 * LOAD), "a bump beyond its weight"


def test_a_hand_can_move_it_unless_it_would_not_stand_where_it_is_asked_to() -> None:
    weak = Handling(ANY, anywhere=False, counterbalanced=False, tips_upward=2.45 / SAFE_SHARE, tips_downward=9.0)
    here = LOAD * math.cos(1.0)
    assert friction(1.0, weak, lid_pull(1.0)) == pytest.approx(2.45 - here)
    weaker = Handling(ANY, anywhere=False, counterbalanced=False, tips_upward=1.2 / SAFE_SHARE, tips_downward=9.0)
    assert friction(1.0, weaker, lid_pull(1.0)) == pytest.approx(SETTINGS.least_hold_margin * here)
    held = holding(start(1.0), lid_pull(1.0), LOAD, weak, NO_BALANCE, bump_share=0.0, margin=2.0, settings=SETTINGS)
    assert held.cut and held.wanted == pytest.approx(2.0 * here)


OVEN = Handling(ANY, anywhere=False, counterbalanced=True)
FITTED = (1.0 - math.sin(math.pi / 8)) / (3.0 * math.pi / 8)
"""Slope of the chord of a sine from an eighth of π to π/2, per N·m: of all lines that of the least worst error."""
STEEPEST = math.acos(FITTED)
RIPPLE = (math.sin(STEEPEST) - math.sin(math.pi / 8) - FITTED * (STEEPEST - math.pi / 8)) / 2.0
"""Half of the sine's height over that chord: 7 % of the door's weight."""


def test_the_springs_of_a_door_leave_the_least_of_its_weight_wherever_people_leave_it() -> None:
    found = counterbalance(start(0.0), door_pull(0.0), OVEN, 1.0, SETTINGS)
    assert found.stiffness == pytest.approx(FITTED * LOAD, rel=1e-3)
    positions = np.linspace(math.pi / 8, math.pi / 2, 33)
    left = door_pull(0.8).at(positions) + found.at(positions)
    assert np.abs(left).max() == pytest.approx(RIPPLE * LOAD, rel=1e-2)
    assert pytest.approx(0.0704, abs=1e-4) == RIPPLE
    assert left[-1] < 0.0 and float(found.at(0.0)) < 0.0, "they lift it from its open end, and pull it shut"
    half = counterbalance(start(math.pi / 4), door_pull(math.pi / 4), OVEN, 1.0, SETTINGS)
    assert half.stiffness == pytest.approx(found.stiffness), "wherever beyond a quarter it starts"
    assert half.reference == pytest.approx(found.reference)
    ajar = counterbalance(start(math.pi / 20), door_pull(math.pi / 20), OVEN, 1.0, SETTINGS)
    assert abs(float(door_pull(0.0).at(math.pi / 20) + ajar.at(math.pi / 20))) < 0.1 * LOAD, "it stays ajar, too"
    assert counterbalance(start(0.0), lid_pull(0.8), OVEN, 1.0, SETTINGS) == NO_BALANCE, "gravity shuts it"
    assert counterbalance(start(0.0), door_pull(0.8), LID, 1.0, SETTINGS) == NO_BALANCE
    light = counterbalance(start(0.0), door_pull(0.8), OVEN, 1e-3, SETTINGS)
    assert light.stiffness == pytest.approx(0.25e-3 * 3600.0, rel=1e-3), "what the time step bears"


def test_a_dishwashers_door_half_open_shuts_by_the_force_that_was_measured_of_one() -> None:
    # Drake's DoorHinge, by a force gauge: 3 N·m of friction, 6 kg at 0.35 m, an edge at 0.7 m.
    weight, edge = 6.0 * 9.81 * 0.35, 0.7
    at = math.pi / 4
    pull = Pull(at, weight * math.sin(at), weight * math.cos(at))
    kind = Handling(ANY, anywhere=False, counterbalanced=True, lever=edge)
    spring = counterbalance(start(at), pull, kind, 1.0, SETTINGS)
    held = holding(
        start(at), pull, weight, kind, spring, bump_share=SETTINGS.free_bump_share, margin=2.0, settings=SETTINGS
    )
    here = float(pull.at(at) + spring.at(at))
    assert held.friction == pytest.approx(2.0 * here) and 1.0 < held.friction < 3.0
    assert 1.0 < (held.friction - here) / edge < (held.friction + here) / edge < 5.0, "half its weight was 26 N"
    opened = float(pull.at(math.pi / 2) + spring.at(math.pi / 2))
    assert held.friction > SETTINGS.least_hold_margin * abs(opened), "and it stays down where it is opened"


@pytest.mark.parametrize(("kilograms", "level", "newtons"), [(4.0, None, 3.92), (4.0, "low", 1.96), (0.5, None, 0.625)])
def test_an_empty_drawer_takes_a_tenth_of_its_weight_or_what_a_hand_feels(
    kilograms: float, level: Level | None, newtons: float
) -> None:
    slides = joint(0.0, 0.4).model_copy(update={"type": "prismatic"})
    shut = Start(Range(slides, 0.0, 0.4, 0.0, 0.4, Source.AUTHORED), 0.0, Source.USER, requested=True, asked=0.0)
    weight = 9.81 * kilograms
    mechanics = JointMechanics(kilograms, kilograms, kilograms, Pull(0.0, 0.0, 0.0), weight, bears_most=False)
    row = part_effort("drawer", "StorageFurniture", "slider")
    bounds = EffortRange(kind=row.kind, least_n=row.least_n, most_n=row.most_n, source=row.source)
    kind = Handling(bounds, anywhere=False, counterbalanced=False)
    held = held_where_left(
        JointProposal(name="hinge", holds=True, damping_level=level), shut, mechanics, kind, True, SETTINGS
    )
    assert held.friction == pytest.approx(newtons, rel=0.01), "a quarter of its weight is 10 N"


def test_the_range_of_forces_follows_the_part_its_object_and_the_words_about_it() -> None:
    features = make_features("1").model_copy(update={"category": "Refrigerator"})
    door = handling(features, joint(), None)
    assert door.range.kind == "refrigerator door" and door.range.most_n == 70.0 and "60335" in door.range.source
    firm = handling(features, joint(), JointProposal(name="hinge", damping_level="high"))
    assert firm.range.most_n == pytest.approx(105.0) and "as asked" in firm.range.source
    light = handling(features, joint(), JointProposal(name="hinge", damping_level="super low"))
    assert light.range.most_n == pytest.approx(52.5)
    assert standing_part(door).most_upward > 1e5 and standing_part(door).anywhere


@pytest.mark.parametrize(("category", "kind"), [("Dispenser", "pump head that turns"), ("TrashCan", "lid")])
def test_a_pump_head_with_a_spout_turns_as_one_though_it_is_not_round(category: str, kind: str) -> None:
    base, turning = make_features("1"), joint().model_copy(update={"type": "continuous"})
    links = tuple(link.model_copy(update={"label": "lid"}) for link in base.links)
    features = base.model_copy(update={"category": category, "links": links})
    assert handling(features, turning, JointProposal(name="hinge", holds=True)).range.kind == kind


def test_every_motion_of_every_part_has_a_range() -> None:
    for part in ("", "door", "drawer", "key", "button", "knob", "seat", "no such part"):
        for motion in ("hinge", "slider", "spin"):
            row = part_effort(part, "no such category", motion)
            assert 0.0 <= row.least_n < row.most_n and row.source
    slide, pivot = (part_effort("blade", "Knife", motion) for motion in ("slider", "hinge"))
    assert slide.least_n == 1.7 and "1.7 to 5.6 N" in slide.source and pivot.least_n == 1.0
    assert mechanism("wheel", "Cart", "spin").coast_s >= 5.0, "its axle rubs: damping took a third of a barrow's effort"
    pedal = part_effort("pedal", "TrashCan", "hinge", 0.1)
    assert pedal.least_n == 15.0 and "15 to 30 N" in pedal.source, "no lighter than its own source has it"
