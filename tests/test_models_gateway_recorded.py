"""Recorded models: which file answers which question, what a call then says, and folders that cannot be used."""

import json
from pathlib import Path

import pytest

from asset2sim.models.ask_overlay import SynthesisError, ask_overlay
from asset2sim.models.gateway.abilities import check_model
from asset2sim.models.gateway.ask import ask, prompt_hash
from asset2sim.models.gateway.recorded import answer_digests, answer_names, answer_text
from asset2sim.models.gateway.session import GatewaySession, open_gateway_session
from asset2sim.models.prompts import SYNTHESIS, overlay_request
from asset2sim.runs.doctor import check_model_answers
from schemas.errors import UnknownChoiceError, UsageError
from schemas.model_names import settings_for
from schemas.request import ModelAnswer, ModelRequest, Tool, ToolCall
from schemas.settings import ModelSettings
from schemas.vocabulary import FailureMode
from tests.factories import make_features

SETTINGS = ModelSettings(model="recorded/answers", run_calls=0, run_usd=0.0)
FEATURES = make_features("7")
REQUEST = overlay_request(SYNTHESIS, FEATURES, None)
TOOL = Tool(name="render", description="Draws it.", parameters={})


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the model ``recorded/answers``, in the working folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "answers").mkdir()
    return tmp_path / "answers"


def books(tmp_path: Path, asset_id: str = "7", recordings: Path = Path()) -> GatewaySession:
    return open_gateway_session(tmp_path / "out", "run", asset_id, SETTINGS, recordings=recordings)


def about(purpose: str) -> ModelRequest:
    return ModelRequest(purpose=purpose, system="Answer in JSON.", text="What is it?")


def test_questions_of_a_purpose_are_answered_in_their_order(folder: Path, tmp_path: Path) -> None:
    folder.joinpath("7.json").write_text("one", encoding="utf-8")
    folder.joinpath("7.synthesis.2.json").write_text("two", encoding="utf-8")
    folder.joinpath("7.judge.json").write_text("a judge's", encoding="utf-8")
    folder.joinpath("8.synthesis.1.json").write_text("another's", encoding="utf-8")
    session = books(tmp_path)
    purposes = ("synthesis", "judge", "synthesis")
    answers = [ask(about(purpose), SETTINGS, session) for purpose in purposes]
    assert [answer.content for answer in answers] == ["one", "a judge's", "two"]
    assert [call.answer_file for answer in answers for call in answer.calls] == [
        "7.json", "7.judge.json", "7.synthesis.2.json",
    ]  # fmt: skip
    assert ask(about("synthesis"), SETTINGS, books(tmp_path)).content == "one"
    assert ask(about("synthesis"), SETTINGS, books(tmp_path, "8")).content == "another's"


def test_a_call_says_what_the_recording_says(folder: Path, tmp_path: Path) -> None:
    origin = {
        "prompt_tokens": 900, "completion_tokens": 80, "cost_usd": 0.02, "prompt": "asset2sim synthesis, version 2",
        "prompt_hash": "0" * 16, "without_images": "it sees nothing",
    }  # fmt: skip
    recording = {"model": "openai/gpt-4o", "answers": {"7.json": origin}}
    folder.joinpath("recording.json").write_text(json.dumps(recording), encoding="utf-8")
    folder.joinpath("7.json").write_text("{}", encoding="utf-8")
    folder.joinpath("8.json").write_text("{}", encoding="utf-8")
    answer = ask(REQUEST, SETTINGS, books(tmp_path))
    (call,) = answer.calls
    assert (call.model, call.answered_by, call.outcome, call.cached) == (
        "recorded/answers",
        "openai/gpt-4o",
        "ok",
        False,
    )
    assert (call.prompt_tokens, call.completion_tokens, call.cost_usd) == (900, 80, 0.02)
    assert call.prompt_hash == prompt_hash(REQUEST) and answer.without_images == "it sees nothing"
    assert answer.other_question is not None and "version 2" in answer.other_question
    plain = ask(REQUEST, SETTINGS, books(tmp_path, "8"))
    assert (plain.calls[0].prompt_tokens, plain.calls[0].cost_usd, plain.other_question) == (0, 0.0, None)
    assert plain.calls[0].answered_by == "openai/gpt-4o"


def test_a_recorded_answer_to_another_question_is_a_finding(folder: Path, tmp_path: Path) -> None:
    recording = {"answers": {"7.json": {"prompt_hash": "0" * 16, "prompt": "asset2sim synthesis, version 2"}}}
    folder.joinpath("recording.json").write_text(json.dumps(recording), encoding="utf-8")
    folder.joinpath("7.json").write_text('{"scale": 0.5}', encoding="utf-8")
    session = books(tmp_path)
    overlay, calls, findings = ask_overlay(REQUEST, FEATURES, lambda request: ask(request, SETTINGS, session))
    assert overlay.scale == 0.5 and len(calls) == 1
    assert [finding.code for finding in findings] == ["other_question"] and "version 2" in findings[0].message


