"""One question, one more where the answer does not fit, and no call lost either way; over real HTTP."""

import functools
import json
import pickle

import pytest

from asset2sim.models.ask_overlay import SynthesisError, ask_overlay
from asset2sim.models.gateway.ask import ask
from asset2sim.models.prompts import SYNTHESIS, overlay_request
from schemas.finding import Finding
from schemas.overlay import Overlay
from schemas.request import ModelCall
from schemas.settings import ModelSettings
from schemas.vocabulary import FailureMode
from tests.factories import make_features
from tests.model_server import ModelServer, Reply, serve

pytestmark = [pytest.mark.system, pytest.mark.usefixtures("no_keys")]

GOOD = '{"scale": 0.25, "links": [{"name": "body", "mass_kg": 0.5}]}'
NEGATIVE = '{"scale": 0.25, "links": [{"name": "body", "mass_kg": -0.5}]}'


def run(server: ModelServer) -> tuple[Overlay, tuple[ModelCall, ...], tuple[Finding, ...]]:
    settings = ModelSettings(model="openai/scripted", api_base=server.api_base, timeout_s=60.0, max_attempts=2)
    asker = functools.partial(ask, settings=settings)
    features = make_features("7")
    return ask_overlay(overlay_request(SYNTHESIS, features, "a small box"), features, asker)


def test_a_good_answer_takes_one_call_and_no_finding() -> None:
    with serve([Reply(f"Here you are:\n```json\n{GOOD}\n```")]) as server:
        overlay, calls, findings = run(server)
    assert overlay.links[0].mass_kg == 0.5 and findings == ()
    assert [call.outcome for call in calls] == ["ok"]


@pytest.mark.parametrize(
    ("bad", "word"),
    [
        (NEGATIVE, "links[0].mass_kg"),
        ('{"scale": NaN}', "finite"),
        (GOOD[:-8], "not JSON"),
        (GOOD.replace("body", "lid"), "unknown link 'lid'"),
    ],
)
def test_a_bad_answer_is_asked_again_with_its_errors(bad: str, word: str) -> None:
    with serve([Reply(bad), Reply(GOOD)]) as server:
        overlay, calls, findings = run(server)
    assert overlay.scale == 0.25
    assert [(call.attempt, call.outcome) for call in calls] == [(1, "invalid_answer"), (1, "ok")]
    assert calls[0].prompt_hash != calls[1].prompt_hash and sum(call.prompt_tokens for call in calls) == 22
    (finding,) = findings
    assert finding.code == "invalid_answer" and word in finding.message
    first, second = (sent["messages"][1]["content"] for sent in server.requests)
    assert second.startswith(first)
    block = second[len(first) :].strip().removeprefix("<validation_errors>").removesuffix("</validation_errors>")
    (error,) = json.loads(block)
    assert word in error


def test_two_bad_answers_end_it_with_both_calls_kept() -> None:
    with serve([Reply(NEGATIVE)]) as server, pytest.raises(SynthesisError) as caught:
        run(server)
    assert len(server.requests) == 2
    assert caught.value.mode is FailureMode.NO_VALID_ESTIMATE and "links[0].mass_kg" in str(caught.value)
    assert [call.outcome for call in caught.value.calls] == ["invalid_answer", "invalid_answer"]
    again = pickle.loads(pickle.dumps(caught.value))
    assert (again.mode, again.code, str(again), again.calls) == (
        caught.value.mode, caught.value.code, str(caught.value), caught.value.calls,
    )  # fmt: skip


def test_the_prior_answers_the_prompt_at_once() -> None:
    asker = functools.partial(ask, settings=ModelSettings())
    features = make_features("7")
    overlay, calls, findings = ask_overlay(
        overlay_request(SYNTHESIS, features, "a small box, hinge half open"), features, asker
    )
    assert overlay.scale > 0.0 and findings == ()
    (call,) = calls
    assert (call.model, call.outcome, call.cost_usd) == ("prior/household", "ok", 0.0)
    assert call.prompt_tokens > 1000 and call.completion_tokens > 20


def test_a_provider_that_fails_is_a_model_error_with_its_calls() -> None:
    replies = [Reply(NEGATIVE), Reply("down", status=503, headers={"Retry-After": "0"})]
    with serve(replies) as server, pytest.raises(SynthesisError, match="503") as caught:
        run(server)
    assert caught.value.mode is FailureMode.MODEL_ERROR
    outcomes = [call.outcome for call in caught.value.calls]
    assert outcomes == ["invalid_answer", "provider_error", "provider_error"]
