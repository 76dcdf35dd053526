"""What is asked about a state, and what becomes of answers that do not fit, of budgets, and of silence."""

import json
from pathlib import Path

import pytest

from asset2sim.models.answers import RefinementAnswer
from asset2sim.models.prompts import StateProblem
from asset2sim.refinement.ask_model import AskedSoFar, QuestionContext, propose_pose
from asset2sim.refinement.position_bands import reachable_bands
from schemas.overlay import PhysicsOverlay
from schemas.request import ModelAnswer, ModelCall, ModelRequest
from schemas.settings import ModelSettings, Settings
from schemas.vocabulary import Source, Stage
from tests.factories import make_call, make_features, make_joint

STEP = json.dumps({"state_ok": False, "approved": False, "deltas": {"hinge": 0.05}})
WRONG = json.dumps({"state_ok": False, "approved": False, "deltas": {"door": 0.05}})
PRIOR = ModelSettings()
REQUEST = ModelRequest(purpose="refinement", system="", text="one")


def call(outcome: str = "ok") -> ModelCall:
    return make_call(purpose="refinement", outcome=outcome)


def said(content: str | None, **changes: object) -> ModelAnswer:
    outcome = "ok" if content is not None else "provider_error"
    return ModelAnswer.model_validate({"content": content, "calls": (call(outcome),), **changes})


class Script:
    """Answers in order, the last for ever, and what was asked."""

    def __init__(self, *answers: ModelAnswer) -> None:
        self.answers, self.asked = answers, list[ModelRequest]()

    def __call__(self, request: ModelRequest) -> ModelAnswer:
        self.asked.append(request)
        return self.answers[min(len(self.asked), len(self.answers)) - 1]


def outcomes(questions: AskedSoFar) -> list[str]:
    return [item.outcome for item in questions.calls]


def codes(questions: AskedSoFar) -> list[str]:
    assert all(finding.stage is Stage.REFINE for finding in questions.findings)
    return [finding.code for finding in questions.findings]


def test_an_answer_is_taken_and_never_asked_for_again() -> None:
    script = Script(said(STEP))
    questions = AskedSoFar(script, 2)
    first = questions.answer(REQUEST, ("hinge",))
    assert isinstance(first, RefinementAnswer) and first.deltas == {"hinge": 0.05}
    assert questions.answer(REQUEST, ("hinge",)) == first and len(script.asked) == 1
    assert outcomes(questions) == ["ok"] and codes(questions) == [] and questions.left == 1 and questions.wanted


def test_a_refused_answer_is_asked_for_once_more_with_its_errors() -> None:
    script = Script(said(WRONG), said(STEP))
    questions = AskedSoFar(script, 2)
    assert isinstance(questions.answer(REQUEST, ("hinge",)), RefinementAnswer)
    assert outcomes(questions) == ["invalid_answer", "ok"] and codes(questions) == ["invalid_answer"]
    assert "'door' is not a focus joint; focus joints are: hinge" in script.asked[1].text


@pytest.mark.parametrize("most", [0, 1, 2, 5])
def test_no_more_is_asked_than_is_allowed(most: int) -> None:
    script = Script(said("I cannot say."))
    questions = AskedSoFar(script, most)
    assert isinstance(questions.answer(REQUEST, ("hinge",)), str) and questions.wanted
    assert len(script.asked) == min(most, 2) and outcomes(questions) == ["invalid_answer"] * min(most, 2)
    assert ("refinement_unanswered" in codes(questions)) == (most > 0)
    assert codes(questions).count("invalid_answer") == (1 if most > 1 else 0), "said only where it was asked again"


