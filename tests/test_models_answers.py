"""What models write, and what becomes of it: read generously where that is safe, else refused with every reason."""

import contextlib
import json
import pickle
import time
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asset2sim.models.answers import (
    MAX_VIOLATIONS,
    InvalidFieldsError,
    RefinementAnswer,
    median_answer,
    parse_overlay,
    parse_refinement,
    strict_fit,
)
from asset2sim.models.ask_overlay import model_findings
from asset2sim.models.lenient_json import MAX_CHARACTERS, parse_json
from schemas.errors import InvalidAnswerError
from schemas.overlay import Content, JointProposal, LinkProposal, Overlay
from schemas.support import SupportKind, SupportProposal
from schemas.vocabulary import Severity
from tests.factories import make_features

SHARED_ANSWERS = Path(__file__).resolve().parents[2] / "shared" / "vlm_answers"
FEATURES = make_features("7")  # links base, body, door, drawer; joints fixed, hinge, slider
GOOD = {
    "scale": 0.25,
    "links": [{"name": "body", "density_kg_m3": 900, "hollow_factor": 0.3}, {"name": "door", "mass_kg": 0.2}],
    "joints": [{"name": "hinge", "coast_s": 0.4, "holds": False}],
    "initial_joint_positions": {"hinge": 0.2},
    "asked": ["scale", "hinge"],
    "notes": ["a note with { and // in it"],
}


def with_changes(**changes: object) -> str:
    return json.dumps({**GOOD, **changes})


@pytest.mark.parametrize(
    "text",
    [
        '{"a": {"b": [1, 2.5, "x"]}}',
        '  \n{"a": {"b": [1, 2.5, "x"]}}\n',
        '```json\n{"a": {"b": [1, 2.5, "x"]}}\n```',
        'Sure! Here\'s the "overlay" {as asked}:\n```\n{"a": {"b": [1, 2.5, "x"]}}\n```\nTell me { if you like.',
        'The answer is {"a": {"b": [1, 2.5, "x"]}} and so on.',
        '{"a": {"b": [1, 2.5, "x",],},}',
        '{"a": /* nested { */ {"b": [1, // one "\n 2.5, "x"]}}',
        'As JSON: {"a": {"b": [1, // one "\n 2.5, "x",]}} done',
        "{a: {'b': [1, 2.5, 'x']}}",
        '<think>maybe {"a": 1}?</think>{"a": {"b": [1, 2.5, "x"]}}',
        '{"a": {"b": [1, 2.5, "x"]}}\n\nAgain: {"a": {"b": [1, 2.5, "x"]}}',
    ],
)
def test_json_is_found_in_what_models_wrap_around_it(text: str) -> None:
    assert parse_json(text) == {"a": {"b": [1, 2.5, "x"]}}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "not JSON"),
        ("I cannot do that.", "not JSON"),
        ('{"a": {"b": [1, 2', "not JSON"),
        ('```json\n{"a": {"b": 1}, "c": [', "not JSON"),
        ('{"a": NaN}', "a: nan is not a finite"),
        ('{"a": [1, -Infinity]}', r"a\[1\]: -inf"),
        ('{"a": [{"b": 1e999}]}', r"a\[0\].b: inf"),
        ('{"a": 1, "a": 2}', "twice in one object: a"),
        ("{a: 1, b: {c: 1, c: 2}}", "twice in one object: c"),
        ('{"a": 1} or {"a": 2}', "2 different JSON objects"),
        ("[" * 100_000, "not JSON"),
        ('{"a":' * 100_000, "not JSON"),
        ('{"a":1.5kg}', "not JSON"),
        ("x" * (MAX_CHARACTERS + 1), "the most that is read"),
    ],
)
def test_what_is_not_one_finite_json_value_is_refused(text: str, words: str) -> None:
    with pytest.raises(InvalidAnswerError, match=words) as caught:
        parse_json(text)
    assert len(str(caught.value)) < 500


def test_a_cut_off_object_is_not_taken_for_one_of_its_parts() -> None:
    whole = json.dumps(GOOD)
    for length in range(1, len(whole)):
        with pytest.raises(InvalidAnswerError):
            parse_overlay(whole[:length], FEATURES)


