"""The simulated fallible model: errors of the stated sizes, shared and own parts, and every fault that is stated."""

import json
import math
from statistics import NormalDist, fmean, pstdev
from typing import Any

import pytest

from asset2sim.guidance.object_info import ObjectInfo, read_prompt
from asset2sim.models.lenient_json import parse_json
from asset2sim.models.prior.answer import answer, completion, next_answer
from lab.noise.noise import MALFORMED, malformed, noisy, noisy_overlay, with_wrong_part
from lab.noise.noise_level import NOISY_LABEL, Draws, Noise, NoiseLevel, draws_for, is_noisy, noise_of
from schemas.errors import InvalidAnswerError, UnknownChoiceError
from schemas.model_names import described, is_prior
from schemas.overlay import Overlay
from tests.prior_objects import hinged, prompt, sliding, thing

ONE = Noise()
SIZES = NoiseLevel()
SPREADS = [name for name in NoiseLevel.model_fields if name.endswith(("_log", "_share"))]
CHANCES = [name for name in NoiseLevel.model_fields if name.startswith("p_")]
GUIDANCE = "A box with a slightly open lid. The drawer is half open."


def text_of(index: int, guidance: str = GUIDANCE) -> str:
    """The request for a box of its own size, with a lid and a drawer."""
    size = 0.5 + 0.001 * index
    return prompt(
        thing("Box", hinged("lid", "rotation_lid"), sliding("drawer", "drawer", upper=0.4), size=size), guidance
    )


def clean(index: int) -> dict[str, Any]:
    """``prior/household``'s own answer."""
    found: dict[str, Any] = json.loads(answer(text_of(index)))
    return found


def read(text: str, noise: Noise = ONE, sample: int = 0) -> dict[str, Any]:
    """What a lenient reader has of a noisy answer; {} where nothing can be read."""
    try:
        found = parse_json(noisy(answer(text), text, noise, sample))
    except InvalidAnswerError:
        return {}
    assert isinstance(found, dict)
    return found


def only(**sizes: float) -> NoiseLevel:
    """No error but the stated ones."""
    return NoiseLevel().at(0.0).model_copy(update=sizes)


def wrong(index: int, sizes: NoiseLevel, sample: int = 0) -> dict[str, Any]:
    """An overlay with the stated errors, before it is written."""
    text = text_of(index)
    information, guidance = read_prompt(text)
    draws = draws_for(information, guidance, text, sample, 0)
    return noisy_overlay(clean(index), ObjectInfo.from_json(information), draws, sizes)


def test_the_same_question_is_answered_the_same() -> None:
    text = text_of(1)
    assert noisy(answer(text), text, ONE) == noisy(answer(text), text, ONE)
    assert noisy(answer(text), text, ONE) != noisy(answer(text), text, Noise(seed=1))
    assert noisy(answer(text), text, ONE) != noisy(answer(text), text, ONE, sample=1)


def test_level_0_is_the_offline_prior() -> None:
    text = text_of(1)
    assert noisy(answer(text), text, Noise(level=0.0)) == answer(text)
    assert wrong(1, SIZES.at(0.0)) == clean(1)


def test_levels_scale_spreads_and_saturate_chances() -> None:
    twice = SIZES.at(2.0)
    for name in SPREADS:
        assert getattr(twice, name) == pytest.approx(2.0 * getattr(SIZES, name))
    for name in CHANCES:
        assert getattr(twice, name) == pytest.approx(1.0 - (1.0 - getattr(SIZES, name)) ** 2)
        assert getattr(SIZES.at(1.0), name) == pytest.approx(getattr(SIZES, name))
    assert twice.shared == SIZES.shared
    assert SIZES.at(10.0).p_malformed < 1.0


def test_the_scale_sizes_follow_from_the_paper() -> None:
    """exp(σ²/2)·(2Φ(σ) − 1) of both errors together is Direct VLM's 35.0 %."""
    total = math.hypot(SIZES.scale_log, 0.137)
    assert math.exp(total**2 / 2.0) * (2.0 * NormalDist().cdf(total) - 1.0) == pytest.approx(0.350, abs=0.005)


def test_scale_errors_have_the_stated_spread_over_objects() -> None:
    logs = [math.log(wrong(index, SIZES)["scale"] / clean(index)["scale"]) for index in range(600)]
    assert fmean(logs) == pytest.approx(0.0, abs=4.0 * SIZES.scale_log / math.sqrt(600))
    assert pstdev(logs) == pytest.approx(SIZES.scale_log, rel=0.12)


def test_scale_errors_of_one_object_are_mostly_shared() -> None:
    """Between the answers about one object the spread is √(1 − 0.9) of the whole."""
    logs = [math.log(wrong(3, SIZES, sample)["scale"]) for sample in range(400)]
    assert pstdev(logs) == pytest.approx(SIZES.scale_log * math.sqrt(1.0 - SIZES.shared), rel=0.15)


