"""A requested state at the wrong end, of the wrong part or in the wrong unit is put right; where words or geometry are
unclear it stands."""

import math
from typing import Any

import pytest

from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.guidance.read import read_guidance
from asset2sim.validation.asked_state import note_out_of_reach, with_asked_state
from asset2sim.validation.sanity import convert_misread_units
from schemas.features import Features
from schemas.finding import Notes
from schemas.overlay import JointProposal, Overlay
from schemas.settings import PhysicsSettings
from tests.builders import joint_features
from tests.factories import make_features
from tests.prior_objects import DRAWERS, MICROWAVE, Json, hinged, sliding, spinning, thing

OPEN_LID = "A box with its lid slightly open."


def stated(positions: dict[str, float], guidance: str = OPEN_LID, **lid: Any) -> tuple[Overlay, list[str]]:
    """The overlay of a box with a lid (0 to 1.6 rad) and a drawer (0 to 0.5 m) after the rule, and its codes."""
    info = ObjectInfo.from_json(thing("Box", hinged("lid", "rotation_lid", **lid), sliding("drawer", "drawer")))
    notes = Notes()
    proposal = Overlay(scale=1.0, initial_joint_positions=positions, asked=tuple(positions))
    return with_asked_state(info, read_guidance(guidance, info), proposal, PhysicsSettings(), notes), [
        f.code for f in notes.findings
    ]


@pytest.mark.parametrize("at", [0.05, 0.3, 0.8, 0.9])
def test_what_does_not_contradict_the_words_stands(at: float) -> None:
    overlay, codes = stated({"lid": at})
    assert overlay.initial_joint_positions == {"lid": at}
    assert not codes


@pytest.mark.parametrize(
    ("guidance", "at", "right"),
    [
        (OPEN_LID, 1.3, 0.3),
        ("A box with its lid closed.", 1.6, 0.0),
        ("A box with its lid fully open.", 0.0, 1.6),
        ("A box with its lid fully open.", 0.2, 1.4),
        ("A box with its lid open.", 0.0, 1.6),
    ],
)
def test_the_wrong_end_is_counted_from_the_other(guidance: str, at: float, right: float) -> None:
    overlay, codes = stated({"lid": at}, guidance)
    assert overlay.initial_joint_positions["lid"] == pytest.approx(right)
    assert codes == ["state_at_wrong_end"]
    assert overlay.asked == ("lid",)


def test_a_range_that_opens_downwards_is_mirrored_too() -> None:
    overlay, _ = stated({"lid": 0.0}, "A box with its lid closed.", closed=1.6)
    assert overlay.initial_joint_positions["lid"] == pytest.approx(1.6)


def test_where_geometry_is_unsure_of_the_ends_nothing_is_changed() -> None:
    overlay, codes = stated({"lid": 1.3}, confidence=0.1)
    assert overlay.initial_joint_positions == {"lid": 1.3}
    assert not codes


@pytest.mark.parametrize("guidance", ["", "A wooden box.", "Surprise me."])
def test_where_words_are_unclear_nothing_is_changed(guidance: str) -> None:
    positions = {"drawer": 0.4}
    overlay, codes = stated(positions, guidance)
    assert overlay.initial_joint_positions == positions
    assert not codes


def test_a_part_that_is_not_known_by_name_moves_no_state() -> None:
    """Words for a part of no known name count for the whole object: which part they mean is not clear."""
    overlay, codes = stated({"drawer": 0.1}, "A box with its hatch slightly open.")
    assert overlay.initial_joint_positions == {"drawer": 0.1}
    assert not codes


@pytest.mark.parametrize(("at", "meant"), [(1.92, 1.92), (3.14, 3.14), (6.0, 6.0), (0.0, 6.28)])
def test_what_is_open_may_be_further_open_than_in_use(at: float, meant: float) -> None:
    # Of a lid that turns by 360°, 110° are less than two fifths, so that 6.0 would be near the other end.
    overlay, _ = stated({"lid": at}, "A box with its lid open.", upper=6.28)
    assert overlay.initial_joint_positions["lid"] == pytest.approx(meant)


def test_half_open_is_the_same_from_either_end() -> None:
    assert stated({"lid": 1.1}, "A box with its lid half open.")[1] == []


def test_a_state_of_the_wrong_part_goes_to_the_part_that_is_named() -> None:
    overlay, codes = stated({"drawer": 0.1})
    assert overlay.initial_joint_positions == {"lid": pytest.approx(0.32)}
    assert overlay.asked == ("lid",)
    assert codes == ["state_of_wrong_part"]


def test_a_state_of_the_wrong_part_from_the_wrong_end() -> None:
    overlay, codes = stated({"drawer": 0.4})
    assert overlay.initial_joint_positions == {"lid": pytest.approx(0.32)}
    assert codes == ["state_of_wrong_part", "state_at_wrong_end"]