def test_the_direct_method_takes_the_answer_to_the_synthesis_and_says_so(folder: Path, tmp_path: Path) -> None:
    folder.joinpath("7.json").write_text('{"scale": 0.5}', encoding="utf-8")
    answer = ask(about("direct"), SETTINGS, books(tmp_path))
    assert answer.content == '{"scale": 0.5}' and answer.other_question is not None
    assert "7.json was given to the question for synthesis" in answer.other_question
    folder.joinpath("7.direct.json").write_text('{"scale": 0.25}', encoding="utf-8")
    own = ask(about("direct"), SETTINGS, books(tmp_path))
    assert own.content == '{"scale": 0.25}' and own.other_question is None
    missing = ask(about("direct"), SETTINGS, books(tmp_path, "8"))
    assert missing.error is not None and "8.direct.json" in missing.error


def test_answers_that_call_tools_come_back_as_they_were(folder: Path, tmp_path: Path) -> None:
    call = ToolCall(call_id="call_1", name="render", arguments='{"a": "ü"}')
    folder.joinpath("7.agent.json").write_text(answer_text("I look.", (call,)), encoding="utf-8")
    folder.joinpath("7.agent.2.json").write_text(answer_text("done"), encoding="utf-8")
    folder.joinpath("7.agent.3.json").write_text('{"tool_calls": [{"name": "render"}]}', encoding="utf-8")
    session, request = books(tmp_path), about("agent").model_copy(update={"tools": (TOOL,)})
    first, second, third = (ask(request, SETTINGS, session) for _ in range(3))
    assert (first.content, first.tool_calls) == ("I look.", (call,))
    assert (second.content, second.tool_calls) == ("done", ())
    assert third.content is None and third.error is not None and "7.agent.3.json: tool_calls.0" in third.error


def test_a_question_without_an_answer_says_where_to_put_one(folder: Path, tmp_path: Path) -> None:
    answer = ask(about("refinement"), SETTINGS, books(tmp_path))
    assert answer.content is None and answer.calls == () and answer.unrecorded and answer.error is not None
    for words in ("model 'recorded/answers'", "question 1 (refinement) about asset 7", "7.refinement.json"):
        assert words in answer.error
    with pytest.raises(SynthesisError, match=r"7\.json") as raised:
        ask_overlay(REQUEST, FEATURES, lambda request: ask(request, SETTINGS, books(tmp_path)))
    assert raised.value.mode is FailureMode.MODEL_ERROR


def test_an_answer_that_does_not_fit_fails_with_what_is_wrong(folder: Path, tmp_path: Path) -> None:
    folder.joinpath("7.json").write_text('{"scale": 0.5, "magic": 1}', encoding="utf-8")
    session = books(tmp_path)

    def asked(request: ModelRequest) -> ModelAnswer:
        return ask(request, SETTINGS, session)

    with pytest.raises(SynthesisError, match=r"magic: no such field.*7\.synthesis\.2\.json") as raised:
        ask_overlay(REQUEST, FEATURES, asked)
    assert raised.value.mode is FailureMode.NO_VALID_ESTIMATE
    assert [call.outcome for call in raised.value.calls] == ["invalid_answer"]
    folder.joinpath("7.synthesis.2.json").write_text('{"scale": 0.25}', encoding="utf-8")
    session = books(tmp_path)
    overlay, calls, findings = ask_overlay(REQUEST, FEATURES, asked)
    assert overlay.scale == 0.25 and [call.outcome for call in calls] == ["invalid_answer", "ok"]
    assert [finding.code for finding in findings] == ["invalid_answer"]


OLD = {
    "scale": 0.051, "contact_material": "ceramic",
    "links": [{"name": "body", "material": "ceramic", "density_kg_m3": 2400, "hollow_factor": 0.8}],
    "joints": [{"name": "hinge", "coast_s": 0.5, "damping_level": "low", "holds": False}],
    "initial_joint_positions": {"hinge": 0.5}, "asked": ["scale", "hinge"], "notes": ["For a baby."],
}  # fmt: skip
"""An answer to version 2 of the prompt, which asked for no support, no walls and no contents."""


def test_an_answer_to_an_older_prompt_is_taken(folder: Path, tmp_path: Path) -> None:
    folder.joinpath("7.json").write_text(json.dumps(OLD), encoding="utf-8")
    session = books(tmp_path)
    overlay, _, findings = ask_overlay(REQUEST, FEATURES, lambda request: ask(request, SETTINGS, session))
    assert (overlay.scale, overlay.support, findings) == (0.051, None, ())


