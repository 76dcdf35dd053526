"""Numbers in prompts: read in any usual unit, and never another number than the one that stands there."""

import pytest

from asset2sim.checks.alignment.user_request import read_request
from asset2sim.guidance.amounts import asked_masses, plain_guidance, unmet_numbers
from asset2sim.guidance.lexicon import tokenize
from tests import prior_objects as known
from tests.factories import guidance_of, make_features


@pytest.mark.parametrize(
    ("words", "left", "named"),
    [
        ("A box 5 km long.", "a box  long.", "5 km long"),
        ("a box that weighs -3 kg", "a box that weighs ", "-3 kg"),
        ("a box that weighs −3 kg", "a box that weighs ", "−3 kg"),
        ("minus 3 kg", "", "minus 3 kg"),
        ("scale to 1e9", "scale to ", "scale to 1e9"),
        ("scale to 10^9", "scale to ", "scale to 10^9"),
        ("scale 0", "scale ", "scale 0"),
        ("a scale of 1:10", "a scale of ", "scale of 1:10"),
        ("1e999 kg", "", "1e999 kg"),
        ("0 kg", "", "0 kg"),
        ("0.1 mm long", " long", "0.1 mm long"),
        ("its door 120% open", "its door  open", "120% open"),
        ("its door opened by -30 degrees", "its door opened by ", "-30 degrees"),
    ],
)
def test_a_number_that_cannot_be_met_is_left_out_and_named(words: str, left: str, named: str) -> None:
    assert plain_guidance(words) == left
    assert [item.words for item in unmet_numbers(words)] == [named]


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        ("3 ft tall", "0.9144 m tall"),
        ("5'8\" tall", "68 inch tall"),
        ("a six-foot ladder", "a 1.8288 m ladder"),
        ("the drawer 'joint_1' open", "the drawer 'joint_1' open"),
        ("number '2' is shut", "number '2' is shut"),
        ("5 ft 8 in. tall", "68 inch tall"),
        ("6' tall", "1.8288 m tall"),
        ("8 in. tall", "0.2032 m tall"),
        ("27 1/2 inches tall", "27.5 inches tall"),
        ("6 ½ inches wide", "6.5 inches wide"),
        ("1/3 open", "33.33333333 % open"),
        ("4 lb 6 oz", "1.984466619 kg"),
        ("31 pounds and", "14.06136347 kg and"),
        ("3 pounds of force", "13.344666 newtons of force"),
        ("two and a half pounds", "1.133980925 kg"),
        ("a quarter of a ton", "250 kg"),
        ("a kilo and a half", "1.5 kilo"),
        ("a pound and a lid", "0.45359237 kg and a lid"),
        ("it weighs a ton", "it weighs a ton"),
        ("2 N·m to turn", "2 newtonmetres to turn"),
        ("1.2Nm", "1.2 newtonmetres"),
        ("12 N cm", "0.12 newtonmetres"),
        ("a key of 60 gf", "a key of 0.588399 newtons"),
        ("20 N to open", "20 newtons to open"),
        ("12 in wide", "0.3048 m wide"),
        ("a 30-cm-wide box", "a 30 cm-wide box"),
        ("1e-1 m long", "0.1 m long"),
        ("1,000 kg", "1000 kg"),
        ("1,5 kg", "1.5 kg"),
        ("scale it to 50%", "scale it to 0.5"),
        ("10-20 cm", "10-20 cm"),
        ("a box - 3 kg", "a box - 3 kg"),
        (
            "a two-drawer desk, 2-drawer, 3 in 1, v1.2.3, at 10:30",
            "a two-drawer desk, 2-drawer, 3 in 1, v1.2.3, at 10:30",
        ),
        ("its lid 2 mm open", "its lid 2 mm open"),
    ],
)
def test_other_numbers_keep_their_meaning(words: str, meant: str) -> None:
    assert plain_guidance(words) == meant
    assert unmet_numbers(words) == ()


def test_masses_are_read_with_their_units() -> None:
    said = ("10 lbs", "1,5 kg", "1,000 kg", "250 g", "-3 kg", "heavy")
    found = [[mass.mass_kg for mass in asked_masses(words)] for words in said]
    assert found == [[4.5359237], [1.5], [1000.0], [0.25], [], []]


@pytest.mark.parametrize(
    "words",
    ["A washing machine with 8 kg capacity, {}.", "A cart, max load 50 kg, {}.", "A {} box that holds up to 3 kg.",
     "A {} jar with 1 kg of tea.", "A shelf that carries 20 kg, {}."],
)  # fmt: skip
def test_what_an_object_holds_is_not_its_mass(words: str) -> None:
    assert asked_masses(words.format("")) == ()
    assert [mass.mass_kg for mass in asked_masses(words.format("2 kg"))] == [2.0]
    (told,) = guidance_of(words.format(""), make_features("1")).unread
    assert "kg" in told.words


def test_no_rule_sees_a_number_that_cannot_be_met() -> None:
    assert "3" not in tokenize("it weighs -3 kg") and "5" not in tokenize("5 km long")


@pytest.mark.parametrize("words", ["A box 5 km long.", "Scale it to 1e9.", "A box, -3 kg."])
def test_the_prior_takes_no_part_of_such_a_number(words: str) -> None:
    bare, said = known.ask(known.BOX, "A box."), known.ask(known.BOX, words)
    assert said["scale"] == bare["scale"] and "scale" not in said["asked"]
    assert not (said.get("mass_change") or {}).get("asked")


def test_alignment_holds_nobody_to_a_number_that_cannot_be_met() -> None:
    features = make_features("a")
    said = [guidance_of(words, features) for words in ("scale to 1e9", "scale it to 0.5")]
    asked = [read_request(features, guidance, 1.0).size.scale for guidance in said]
    assert asked == [None, 0.5]


def test_long_prompts_of_numbers_are_read_in_no_time() -> None:
    assert len(unmet_numbers("-3 kg " * 20_000)) == 20_000