def test_a_state_that_is_left_out_is_what_the_words_say() -> None:
    overlay, codes = stated({}, "A box with its lid fully open.")
    assert overlay.initial_joint_positions == {"lid": pytest.approx(1.6, rel=1e-3)}
    assert overlay.asked == ("lid",)
    assert codes == ["state_missing"]


def test_more_states_than_the_words_name_stand() -> None:
    positions = {"lid": 0.3, "drawer": 0.1}
    overlay, codes = stated(positions)
    assert overlay.initial_joint_positions == positions
    assert not codes


def test_up_and_down_are_clear_of_an_upright_slide() -> None:
    info = ObjectInfo.from_json(
        thing("Toaster", sliding("lever", "lever", upper=0.1, axis=(0.0, 0.0, 1.0), confidence=0.0))
    )
    notes = Notes()
    proposal = Overlay(scale=1.0, initial_joint_positions={"lever": 0.0}, asked=("lever",))
    found = with_asked_state(
        info, read_guidance("A toaster with its lever up.", info), proposal, PhysicsSettings(), notes
    )
    assert found.initial_joint_positions["lever"] == pytest.approx(0.1)


def test_what_turns_freely_has_no_ends() -> None:
    info = ObjectInfo.from_json(thing("Microwave", spinning("knob", "knob")))
    proposal = Overlay(scale=1.0, initial_joint_positions={"knob": 3.0}, asked=("knob",))
    guidance = read_guidance("A microwave with its knob closed.", info)
    assert with_asked_state(info, guidance, proposal, PhysicsSettings(), Notes()) == proposal


def united(
    at: float, kind: str = "revolute", lower: float | None = 0.0, upper: float | None = 1.6
) -> tuple[float, list[str]]:
    """A position after the rule on units, and its codes."""
    base = joint_features("j", kind, "a", "b")
    joint = base.model_copy(update={"lower": lower, "upper": upper})
    features: Features = make_features("1").model_copy(update={"joints": (joint,)})
    notes = Notes()
    overlay = Overlay(
        scale=1.0, initial_joint_positions={"j": at}, joints=(JointProposal(name="j", spring_rest=at),), asked=("j",)
    )
    found = convert_misread_units(features, overlay, notes)
    assert found.joints[0].spring_rest == found.initial_joint_positions["j"]
    return found.initial_joint_positions["j"], [finding.code for finding in notes.findings]


@pytest.mark.parametrize("degrees", [5.0, 30.0, 45.0, 90.0])
def test_degrees_are_taken_for_degrees(degrees: float) -> None:
    at, codes = united(degrees)
    assert at == pytest.approx(math.radians(degrees))
    assert codes == ["position_in_degrees"] * 2


@pytest.mark.parametrize("at", [0.0, 0.3, 1.6, 1.7, -0.1, 170.0, -40.0, 1e6])
def test_radians_stand_and_what_makes_no_sense_in_degrees_either(at: float) -> None:
    assert united(at) == (at, [])


def test_millimetres_of_a_slider() -> None:
    at, codes = united(120.0, "prismatic", 0.0, 0.3)
    assert at == pytest.approx(0.12)
    assert codes == ["position_in_millimetres"] * 2
    assert united(0.29, "prismatic", 0.0, 0.3)[1] == []


def test_a_joint_that_turns_freely_has_no_angle_beyond_a_turn() -> None:
    assert united(90.0, "continuous", None, None)[0] == pytest.approx(math.pi / 2.0)
    assert united(5.0, "continuous", None, None) == (5.0, [])


@pytest.mark.parametrize(
    ("what", "words", "said"),
    [
        (MICROWAVE, "A microwave with its door open by 200 degrees.", "'door': the words ask to open it by 3.491 rad"),
        (DRAWERS, "Its top drawer is open by 2 m.", "'d0': the words ask to open it by 2 m"),
        (DRAWERS, "Its top drawer is open by 30 degrees.", "it slides and is measured in m"),
        (MICROWAVE, "A microwave with its door open by 10 cm.", "it turns and is measured in rad"),
        (MICROWAVE, "A microwave with its door open by 90 degrees.", None),
        (DRAWERS, "Its top drawer is open by 10 cm.", None),
        (MICROWAVE, "A microwave with its door halfway open.", None),
    ],
)
def test_an_opening_that_no_part_reaches_is_said(what: Json, words: str, said: str | None) -> None:
    notes, info = Notes(), ObjectInfo.from_json(what)
    note_out_of_reach(info, read_guidance(words, info), 0.5, notes)
    assert [said in item.message for item in notes.findings] == [True] if said else notes.findings == []
