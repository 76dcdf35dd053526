"""The gateway against a real HTTP server on this machine: patience, accounting, and what a failure says."""

import base64
import pickle
import socket
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from email.utils import formatdate
from functools import partial
from time import time

import pytest

import asset2sim.models.prior.answer as tables_answer
from asset2sim.models.gateway.abilities import check_model
from asset2sim.models.gateway.ask import ask, prompt_hash
from asset2sim.models.gateway.provider_errors import BACKOFF_LONGEST_S, retry_delay_s
from schemas.errors import UnknownChoiceError, UsageError
from schemas.request import LabelledImage
from schemas.secret import redact
from schemas.settings import ModelSettings
from tests.gateway import REQUEST, asked, settings
from tests.model_server import Reply, serve
from tests.processes import free_port

pytestmark = pytest.mark.usefixtures("no_keys")
StandIn = Callable[[Callable[[str], str]], None]

PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)


@pytest.mark.system
def test_a_worker_waits_as_long_as_it_tells_the_others_to(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[float] = []
    monkeypatch.setattr(
        "asset2sim.models.gateway.ask.delay_provider_calls", lambda _, __, seconds: told.append(seconds)
    )
    monkeypatch.setattr("asset2sim.models.gateway.ask.pause", lambda _, seconds: told.append(seconds))
    with serve([Reply("slow down", status=429, headers={"Retry-After": "1"}), Reply("{}")]) as server:
        answer = ask(REQUEST, settings(server.api_base))
    assert len(told) == 2 and told[0] == told[1] >= 1.0 and answer.content == "{}"
    assert [(call.attempt, call.outcome) for call in answer.calls] == [(1, "provider_error"), (2, "ok")]


@pytest.mark.system
def test_an_answer_comes_back_with_one_counted_call_and_without_a_key() -> None:
    server, answer = asked([Reply('{"scale": 1}')])
    assert answer.content == '{"scale": 1}' and answer.error is None
    (call,) = answer.calls
    assert (call.purpose, call.model, call.attempt, call.outcome) == ("synthesis", "openai/scripted", 1, "ok")
    assert (call.prompt_tokens, call.completion_tokens, call.cost_usd, call.cached) == (11, 7, 0.0, False)
    assert 0.0 < call.latency_s < 60.0 and call.prompt_hash == prompt_hash(REQUEST)
    sent = server.requests[0]
    assert [message["role"] for message in sent["messages"]] == ["system", "user"]
    assert sent["messages"][1]["content"] == "What is it?"
    assert sent["temperature"] == 0.0 and sent["response_format"] == {"type": "json_object"}
    assert pickle.loads(pickle.dumps(answer)) == answer


@pytest.mark.system
def test_a_known_model_costs_what_its_price_list_says(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", "test-key-0123456789")
    server, answer = asked([Reply("{}", prompt_tokens=1_000_000, completion_tokens=0)], model="openai/gpt-4o")
    assert answer.calls[0].cost_usd == pytest.approx(2.5)  # USD per million tokens
    assert server.authorizations == ["Bearer test-key-0123456789"]


@pytest.mark.system
def test_a_failing_server_is_given_up_after_max_attempts() -> None:
    server, answer = asked([Reply("out of order", status=500, headers={"Retry-After": "0"})], max_attempts=3)
    assert answer.content is None and len(answer.calls) == len(server.requests) == 3
    assert answer.error is not None and "\n" not in answer.error
    for word in ("openai/scripted", "500", "3 attempts", "out of order"):
        assert word in answer.error


@pytest.mark.system
def test_a_hanging_server_is_left_after_the_time_limit() -> None:
    _, answer = asked([Reply(hang=True)], timeout_s=0.3, max_attempts=1)
    assert answer.error is not None and "within 0.3 s" in answer.error and "timeout_s" in answer.error
    assert 0.25 < answer.calls[0].latency_s < 60.0


@pytest.mark.system
def test_a_server_that_is_not_there_is_named() -> None:
    port = free_port()
    answer = ask(REQUEST, settings(f"http://127.0.0.1:{port}/v1", max_attempts=2))
    assert len(answer.calls) == 2
    assert answer.error is not None and "could not be reached" in answer.error and str(port) in answer.error


@pytest.mark.system
@pytest.mark.parametrize(
    ("status", "words"),
    [(400, "refused"), (401, "set OPENAI_API_KEY"), (403, "set OPENAI_API_KEY"), (404, "model's name")],
)
def test_what_asking_again_cannot_mend_is_asked_once(status: int, words: str) -> None:
    server, answer = asked([Reply("no", status=status), Reply("{}")])
    assert answer.content is None and len(answer.calls) == len(server.requests) == 1
    assert answer.error is not None and words in answer.error


@pytest.mark.system
def test_an_exhausted_account_is_not_asked_again() -> None:
    server, answer = asked([Reply("You exceeded your quota: insufficient_quota", status=429), Reply("{}")])
    assert len(server.requests) == 1 and answer.error is not None and "credit" in answer.error


@pytest.mark.system
def test_no_key_reaches_an_error_or_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    key = "sk-proj-verysecret0123456789"
    monkeypatch.setenv("OPENAI_API_KEY", key)
    server, answer = asked([Reply(f"Incorrect API key provided: {key}, or Bearer {key[8:]}", status=401)])
    assert server.authorizations == [f"Bearer {key}"]
    assert "verysecret" not in answer.model_dump_json()
    assert answer.error is not None and "check the key in OPENAI_API_KEY" in answer.error


@pytest.mark.parametrize(
    "text",
    ["sk-ant-api03-secretsecret", "AIzaSysecretsecret", "Authorization: Bearer secretsecret", "https://me:secret@host/v1",
     "?api_key=secretsecret&x=1", "gsk_secretsecret", "AKIAsecretsecret"],
)  # fmt: skip
def test_keys_of_every_shape_are_blotted_out(text: str) -> None:
    assert "secret" not in redact(text) and "***" in redact(text)


@pytest.mark.system
@pytest.mark.parametrize(
    ("content", "reason", "word"), [("", "length", "max_completion_tokens"), (None, "stop", "stop")]
)
def test_silence_is_a_failure_that_names_its_reason(content: str | None, reason: str, word: str) -> None:
    _, answer = asked([Reply(content, finish_reason=reason)])
    assert answer.content is None and answer.error is not None and word in answer.error
    assert answer.calls[0].outcome == "provider_error" and answer.calls[0].prompt_tokens == 11


@pytest.mark.system
def test_output_is_bounded_by_what_the_model_can_give() -> None:
    with serve([Reply("{}")]) as server:
        ask(REQUEST, settings(server.api_base, model="openai/gpt-4"))
        ask(REQUEST, settings(server.api_base, max_completion_tokens=99))
    limits = [sent.get("max_completion_tokens") or sent.get("max_tokens") for sent in server.requests]
    assert limits == [4096, 99]


def _error_with(header: str) -> Exception:
    error = RuntimeError("slow down")
    error.litellm_response_headers = {"retry-after": header}  # type: ignore[attr-defined]
    return error


def test_waits_grow_and_honour_the_provider_within_bounds() -> None:
    plain = RuntimeError("busy")
    assert 0.25 <= retry_delay_s(plain, 1) <= 0.75 and 1.0 <= retry_delay_s(plain, 3) <= 3.0
    assert 7.0 <= retry_delay_s(_error_with("7"), 1) <= 7.25
    assert 10.0 <= retry_delay_s(_error_with(formatdate(time() + 50.0, usegmt=True)), 1) <= 50.25
    assert retry_delay_s(_error_with("86400"), 1) == BACKOFF_LONGEST_S
    for useless in ("soon", "nan"):
        assert retry_delay_s(_error_with(useless), 1) <= 0.75
    assert retry_delay_s(_error_with("-5"), 1) <= 0.25


@pytest.fixture
def from_tables(monkeypatch: pytest.MonkeyPatch) -> StandIn:
    """Puts a stand-in for the tables in place: the provider that LiteLLM calls is the real one."""
    return partial(monkeypatch.setattr, tables_answer, "answer")


def test_the_prior_answers_in_this_process_and_costs_nothing(from_tables: StandIn) -> None:
    from_tables(lambda text: '{"echo": "' + text + '"}')
    request = REQUEST.model_copy(update={"images": (LabelledImage(label="front", png=PNG),)})
    answer = ask(request, ModelSettings())
    assert answer.content == '{"echo": "What is it?"}'
    (call,) = answer.calls
    assert (call.model, call.outcome, call.cost_usd) == ("prior/household", "ok", 0.0)
    assert 6 <= call.prompt_tokens <= 12 and 6 <= call.completion_tokens <= 14


def test_the_prior_may_be_asked_from_many_threads(from_tables: StandIn) -> None:
    main = threading.get_ident()
    seen: set[int] = set()

    def answer(text: str) -> str:
        seen.add(threading.get_ident())
        return text

    from_tables(answer)
    requests = [REQUEST.model_copy(update={"text": f"question {index}"}) for index in range(24)]
    with ThreadPoolExecutor(4) as pool:
        answers = list(pool.map(lambda request: ask(request, ModelSettings()), requests))
    assert [answer.content for answer in answers] == [request.text for request in requests]
    assert seen and main not in seen


def test_a_prior_that_fails_is_reported_and_not_asked_again(from_tables: StandIn) -> None:
    asked: list[str] = []

    def fail(text: str) -> str:
        asked.append(text)
        raise ValueError("no structured information in the prompt")

    from_tables(fail)
    answer = ask(REQUEST, ModelSettings())
    assert len(asked) == len(answer.calls) == 1
    assert answer.error is not None and "no structured information" in answer.error


def test_models_are_checked_before_anything_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    check_model(ModelSettings())
    check_model(settings("http://127.0.0.1:9/v1"))
    with pytest.raises(UnknownChoiceError, match="prior/household"):
        check_model(ModelSettings(model="prior/kitchen"))
    with pytest.raises(UnknownChoiceError, match=r"unknown model 'nobody/x'.*openai/<model>.*prior/household"):
        check_model(ModelSettings(model="nobody/x"))
    with pytest.raises(UsageError, match="ANTHROPIC_API_KEY"):
        check_model(ModelSettings(model="anthropic/claude-sonnet-4-5"))
    with pytest.raises(UsageError, match="OPENAI_API_KEY"):
        check_model(settings("https://models.example.org/v1"))
    with pytest.raises(UsageError, match="http"):
        check_model(settings("models.example.org"))
    monkeypatch.setenv("ANTHROPIC_API_KEY", "test-key-0123456789")
    check_model(ModelSettings(model="anthropic/claude-sonnet-4-5"))


def test_an_unknown_model_that_is_asked_all_the_same_is_a_failure_not_an_exception() -> None:
    answer = ask(REQUEST, ModelSettings(model="nobody/x"))
    assert answer.content is None and answer.error is not None and "nobody/x" in answer.error


def test_a_missing_key_is_named() -> None:
    for model, variable in (("anthropic/claude-sonnet-4-5", "ANTHROPIC"), ("gemini/gemini-2.5-pro", "GEMINI")):
        answer = ask(REQUEST, ModelSettings(model=model))
        assert answer.error is not None and f"{variable}_API_KEY" in answer.error and len(answer.calls) == 1


def test_the_network_is_closed_to_tests(network_attempts: list[str]) -> None:
    with socket.socket() as far, pytest.raises(OSError, match="may not reach"):
        far.connect(("192.0.2.1", 80))
    assert network_attempts == ["192.0.2.1:80"]
    network_attempts.clear()