def test_hostile_lengths_are_refused_quickly() -> None:
    start = time.process_time()
    openings = ("{", '{"', '{"a":', "```\n", "<think>", "<think>{a:", "/*", '{/*"', "[{'")
    for text in (opening * (300_000 // len(opening)) for opening in openings):
        with pytest.raises(InvalidAnswerError):
            parse_json(text)
    assert time.process_time() - start < 30.0, "what takes the square of a length would take minutes of each"


@settings(deadline=None)
@given(st.text(max_size=200))
def test_any_text_is_a_value_or_a_refusal(text: str) -> None:
    with contextlib.suppress(InvalidAnswerError):
        value = parse_json(text)
        assert value is None or isinstance(value, (bool, int, float, str, list, dict))


@settings(deadline=None)
@given(st.recursive(st.none() | st.booleans() | st.integers() | st.text(), st.lists, max_leaves=20))
def test_json_values_survive(value: object) -> None:
    assert parse_json(json.dumps({"value": value})) == {"value": value}


def test_a_good_overlay_is_read() -> None:
    overlay = parse_overlay(json.dumps(GOOD), FEATURES)
    assert overlay.scale == 0.25 and overlay.links[1].mass_kg == 0.2 and overlay.joints[0].coast_s == 0.4
    assert overlay.initial_joint_positions == {"hinge": 0.2}
    assert overlay.notes == ("a note with { and // in it",)


def test_degrees_are_left_to_validation() -> None:
    overlay = parse_overlay(with_changes(initial_joint_positions={"hinge": 45.0}), FEATURES)
    assert overlay.initial_joint_positions == {"hinge": 45.0}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"scale": 0}, "scale: .*greater than 0, not 0"),
        ({"scale": "0.25"}, 'scale: .*number, not "0.25"'),
        ({"scale": True}, "scale: .*number, not true"),
        ({"scale": 10**400}, "scale: "),
        ({"links": [{"name": "body", "mass_kg": -1.0}]}, r"links\[0\]\.mass_kg: .*greater than 0, not -1.0"),
        ({"links": [{"name": "body", "hollow_factor": 1.2}]}, r"links\[0\]\.hollow_factor: .*less than or equal to 1"),
        ({"links": [{"name": "body", "weight": 1}]}, r"links\[0\]\.weight: no such field.*mass_kg"),
        ({"links": [{"name": "body", "com": [0, 0]}]}, r"links\[0\]\.com"),
        ({"links": [{"name": "lid"}]}, r"links\[0\]\.name: unknown link 'lid'; links are: base, body, door, drawer"),
        ({"links": [{"name": "body"}, {"name": "body"}]}, "'body' is given 2 times"),
        ({"links": {"body": {}}}, "links: .*(tuple|array)"),
        ({"joints": [{"name": "hinge", "damping": -0.1}]}, r"joints\[0\]\.damping: .*greater than or equal to 0"),
        ({"joints": [{"name": "knee"}]}, r"unknown joint 'knee'; joints are: fixed, hinge, slider"),
        ({"joints": [{"name": "hinge"}, {"name": "hinge"}]}, "joints: joint 'hinge' is given 2 times"),
        (
            {"initial_joint_positions": {"fixed": 0.1}},
            "'fixed' is not a movable joint; movable joints are: hinge, slider",
        ),
        ({"initial_joint_positions": {"hinge": None}}, "initial_joint_positions.hinge"),
        ({"asked": ["mood"]}, r"asked\[0\]: 'mood' is neither 'scale' nor a joint"),
        ({"notes": ["\ud800"]}, "."),
        ({"script": "rm"}, "script: no such field; fields are: asked"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_place(changes: dict[str, object], words: str) -> None:
    with pytest.raises(InvalidAnswerError, match=words):
        parse_overlay(with_changes(**changes), FEATURES)


@pytest.mark.parametrize("text", ["[]", "3", "null", '"scale"', "{}"])
def test_an_answer_of_another_kind_is_refused(text: str) -> None:
    with pytest.raises(InvalidFieldsError):
        parse_overlay(text, FEATURES)


def test_every_violation_is_listed_up_to_a_bound() -> None:
    links = [{"name": f"no_{index}" + "x" * 500} for index in range(200)]
    with pytest.raises(InvalidFieldsError, match="and 181 more") as caught:
        parse_overlay(with_changes(links=links, joints=[{"name": "knee"}]), FEATURES)
    assert len(caught.value.violations) == 201
    assert str(caught.value).count("unknown link") == MAX_VIOLATIONS and len(str(caught.value)) < 6000
    again = pickle.loads(pickle.dumps(caught.value))
    assert again.violations == caught.value.violations and str(again) == str(caught.value)


def test_a_refinement_moves_focus_joints_only() -> None:
    text = 'OK: {"state_ok": true, "approved": false, "deltas": {"hinge": -0.1}}'
    assert parse_refinement(text, ["hinge"]) == RefinementAnswer(state_ok=True, approved=False, deltas={"hinge": -0.1})
    with pytest.raises(InvalidAnswerError, match="'hinge' is not a focus joint; focus joints are: slider"):
        parse_refinement(text, ["slider"])
    with pytest.raises(InvalidAnswerError, match="approved: this field is required"):
        parse_refinement('{"state_ok": true}', ["hinge"])
    with pytest.raises(InvalidAnswerError, match=r"deltas\.hinge"):
        parse_refinement('{"state_ok": true, "approved": false, "deltas": {"hinge": "a bit"}}', ["hinge"])


OLD_ANSWER = """{"scale": 0.094, "contact_material": "steel",
 "links": [{"name": "body", "material": "steel", "density_kg_m3": 7850, "hollow_factor": 0.25}],
 "joints": [{"name": "hinge", "spring_hz": 5, "spring_rest": 0.0, "coast_s": 0.15, "holds": false}],
 "initial_joint_positions": {"hinge": 0.2312}, "asked": ["hinge"],
 "notes": ["Slightly open is 10 % of the 201 degree travel."]}"""


def test_an_answer_to_an_earlier_prompt_still_fits_and_what_is_unclear_is_a_finding() -> None:
    features = make_features("7")
    old = parse_overlay(OLD_ANSWER, features)
    assert old.unclear == () and old.initial_joint_positions == {"hinge": 0.2312}
    assert not {"model_unclear"} & {item.code for item in model_findings(old, features)}
    unsure = json.loads(OLD_ANSWER) | {
        "initial_joint_positions": {},
        "unclear": [{"about": "hinge", "why": "two lids, and the words name one"}],
    }
    (found,) = model_findings(parse_overlay(json.dumps(unsure), features), features)
    assert (found.code, found.joint, found.severity) == ("model_unclear", "hinge", Severity.WARNING)
    assert "two lids" in found.message


@pytest.mark.skipif(not SHARED_ANSWERS.is_dir(), reason="../shared/vlm_answers is absent")
def test_the_answers_of_a_real_model_to_an_earlier_prompt_still_fit() -> None:
    files = sorted(SHARED_ANSWERS.glob("*.json"))
    assert len(files) == 9
    for file in files:
        assert strict_fit(Overlay, parse_json(file.read_text(encoding="utf-8"))).scale > 0.0


def test_one_wild_answer_of_three_moves_nothing() -> None:
    said = [
        Overlay(
            scale=scale,
            initial_joint_positions={"lid": at},
            links=(LinkProposal(name="body", density_kg_m3=density, wall_m=0.002, com=(0.0, at, 0.0)),),
            joints=(JointProposal(name="lid", holds=holds, coast_s=0.5),),
            asked=("lid",),
            uncertainty={"scale": 0.2},
        )
        for scale, at, density, holds in ((0.2, 0.3, 900.0, True), (0.22, 0.4, 1000.0, True), (20.0, 3.0, 9e3, False))
    ]
    found = median_answer(said)
    assert (found.scale, found.initial_joint_positions, found.asked) == (0.22, {"lid": 0.4}, ("lid",))
    assert found.links[0].density_kg_m3 == 1000.0 and found.links[0].com == (0.0, 0.4, 0.0)
    assert found.joints[0].holds is True and found.uncertainty == {"scale": 0.2}
    assert "median of 3 answers" in found.notes


def test_what_few_answers_state_is_left_out() -> None:
    bare, full = Overlay(scale=1.0), Overlay(scale=1.0, initial_joint_positions={"lid": 0.4}, asked=("lid",))
    found = median_answer([full, bare, bare])
    assert found.initial_joint_positions == {} and found.asked == ()
    assert median_answer([full, full, bare]).initial_joint_positions == {"lid": 0.4}


def test_what_hangs_together_comes_of_one_answer() -> None:
    def motor(kilograms: float) -> LinkProposal:
        inertia = (kilograms, 0.0, 0.0, kilograms, 0.0, kilograms)
        return LinkProposal(name="body", inertia=inertia, contents=(Content(name="motor", mass_kg=kilograms),))

    found = median_answer([Overlay(scale=1.0, links=(motor(kilograms),)) for kilograms in (3.0, 1.0, 2.0)])
    assert found.links == (motor(2.0),)
    kinds = (SupportKind.FIXED, SupportKind.HANDHELD, SupportKind.FIXED)
    held = [
        Overlay(scale=1.0, support=SupportProposal(kind=kind, confidence=0.1 * n)) for n, kind in enumerate(kinds, 1)
    ]
    assert median_answer(held).support == SupportProposal(kind=SupportKind.FIXED, confidence=0.1)


def test_a_link_keeps_what_it_weighs_by_though_every_answer_says_it_another_way() -> None:
    ways = (
        {"wall_m": 0.002, "density_kg_m3": 900.0},
        {"hollow_factor": 0.3, "density_kg_m3": 1000.0},
        {"mass_kg": 2.0},
    )
    found = median_answer([Overlay(scale=1.0, links=(LinkProposal(name="body", **way),)) for way in ways])
    (link,) = found.links
    assert link.wall_m == 0.002 and link.density_kg_m3 == 950.0 and link.mass_kg is None


def test_one_answer_is_its_own_median_and_none_has_none() -> None:
    only = Overlay(scale=0.3, notes=("sure",))
    assert median_answer([only]) is only
    with pytest.raises(ValueError, match="no answer"):
        median_answer([])