def test_asking_again_never_redraws_what_is_believed() -> None:
    text = text_of(4)
    again = f'{text}\n\n<validation_errors>\n["scale: required"]\n</validation_errors>'
    information, guidance = read_prompt(text)
    first, second = (draws_for(*read_prompt(said), said, 0, 0) for said in (text, again))
    assert first.belief == second.belief and first.slip != second.slip
    assert draws_for(information, guidance, text, 1, 0).belief == first.belief
    assert draws_for(information, guidance, text, 0, 1).belief != first.belief


def test_beliefs_do_not_depend_on_names() -> None:
    information, guidance = read_prompt(text_of(5))
    bare = json.loads(json.dumps(information))
    bare |= {"asset_id": "", "category": ""}
    for kind in ("links", "joints"):
        bare[kind] = [item | {"name": f"{kind}{index}", "label": ""} for index, item in enumerate(bare[kind])]
    assert draws_for(bare, guidance, "", 0, 0).belief == draws_for(information, guidance, "", 0, 0).belief


@pytest.mark.parametrize("name", [*CHANCES])
def test_every_fault_occurs_about_as_often_as_stated(name: str) -> None:
    chance, trials, found = getattr(SIZES, name), 1500, 0
    for index in range(trials):
        text = text_of(index)
        information, guidance = read_prompt(text)
        draws = draws_for(information, guidance, text, 0, 0)
        fault = {"p_dropped_link": "dropped links", "p_dropped_joint": "dropped joints"}
        shared = SIZES.shared_state if name.startswith("p_wrong") else 0.0
        found += draws.happens(fault.get(name, name[2:].replace("_", " ")), chance, shared)
    assert found / trials == pytest.approx(chance, abs=4.0 * math.sqrt(chance * (1.0 - chance) / trials))


def test_a_wrong_end_mirrors_the_states() -> None:
    was, now = clean(1)["initial_joint_positions"], wrong(1, only(p_wrong_end=1.0))["initial_joint_positions"]
    assert now["lid"] == pytest.approx(1.6 - was["lid"])
    assert now["drawer"] == pytest.approx(0.4 - was["drawer"])


def test_wrong_units_are_degrees_and_millimetres() -> None:
    was = clean(1)["initial_joint_positions"]
    degrees = wrong(1, only(p_degrees=1.0))["initial_joint_positions"]
    assert degrees["lid"] == pytest.approx(math.degrees(was["lid"]))
    assert degrees["drawer"] == was["drawer"]
    mm = wrong(1, only(p_millimetres=1.0))["initial_joint_positions"]
    assert mm["drawer"] == pytest.approx(1000.0 * was["drawer"])


def test_a_wrong_part_moves_the_state_to_another_joint() -> None:
    text = text_of(1, "A box with a slightly open lid.")
    information, guidance = read_prompt(text)
    draws = draws_for(information, guidance, text, 0, 0)
    now = noisy_overlay(json.loads(answer(text)), ObjectInfo.from_json(information), draws, only(p_wrong_part=1.0))
    assert list(now["initial_joint_positions"]) == ["drawer"] == now["asked"]
    assert 0.0 < now["initial_joint_positions"]["drawer"] < 0.11


def test_a_wrong_part_moves_a_spring_where_no_state_is_asked() -> None:
    joints = {joint.name: joint for joint in ObjectInfo.from_json(read_prompt(text_of(1))[0]).joints}
    given = {"scale": 1.0, "joints": [{"name": "lid", "spring_hz": 3.0, "spring_rest": 1.6}]}
    moved = with_wrong_part(given, joints, Draws("a", "b"))
    assert moved["joints"] == [{"name": "lid"}, {"name": "drawer", "spring_hz": 3.0, "spring_rest": 0.4}]


def test_dropped_entries() -> None:
    assert len(wrong(1, only(p_dropped_link=1.0))["links"]) == len(clean(1)["links"]) - 1
    assert len(wrong(1, only(p_dropped_joint=1.0))["joints"]) == len(clean(1)["joints"]) - 1


@pytest.mark.parametrize("how", MALFORMED)
def test_malformed_text(how: str) -> None:
    text = answer(text_of(1))
    spoiled = malformed(text, how, Draws("a", "b"))
    assert spoiled != text
    if how in ("truncated", "nan"):
        with pytest.raises(InvalidAnswerError):
            parse_json(spoiled)
    else:
        assert parse_json(spoiled) == json.loads(text)


