"""What holds a part where it is left: friction that a hand can move, springs that carry an open door."""

import math

import numpy as np
import pytest

from asset2sim.guidance.tables import part_effort
from asset2sim.physics.mass_matrix import Pull
from asset2sim.validation.handling import SAFE_SHARE, Handling, handling, standing_part
from asset2sim.validation.holding import NO_BALANCE, counterbalance, holding
from asset2sim.validation.limits import Range
from asset2sim.validation.positions import Start
from schemas.features import JointFeatures
from schemas.mechanism import EffortRange
from schemas.overlay import JointProposal
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


def friction(position: float, kind: Handling, pull: Pull, bump: float = 0.0) -> float:
    return holding(start(position), pull, LOAD, kind, NO_BALANCE, bump_share=bump, settings=SETTINGS).friction


def test_a_lid_is_held_where_it_is_asked_to_stand_and_not_for_the_worst_of_its_range() -> None:
    assert friction(1.2, LID, lid_pull(1.2)) == pytest.approx(2.0 * LOAD * math.cos(1.2))
    worst = friction(1.2, SCREEN, lid_pull(1.2))
    assert worst == pytest.approx(2.0 * LOAD * math.cos(math.pi / 8)), "a screen is left anywhere"


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
    held = holding(start(1.0), lid_pull(1.0), LOAD, weak, NO_BALANCE, bump_share=0.0, settings=SETTINGS)
    assert held.cut and held.wanted == pytest.approx(2.0 * here)


def test_springs_carry_most_of_a_door_that_drops_open_and_nothing_of_others() -> None:
    oven = Handling(ANY, anywhere=False, counterbalanced=True)
    found = counterbalance(start(0.0), door_pull(0.0), oven, 1.0, SETTINGS)
    assert found.reference == 0.0
    assert float(found.at(math.pi / 2)) == pytest.approx(-0.9 * LOAD)
    positions = np.linspace(0.0, math.pi / 2, 33)
    rest = door_pull(0.8).at(positions) + found.at(positions)
    assert np.abs(rest).max() < 0.4 * LOAD, "a hand feels a third of it"
    assert counterbalance(start(0.0), lid_pull(0.8), oven, 1.0, SETTINGS) == NO_BALANCE, "gravity shuts it"
    assert counterbalance(start(0.0), door_pull(0.8), LID, 1.0, SETTINGS) == NO_BALANCE
    half = counterbalance(start(math.pi / 4), door_pull(math.pi / 4), oven, 1.0, SETTINGS)
    left = float(door_pull(math.pi / 4).at(math.pi / 4) + half.at(math.pi / 4))
    assert float(half.at(math.pi / 2)) == pytest.approx(-1.1 * LOAD), "friction keeps it down"
    assert left < 0.17 * LOAD, "half open, where it is asked to stand, a hand feels a sixth"
    light = counterbalance(start(0.0), door_pull(0.8), oven, 1e-6, SETTINGS)
    assert light.stiffness == pytest.approx(0.25e-6 * 3600.0), "what the time step bears"


def test_the_range_of_forces_follows_the_part_its_object_and_the_words_about_it() -> None:
    features = make_features("1").model_copy(update={"category": "Refrigerator"})
    door = handling(features, joint(), None)
    assert door.range.kind == "refrigerator door" and door.range.most_n == 70.0 and "60335" in door.range.source
    firm = handling(features, joint(), JointProposal(name="hinge", damping_level="high"))
    assert firm.range.most_n == pytest.approx(105.0) and "as asked" in firm.range.source
    light = handling(features, joint(), JointProposal(name="hinge", damping_level="super low"))
    assert light.range.most_n == pytest.approx(52.5)
    assert standing_part(door).most_upward > 1e5 and standing_part(door).anywhere


def test_every_motion_of_every_part_has_a_range() -> None:
    for part in ("", "door", "drawer", "key", "button", "knob", "seat", "no such part"):
        for motion in ("hinge", "slider", "spin"):
            row = part_effort(part, "no such category", motion)
            assert 0.0 <= row.least_n < row.most_n and row.source
    pedal = part_effort("pedal", "TrashCan", "hinge", 0.1)
    assert pedal.least_n == 15.0 and "15 to 30 N" in pedal.source, "no lighter than its own source has it"