@pytest.mark.parametrize(
    ("files", "words"),
    [
        ({"7.json": "{}", "7.synthesis.json": "{}"}, "7.json and 7.synthesis.json answer the same question"),
        ({"7.json": " \n"}, "7.json is empty"),
        ({"7.json": b"\xff\xfe"}, "7.json cannot be read"),
        ({"7.json": "{}", "recording.json": '{"who": 1}'}, "recording.json: who: Extra inputs"),
    ],
)
def test_files_that_cannot_be_used_are_named(
    files: dict[str, str | bytes], words: str, folder: Path, tmp_path: Path
) -> None:
    for name, data in files.items():
        folder.joinpath(name).write_bytes(data.encode() if isinstance(data, str) else data)
    answer = ask(REQUEST, SETTINGS, books(tmp_path))
    assert answer.content is None and not answer.unrecorded and answer.error is not None and words in answer.error


def test_a_relative_folder_counts_from_where_the_run_began(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder.joinpath("7.json").write_text("{}", encoding="utf-8")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    assert ask(REQUEST, SETTINGS, books(tmp_path, recordings=tmp_path)).content == "{}"
    lost = ask(REQUEST, SETTINGS, books(tmp_path))
    assert lost.error is not None and "not a folder on this machine" in lost.error
    absolute = SETTINGS.model_copy(update={"model": f"recorded/{folder}"})
    assert ask(REQUEST, absolute, books(tmp_path)).content == "{}"


def test_the_digest_is_of_the_assets_own_answers(folder: Path) -> None:
    def digests() -> tuple[dict[str, str], dict[str, str]]:
        return answer_digests(SETTINGS, ("7", "8", "a.b")), answer_digests(ModelSettings(), ("7",))

    folder.joinpath("7.json").write_text("{}", encoding="utf-8")
    folder.joinpath("a.b.json").write_text("{}", encoding="utf-8")
    seen = [digests()[0]]
    assert set(seen[0]) == {"7", "a.b"} and digests()[1] == {}
    changes = {
        "7.json": "{ }", "7.judge.json": "{}", "recording.json": '{"answers": {"7.json": {"cost_usd": 1}}}',
    }  # fmt: skip
    for name, text in changes.items():
        folder.joinpath(name).write_text(text, encoding="utf-8")
        seen.append(digests()[0])
    folder.joinpath("8.json").write_text("{}", encoding="utf-8")
    assert len({found["7"] for found in seen}) == len(seen) and {found["a.b"] for found in seen} == {seen[0]["a.b"]}
    assert digests()[0]["7"] == seen[-1]["7"] and "8" in digests()[0]
    judged = ModelSettings(judge_model="recorded/answers")
    assert "7" in answer_digests(judged, ("7",))


def test_a_folder_that_is_none_is_refused_before_the_run(folder: Path) -> None:
    for model, words in (
        ("recorded/nowhere", "asset2sim record"),
        ("recorded/", "<folder>"),
        ("recorded", "<folder>"),
        ("recorded/answers", "holds no answers"),
    ):
        with pytest.raises(UsageError, match=words):
            check_model(ModelSettings(judge_model=model))
    folder.joinpath("7.json").write_text("{}", encoding="utf-8")
    check_model(SETTINGS)
    assert check_model_answers(SETTINGS) == "1 recorded answers"
    folder.joinpath("recording.json").write_text('{"model": "openai/gpt-4o"}', encoding="utf-8")
    assert check_model_answers(SETTINGS) == "1 recorded answers of openai/gpt-4o"
    folder.joinpath("recording.json").write_text('{"model": 7}', encoding="utf-8")
    with pytest.raises(UsageError, match=r"recording\.json: model"):
        check_model(SETTINGS)


def test_the_address_goes_with_the_model_that_is_asked_at_it() -> None:
    settings = ModelSettings(model="recorded/x", judge_model="openai/y", api_base="http://127.0.0.1:1/v1")
    assert settings_for(settings, "openai/y").api_base == settings.api_base
    assert settings_for(settings, "recorded/x").api_base is None


@pytest.mark.system
def test_the_choices_name_the_form(folder: Path) -> None:
    with pytest.raises(UnknownChoiceError, match="recorded/<folder>"):
        check_model(ModelSettings(model="nobody-knows-this"))


def test_the_first_name_is_the_usual_one() -> None:
    assert answer_names("7", "synthesis") == ("7.json", "7.synthesis.json", "7.synthesis.1.json")
    assert answer_names("7", "ivw", 12) == ("7.ivw.12.json",)
    assert answer_names("recording", "synthesis")[0] == "recording.synthesis.json"