def test_every_way_of_being_malformed_occurs() -> None:
    texts = [noisy(answer(text_of(i)), text_of(i), ONE) for i in range(300)]
    assert any(text.startswith("```") for text in texts)
    assert any(text.startswith("Here") for text in texts)
    assert any("//" in text for text in texts)
    assert any("NaN" in text for text in texts)
    unread = sum(not read(text_of(i)) for i in range(300)) / 300
    assert unread == pytest.approx(0.4 * SIZES.p_malformed, abs=0.04)


@pytest.mark.parametrize("level", [0.5, 1.0, 2.0, 4.0, 10.0])
def test_whatever_can_be_read_fits_the_schema(level: float) -> None:
    answers = [found for index in range(40) if (found := read(text_of(index), Noise(level=level)))]
    assert answers, "some of 40 answers can be read at every level"
    for found in answers:
        assert Overlay.model_validate_json(json.dumps(found), strict=True).scale == found["scale"]


def test_stated_sigmas_are_those_of_the_errors() -> None:
    """A model that is honest of its fallibility: its standard deviations are right on average."""
    given = clean(1) | {"sigmas": {"scale": 0.1, "links.body.density_kg_m3": 1.0, "initial_joint_positions.lid": 1.0}}
    information, guidance = read_prompt(text_of(1))
    info, ratios = ObjectInfo.from_json(information), []
    for sample in range(300):
        draws = draws_for(information, guidance, "", sample, 0)
        now = noisy_overlay(given, info, draws, only(**{name: getattr(SIZES, name) for name in SPREADS}))
        ratios.append(now["sigmas"]["scale"] / (SIZES.scale_log * now["scale"]))
        assert now["sigmas"].keys() == {
            "scale",
            "links.body.density_kg_m3",
            *(f"initial_joint_positions.{name}" for name in ("lid", "drawer")),
        }
    assert fmean(map(math.log, ratios)) == pytest.approx(0.0, abs=0.08)
    assert pstdev(map(math.log, ratios)) == pytest.approx(SIZES.sigma_log, rel=0.15)


def test_a_refinement_step_may_go_the_wrong_way() -> None:
    joint = {"name": "j", "type": "revolute", "position": 0.0, "desired": 0.5, "lower": 0.0, "upper": 1.6,
             "closed": 0.0, "open": 1.6}  # fmt: skip
    steps = []
    for index in range(300):
        facts = {"purpose": "refinement", "asset_id": str(index), "phi_m": 0.03, "focus_joints": [joint]}
        text = f"<structured_information>\n{json.dumps(facts)}\n</structured_information>"
        assert json.loads(answer(text))["deltas"]["j"] > 0.0
        steps.append(read(text).get("deltas", {}).get("j", 0.0))
    assert any(value < 0.0 for value in steps)
    assert fmean(value < 0.0 for value in steps) == pytest.approx(SIZES.p_wrong_end, abs=0.06)


def test_names_of_models() -> None:
    assert noise_of("prior/household") is None
    assert noise_of("prior/noisy") == Noise(level=1.0, seed=0)
    assert noise_of("prior/noisy@2") == Noise(level=2.0, seed=0)
    assert noise_of("prior/noisy@0.5:7") == Noise(level=0.5, seed=7)
    assert is_noisy("prior/noisy@0.5:7") and is_prior("prior/noisy@2") and not is_noisy("prior/household")
    assert described("prior/noisy@2") == f"prior/noisy@2 ({NOISY_LABEL})"
    assert described("prior/household") == "prior/household"


@pytest.mark.parametrize("name", ["prior/noisy@", "prior/noisy@-1", "prior/noisy@11", "prior/noisy@1:x", "prior/else"])
def test_invalid_names_say_how_one_is_written(name: str) -> None:
    with pytest.raises(UnknownChoiceError, match=r"prior/noisy\[@LEVEL\[:SEED\]\]"):
        noise_of(name)


def test_a_call_passes_the_sample_on() -> None:
    text = text_of(1)
    said = [{"role": "system", "content": "s"}, {"role": "user", "content": text}]
    found = [completion("prior/noisy", said, False, sample) for sample in (0, 1, 0)]
    texts = [response.choices[0].message.content for response in found]
    assert texts[0] == texts[2] != texts[1]
    assert texts[0] == next_answer("prior/noisy", said, False, 0)[0]
    assert found[0].usage.prompt_tokens > 100 and found[0].usage.completion_tokens > 50


def test_an_agent_states_noisy_values() -> None:
    said = [{"role": "user", "content": text_of(1).replace('"synthesis"', '"agent"', 1)}]
    stated = [next_answer(model, said, True, 0)[1][0]["function"] for model in ("prior/household", "prior/noisy")]
    assert [call["name"] for call in stated] == ["set_parameters"] * 2
    assert stated[0]["arguments"] != stated[1]["arguments"]
