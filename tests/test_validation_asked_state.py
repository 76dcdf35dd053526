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


@pytest.mark.parametrize(
    ("positions", "guidance", "lid"),
    [
        *(({"lid": at}, OPEN_LID, {}) for at in (0.05, 0.3, 0.8, 0.9)),
        *(({"lid": at}, "A box with its lid open.", {"upper": 6.28}) for at in (1.92, 3.14, 6.0)),
        ({"lid": 1.1}, "A box with its lid half open.", {}),
        ({"lid": 0.3, "drawer": 0.1}, OPEN_LID, {}),
        ({"lid": 1.3}, OPEN_LID, {"confidence": 0.1}),
        *(({"drawer": 0.4}, words, {}) for words in ("", "A wooden box.", "Surprise me.")),
        # Words for a part of no known name count for the whole object: which part they mean is not clear.
        ({"drawer": 0.1}, "A box with its hatch slightly open.", {}),
    ],
    ids=[*["slightly open"] * 4, *["further open than in use"] * 3, "half open from either end",
         "more states than named", "unsure of the ends", *["unclear words"] * 3, "part of no known name"],
)  # fmt: skip
def test_what_does_not_contradict_the_words_stands(
    positions: dict[str, float], guidance: str, lid: dict[str, float]
) -> None:
    overlay, codes = stated(positions, guidance, **lid)
    assert overlay.initial_joint_positions == positions and not codes


@pytest.mark.parametrize(
    ("positions", "guidance", "lid", "right", "said"),
    [
        ({"lid": 1.3}, OPEN_LID, {}, 0.3, ["state_at_wrong_end"]),
        ({"lid": 1.6}, "A box with its lid closed.", {}, 0.0, ["state_at_wrong_end"]),
        ({"lid": 0.0}, "A box with its lid fully open.", {}, 1.6, ["state_at_wrong_end"]),
        ({"lid": 0.2}, "A box with its lid fully open.", {}, 1.4, ["state_at_wrong_end"]),
        ({"lid": 0.0}, "A box with its lid open.", {}, 1.6, ["state_at_wrong_end"]),
        # Of a lid that turns by 360°, 110° are less than two fifths.
        ({"lid": 0.0}, "A box with its lid open.", {"upper": 6.28}, 6.28, ["state_at_wrong_end"]),
        ({"lid": 0.0}, "A box with its lid closed.", {"closed": 1.6}, 1.6, ["state_at_wrong_end"]),
        ({"drawer": 0.1}, OPEN_LID, {}, 0.32, ["state_of_wrong_part"]),
        ({"drawer": 0.4}, OPEN_LID, {}, 0.32, ["state_of_wrong_part", "state_at_wrong_end"]),
        ({}, "A box with its lid fully open.", {}, 1.6, ["state_missing"]),
    ],
)
def test_a_state_at_the_wrong_end_of_the_wrong_part_or_left_out_is_what_the_words_say(
    positions: dict[str, float], guidance: str, lid: dict[str, float], right: float, said: list[str]
) -> None:
    overlay, codes = stated(positions, guidance, **lid)
    assert overlay.initial_joint_positions == {"lid": pytest.approx(right, rel=1e-3)}
    assert overlay.asked == ("lid",) and codes == said


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
