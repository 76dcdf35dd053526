"""A doubtful answer is asked about once, with what was measured of it; its model's σ says what is doubtful."""

import json
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from asset2sim.assets.extract import Extraction
from asset2sim.models.ask_overlay import ask_overlay
from asset2sim.models.gateway.ask import ask
from asset2sim.models.gateway.session import open_gateway_session
from asset2sim.models.prompts import SYNTHESIS, overlay_request
from asset2sim.validation.doubts import ObjectQuestion, completed_physics, consequences, where_gravity_takes
from asset2sim.validation.reconsider import reconsidered
from schemas.finding import Finding
from schemas.overlay import JointProposal, Overlay
from schemas.request import ModelAnswer, ModelRequest
from schemas.settings import DoubtSettings, ModelSettings, Settings, ViewSettings
from schemas.vocabulary import Correction, Source
from tests.assets import joint, link, read, robot, shape, written
from tests.factories import guidance_of
from tests.methods_runs import call

WORDS = "A small box with its lid slightly open."
SMALL, RIGHT = 0.07, 0.27
"""Scales at which the box is 7 cm and 27 cm long, as the tables say."""
FOLDER = tempfile.TemporaryDirectory()


@cache
def box() -> Extraction:
    """A box of 1 m whose lid is hinged at its back and opens upwards, from closed at 0 to 2 rad."""
    urdf = robot(
        link("body", shape("1 1 0.6")),
        link("box_lid", shape("1 1 0.1", xyz="-0.5 0 0.05")),
        joint("lid_hinge", "revolute", "body", "box_lid", xyz="0.5 0 0.3", axis="0 1 0", limit="0 2"),
    )
    return read(written(Path(FOLDER.name) / "box", urdf), "Box")


def asked(words: str = WORDS, stated: Sequence[str] = (), model: str = "recorded/x", **changes: Any) -> ObjectQuestion:
    doubt = DoubtSettings.model_validate(changes)
    settings = Settings(model=ModelSettings(model=model), doubt=doubt, views=ViewSettings(width=32, height=32))
    return ObjectQuestion(box(), guidance_of(words, box().features), Source.MODEL, settings, stated=stated)


def said(scale: float, at: float | None = 0.3, *, holds: bool = True, **more: Any) -> Overlay:
    positions = {} if at is None else {"lid_hinge": at}
    joints = (JointProposal(name="lid_hinge", holds=holds),)
    return Overlay(scale=scale, initial_joint_positions=positions, asked=tuple(positions), joints=joints, **more)


def doubted(answer: Overlay, about: ObjectQuestion | None = None) -> list[str]:
    return [doubt.what for doubt in consequences(about or asked(), answer).doubts]


class Model:
    """Says one thing after the other, the last for ever; every answer costs one call."""

    def __init__(self, *answers: Overlay | str | ModelAnswer) -> None:
        self.answers, self.requests = answers, list[ModelRequest]()

    def __call__(self, request: ModelRequest) -> ModelAnswer:
        said = self.answers[min(len(self.requests), len(self.answers) - 1)]
        self.requests.append(request)
        if isinstance(said, ModelAnswer):
            return said
        content = said if isinstance(said, str) else said.model_dump_json(exclude_defaults=True)
        return ModelAnswer(content=content, calls=(call(request),))


def taken(model: Model, about: ObjectQuestion) -> tuple[Overlay, int, tuple[Finding, ...]]:
    request = overlay_request(SYNTHESIS, about.extraction.features, WORDS)
    answer, calls, findings = reconsidered(request, ask_overlay(request, box().features, model), about, model)
    assert len(calls) == len(model.requests)
    return answer, len(calls), findings


def test_what_is_as_expected_is_not_doubted() -> None:
    assert doubted(said(RIGHT)) == []