@pytest.mark.parametrize(
    "content",
    ["", "{}", "[]", "null", '{"state_ok": true}', '{"state_ok": 1, "approved": false, "deltas": {}}',
     '{"state_ok": true, "approved": false, "deltas": {"hinge": NaN}}',
     '{"state_ok": true, "approved": false, "deltas": {"hinge": 1e999}}',
     '{"state_ok": true, "approved": false, "deltas": {"hinge": "0.1"}}',
     '{"state_ok": true, "approved": false, "deltas": [0.1]}',
     '{"state_ok": true, "approved": false, "deltas": {}, "scale": 2}', STEP[:-3], "x" * 2_000_000],
)  # fmt: skip
def test_whatever_does_not_fit_is_refused_and_raises_nothing(content: str) -> None:
    questions = AskedSoFar(Script(said(content)), 2)
    assert str(questions.answer(REQUEST, ("hinge",))).startswith("no answer of the model fits: ")
    assert outcomes(questions) == ["invalid_answer"] * 2
    assert codes(questions) == ["invalid_answer", "refinement_unanswered"]


@pytest.mark.parametrize(
    ("answer", "code"),
    [
        (said(None, error="it is down"), "refinement_unanswered"),
        (said(None, error="1.00 USD are spent", budget_spent=True, calls=()), "budget_spent"),
    ],
)
def test_a_provider_that_fails_and_a_spent_budget_end_the_asking(answer: ModelAnswer, code: str) -> None:
    script = Script(answer)
    questions = AskedSoFar(script, 5)
    assert questions.answer(REQUEST, ("hinge",)) == answer.error
    assert questions.answer(REQUEST.model_copy(update={"text": "two"}), ("hinge",)) == "no model call is left"
    assert len(script.asked) == 1 and codes(questions) == [code] and questions.calls == list(answer.calls)
    assert str(answer.error) in questions.findings[0].message


def test_a_model_that_was_sent_no_images_is_told_of_once() -> None:
    questions = AskedSoFar(Script(said(STEP, without_images="it cannot see")), 5)
    for text in ("one", "two"):
        questions.answer(REQUEST.model_copy(update={"text": text}), ("hinge",))
    assert codes(questions) == ["images_not_sent"] and "it cannot see" in questions.findings[0].message


# Poses


def scene(script: Script, source: Source = Source.USER, model: ModelSettings = PRIOR) -> QuestionContext:
    hinge = make_joint("hinge", initial_position=0.5).model_copy(update={"position_source": source})
    overlay = PhysicsOverlay(
        asset_id="7", scale=1.0, scale_source=Source.RULE, contact_friction=0.5, links=(), joints=(hinge,)
    )
    settings = Settings(model=model)
    reach = reachable_bands(overlay, settings.search)
    return QuestionContext(make_features("7"), overlay, settings, Path("nowhere.urdf"), reach, AskedSoFar(script, 2))


def pose_after(step: dict[str, object], source: Source) -> dict[str, float] | None:
    content = json.dumps({"state_ok": False, "approved": False, **step})
    return propose_pose(scene(Script(said(content)), source), StateProblem({"hinge": 0.5}, 0.1), ("hinge",)).pose


@pytest.mark.parametrize(
    ("source", "delta", "position"),
    [(Source.USER, 0.07, 0.57), (Source.USER, 9.0, 0.595), (Source.USER, -1e308, 0.405), (Source.PRIOR, 0.3, 0.595),
     (Source.RULE, 0.3, 0.8), (Source.RULE, 9.0, 1.0), (Source.RULE, -1e308, 0.0)],
)  # fmt: skip
def test_a_step_is_held_to_the_state_that_was_asked_for_and_to_the_limits(
    source: Source, delta: float, position: float
) -> None:
    assert pose_after({"deltas": {"hinge": delta}}, source) == pytest.approx({"hinge": position})


@pytest.mark.parametrize("step", [{"approved": True, "deltas": {"hinge": 0.1}}, {"deltas": {}}, {}])
def test_an_approval_and_no_step_are_no_pose(step: dict[str, object]) -> None:
    assert pose_after(step, Source.USER) is None


def test_nothing_is_drawn_for_a_prior_and_what_cannot_be_drawn_is_asked_without() -> None:
    for model in (PRIOR, ModelSettings(model="openai/x"), ModelSettings(refinement_model="openai/x")):
        script = Script(said(STEP))
        assert propose_pose(scene(script, model=model), StateProblem({"hinge": 0.5}, 0.1), ("hinge",)).pose is not None
        assert script.asked[0].images == ()
