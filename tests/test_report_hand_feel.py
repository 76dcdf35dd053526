"""What joint terms mean to a hand."""

import math
from typing import get_args

import numpy as np
import pytest

from asset2sim.report.hand_feel import position_in_words, sensations, stopping_time_s
from schemas.mechanism import MechanismName

JOINT = {
    "position_unit": "rad", "effective_inertia": 0.02, "armature": None, "damping": 0.01, "friction": 0.3,
    "stiffness": 0.0, "gravity_load": -0.2, "holds": True, "effort_kind": "lid",
    "effort_least_n": 0.0, "effort_most_n": 16.65,
}  # fmt: skip


def simulated(speed: float, inertia: float, damping: float, friction: float) -> float:
    step, seconds = 1e-5, 0.0
    while speed > 0.0:
        speed -= step * (damping * speed + friction) / inertia
        seconds += step
    return seconds


@pytest.mark.parametrize(("damping", "friction"), [(0.01, 0.3), (0.2, 0.01), (1e-9, 0.05)])
def test_the_time_to_stop_is_that_of_a_simulation(damping: float, friction: float) -> None:
    assert np.isclose(stopping_time_s(1.0, 0.02, damping, friction), simulated(1.0, 0.02, damping, friction), rtol=1e-3)


def test_damping_alone_is_given_the_time_to_a_twentieth_and_nothing_never_stops() -> None:
    assert math.isclose(stopping_time_s(1.0, 0.02, 0.01, 0.0), 6.0)
    assert stopping_time_s(1.0, 0.02, 0.0, 0.0) == math.inf
    assert (
        "coasts on" in dict(sensations(JOINT | {"damping": 0.0, "friction": 0.0, "holds": False}, []))["let go moving"]
    )


def efforts(*values: float) -> list[dict[str, object]]:
    return [
        {"test": "effort", "engine": f"engine {i}", "value": value, "way": "opening"} for i, value in enumerate(values)
    ]


def test_what_opens_it_is_one_number_where_engines_agree_and_a_range_where_not() -> None:
    assert dict(sensations(JOINT, efforts(2.0, 2.1)))["opening takes"] == "2.1 N at its edge; a lid takes up to 16.6 N"
    assert dict(sensations(JOINT, efforts(1.0, 2.0)))["opening takes"].startswith("1 to 2 N at its edge")
    assert "no hand feels" in dict(sensations(JOINT, efforts(1e-5)))["opening takes"]
    assert "opening takes" not in dict(sensations(JOINT, []))


def test_what_it_holds_is_said_by_what_bears_or_moves_it() -> None:
    assert "1.5 times over" in dict(sensations(JOINT, []))["holds"]
    assert "gravity moves it" in dict(sensations(JOINT | {"holds": False, "friction": 0.1}, []))["does not hold"]
    assert "spring" in dict(sensations(JOINT | {"holds": False, "stiffness": 2.0}, []))["does not hold"]


def test_what_lies_at_its_stop_is_not_said_to_be_held_by_friction() -> None:
    lid = JOINT | {"friction": 0.1, "lower": 0.0, "upper": 1.57, "initial_position": 1.57}
    assert "rests at the end" in dict(sensations(lid, []))["holds"]
    assert "0.50 times" in dict(sensations(lid | {"initial_position": 0.8}, []))["holds"]


@pytest.mark.parametrize("kind", get_args(MechanismName))
def test_any_mechanism_that_exerts_something_is_said_in_words(kind: str) -> None:
    said = dict(sensations(JOINT | {"mechanism": kind, "mechanism_effort": 0.5}, []))["mechanism"]
    assert said.endswith("0.500 N·m; its friction is 0.300 N·m")
    assert "clicks" in said or kind != "detent"


def test_positions_are_degrees_and_millimetres() -> None:
    assert (position_in_words(math.pi / 2, False), position_in_words(0.25, True), position_in_words(-2e-8, True)) == (
        "90°",
        "250 mm",
        "0 mm",
    )
    assert position_in_words(None, True) == "–"
    assert (position_in_words(58.023, True), position_in_words(100.0 * math.tau, False)) == ("58.0 m", "100 turns")


def test_a_joint_that_hardly_anything_brakes_runs_to_the_end_of_its_range() -> None:
    slow = {"effective_inertia": 0.1, "damping": 0.001, "friction": 0.001, "lower": 0.0, "upper": 1.5}
    assert dict(sensations(JOINT | slow, []))["let go moving"].endswith("runs through its whole range, 85.9°")