@pytest.mark.parametrize(
    ("answer", "what", "words"),
    [
        (said(SMALL), "scale", "7 × 7 × 4.9 cm"),
        (said(2.0), "scale", "seems large"),
        (
            said(RIGHT, 1.9),
            "lid_hinge",
            "95% of its travel from closed, 109°, where the user's words seem to ask: slightly",
        ),
        (said(RIGHT, None), "lid_hinge", "gives it no position"),
        (said(RIGHT, holds=False), "lid_hinge", "gravity moves lid_hinge"),
    ],
)
def test_each_measured_mistake_is_told_with_its_consequence(answer: Overlay, what: str, words: str) -> None:
    (doubt,) = consequences(asked(), answer).doubts
    assert doubt.what == what and words in doubt.consequence, doubt.consequence


@pytest.mark.parametrize("scale", [5e-324, 1e308])
def test_a_scale_at_the_end_of_all_numbers_is_doubted_like_any_other(scale: float) -> None:
    assert doubted(said(scale)) == ["scale"]
    assert taken(Model(said(scale), said(RIGHT)), asked(samples=2))[0].scale == RIGHT


def test_a_models_own_sigma_says_what_is_far_off() -> None:
    """A scale 1.3 times the expected is within what goes for an unsure model, and beyond what a sure one says."""
    answer = said(1.3 * RIGHT)
    assert doubted(answer) == []
    assert doubted(answer.model_copy(update={"uncertainty": {"scale": 0.05}})) == ["scale"]
    assert doubted(said(SMALL).model_copy(update={"uncertainty": {"scale": 3.0}})) == []
    sure = {"lid_hinge": 0.01}
    assert doubted(said(RIGHT, 0.6)) == []
    assert doubted(said(RIGHT, 0.6).model_copy(update={"uncertainty": sure})) == ["lid_hinge"]


def test_the_users_own_numbers_are_not_asked_about() -> None:
    assert doubted(said(SMALL, 1.9), asked(stated=("scale", "lid_hinge"))) == []


def test_a_second_answer_is_taken_whatever_it_says() -> None:
    for second in (said(RIGHT), said(0.08, 1.9)):
        model = Model(said(SMALL), second)
        answer, calls, (finding,) = taken(model, asked())
        assert answer == second and calls == 2
        assert finding.code == "asked_again" and "7 × 7 × 4.9 cm" in finding.message
        assert f"scale 0.07 → {second.scale:.4g}" in finding.message
    stubborn = taken(Model(said(SMALL), said(SMALL)), asked())
    assert stubborn[1] == 2 and "stands by its answer" in stubborn[2][0].message


@pytest.mark.system
def test_the_second_question_has_the_answer_the_consequence_and_a_picture() -> None:
    model = Model(said(RIGHT, holds=False), said(RIGHT))
    taken(model, asked(model="openai/x"))
    first, second = model.requests
    assert second.text.startswith(first.text) and second.answer_schema == first.answer_schema
    block = second.text.split("<consequences>")[1].split("</consequences>")[0]
    (told,) = json.loads(block)
    assert "gravity moves" in told and '"scale":0.27' in second.text.split("<your_answer>")[1]
    labels = [image.label for image in second.images]
    assert labels == ["the result of your answer, as it starts", "the result of your answer, where gravity leaves it"]
    assert second.images[0].png != second.images[1].png and second.images[0].png.startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("second", "why"),
    [
        (ModelAnswer(content=None, calls=(), error="no answer is recorded", unrecorded=True), "no answer is recorded"),
        ('{"scale": -1}', "does not fit"),
    ],
)
def test_without_a_second_answer_the_first_stands_and_says_so(second: ModelAnswer | str, why: str) -> None:
    request = overlay_request(SYNTHESIS, box().features, WORDS)
    model = Model(said(SMALL), second)
    answer, calls, findings = reconsidered(request, ask_overlay(request, box().features, model), asked(), model)
    assert answer == said(SMALL)
    (finding,) = findings
    assert finding.code == "second_answer_missing" and why in finding.message and "7 × 7 × 4.9 cm" in finding.message
    assert [item.outcome for item in calls] == (["ok"] if isinstance(second, ModelAnswer) else ["ok", "invalid_answer"])


def test_nothing_is_asked_again_where_that_is_switched_off() -> None:
    assert taken(Model(said(SMALL)), asked(ask_again=False)) == (said(SMALL), 1, ())


def test_degrees_are_converted_before_anything_is_doubted() -> None:
    answer, calls, findings = taken(Model(said(RIGHT, 20.0)), asked())
    assert calls == 1 and answer.initial_joint_positions["lid_hinge"] == pytest.approx(0.3491, abs=1e-4)
    assert [finding.code for finding in findings] == ["position_in_degrees"]
    about = asked()
    raw = about.settings.model_copy(update={"correct": Correction.OFF, "doubt": DoubtSettings(ask_again=False)})
    left = taken(Model(said(RIGHT, 20.0)), ObjectQuestion(box(), guidance_of(WORDS, box().features), Source.MODEL, raw))
    assert left == (said(RIGHT, 20.0), 1, ())


@pytest.mark.parametrize(
    ("answers", "calls"),
    [
        ([said(RIGHT)], 1),  # sure, and as expected
        ([said(RIGHT, uncertainty={"scale": 0.9}), said(0.3), said(0.28)], 3),  # unsure
        ([said(SMALL), said(0.06)], 2),  # stands by it
        ([said(SMALL), said(RIGHT), said(0.3), said(0.28)], 4),  # two answers that differ
    ],
)
def test_samples_are_spent_where_the_model_is_unsure(answers: list[Overlay], calls: int) -> None:
    model = Model(*answers)
    answer, spent, findings = taken(model, asked(samples=3))
    assert spent == calls
    if calls >= 3:
        assert answer.scale == 0.28 and findings[-1].code == "samples_taken"
        assert [request.sample for request in model.requests[-2:]] == [1, 2]
        assert model.requests[-1].text == model.requests[-3].text


def test_a_budget_that_ends_amid_samples_leaves_the_median_of_those_that_came() -> None:
    spent = ModelAnswer(content=None, calls=(), error="the budget is spent", budget_spent=True)
    model = Model(said(RIGHT, uncertainty={"scale": 0.9}), said(0.35), spent)
    request = overlay_request(SYNTHESIS, box().features, WORDS)
    answer, calls, findings = reconsidered(
        request, ask_overlay(request, box().features, model), asked(samples=5), model
    )
    assert answer.scale == pytest.approx(0.31) and len(calls) == 2 and len(model.requests) == 3
    assert [finding.code for finding in findings] == ["samples_missing", "samples_taken"]


def test_a_lid_that_is_slightly_open_of_a_wide_travel_falls_all_the_way() -> None:
    """A tenth of the whole travel is all that it is open."""
    about = asked()
    made = completed_physics(about, said(RIGHT, 0.19, holds=False))
    assert made is not None
    (lid,) = made.joints
    assert where_gravity_takes(lid, about.settings.search.state_tolerance) == pytest.approx(0.0)
    held = completed_physics(about, said(RIGHT, 0.19))
    assert held is not None and where_gravity_takes(held.joints[0], 0.1) is None


@pytest.mark.parametrize("recorded", [1, 2])
def test_a_recording_answers_a_second_time_where_it_has_an_answer(tmp_path: Path, recorded: int) -> None:
    """By a second file, through the gateway; without one the first stands, and the asset does not fail."""
    for name, answer in list(zip(("box.json", "box.synthesis.2.json"), (said(SMALL), said(RIGHT)), strict=True))[
        :recorded
    ]:
        (tmp_path / name).write_text(answer.model_dump_json(exclude_defaults=True))
    model = ModelSettings(model=f"recorded/{tmp_path}")
    session = open_gateway_session(tmp_path / "out", "run", "box", model)
    request = overlay_request(SYNTHESIS, box().features, WORDS)

    def answers(question: ModelRequest) -> ModelAnswer:
        return ask(question, model, session)

    answer, calls, findings = reconsidered(request, ask_overlay(request, box().features, answers), asked(), answers)
    assert answer.scale == (RIGHT if recorded == 2 else SMALL) and len(calls) == recorded
    assert [finding.code for finding in findings] == ["asked_again" if recorded == 2 else "second_answer_missing"]
