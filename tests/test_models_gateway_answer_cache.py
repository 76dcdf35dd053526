"""Answers that were had before: when they are taken again, and when they must not be; over real HTTP."""

import io
import json
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from PIL import Image

from asset2sim.models.gateway import answer_cache as cache
from asset2sim.models.gateway.ask import ask
from asset2sim.models.gateway.session import GatewaySession, open_gateway_session
from asset2sim.models.prompts import overlay_request
from schemas.request import LabelledImage, ModelAnswer, Tool, ToolCall, Turn
from schemas.settings import ModelSettings
from tests.factories import make_features
from tests.gateway import REQUEST, settings
from tests.model_server import Reply, serve, spent_so_far

pytestmark = [pytest.mark.system, pytest.mark.usefixtures("no_keys")]

TOOL = Tool(name="render", description="Draws it.", parameters={"type": "object", "properties": {}})


def books(out: Path, wanted: ModelSettings, run_id: str = "run", asset_id: str = "a") -> GatewaySession:
    return open_gateway_session(out, run_id, asset_id, wanted)


def picture(side: int, shade: int = 40) -> bytes:
    out = io.BytesIO()
    Image.new("RGB", (side, side // 2), (shade, 80, 120)).save(out, format="PNG")
    return out.getvalue()


def test_an_answer_is_asked_for_once_and_then_costs_nothing(tmp_path: Path) -> None:
    with serve([Reply('{"scale": 1}')]) as server:
        wanted = settings(server.api_base, run_calls=1, asset_calls=1)
        first = ask(REQUEST, wanted, books(tmp_path, wanted))
        again = ask(REQUEST, wanted, books(tmp_path, wanted, "next run", "another asset"))
    assert first.content == again.content == '{"scale": 1}' and len(server.requests) == 1
    (call,) = again.calls
    assert (call.outcome, call.cached, call.prompt_tokens, call.completion_tokens, call.cost_usd) == (
        "cached", True, 0, 0, 0.0,
    )  # fmt: skip
    assert call.prompt_hash == first.calls[0].prompt_hash and call.latency_s < first.calls[0].latency_s
    assert spent_so_far(books(tmp_path, wanted, "next run").budget).calls == 0


def test_a_spent_budget_does_not_keep_answers_that_were_had(tmp_path: Path) -> None:
    with serve([Reply("{}")]) as server:
        ask(REQUEST, settings(server.api_base), books(tmp_path, settings(server.api_base)))
        poor = settings(server.api_base, run_calls=0)
        answer = ask(REQUEST, poor, books(tmp_path, poor, "next run"))
    assert answer.content == "{}" and not answer.budget_spent


CHANGES: list[dict[str, object]] = [
    {"system": "Answer in YAML."},
    {"text": "What was it?"},
    {"sample": 1},
    {"sample": 2},
    {"images": (LabelledImage(label="front", png=picture(64)),)},
    {"images": (LabelledImage(label="back", png=picture(64)),)},
    {"images": (LabelledImage(label="front", png=picture(64, 41)),)},
    {"answer_schema": {"type": "object"}},
    {"tools": (TOOL,)},
    {"turns": (Turn(role="user", content="Look again."),)},
    {"turns": (Turn(role="assistant", tool_calls=(ToolCall(call_id="1", name="render", arguments="{}"),)),)},
]


def test_whatever_may_change_the_answer_is_asked_anew(tmp_path: Path) -> None:
    requests = [REQUEST, *(REQUEST.model_copy(update=change) for change in CHANGES)]
    with serve([Reply("{}")]) as server:
        base = settings(server.api_base)
        variants = [base, *(settings(server.api_base, **change) for change in (
            {"model": "openai/other"}, {"temperature": 0.5}, {"max_completion_tokens": 99},
        ))]  # fmt: skip
        for _ in range(2):
            for request in requests:
                assert ask(request, base, books(tmp_path, base)).content == "{}"
            for wanted in variants[1:]:
                assert ask(REQUEST, wanted, books(tmp_path, wanted)).content == "{}"
        assert len(server.requests) == len(requests) + len(variants) - 1
    with serve([Reply('{"another": "server"}')]) as server:
        wanted = settings(server.api_base)
        assert ask(REQUEST, wanted, books(tmp_path, wanted)).content == '{"another": "server"}'


def test_patience_and_purpose_are_no_part_of_the_question(tmp_path: Path) -> None:
    with serve([Reply("{}")]) as server:
        for change in ({}, {"timeout_s": 7.0}, {"max_attempts": 1}, {"requests_per_minute": 6000.0}):
            wanted = settings(server.api_base, **change)
            ask(REQUEST, wanted, books(tmp_path, wanted))
    assert len(server.requests) == 1


def test_pictures_count_as_they_are_sent(tmp_path: Path) -> None:
    with serve([Reply("{}")]) as server:
        small = settings(server.api_base, image_side_px=64)
        for side in (256, 256):
            image = LabelledImage(label="front", png=picture(side))
            ask(REQUEST.model_copy(update={"images": (image,)}), small, books(tmp_path, small))
        large = settings(server.api_base, image_side_px=128)
        ask(REQUEST.model_copy(update={"images": (image,)}), large, books(tmp_path, large))
    assert len(server.requests) == 2


def test_failures_and_silence_are_not_kept(tmp_path: Path) -> None:
    bad = [Reply("no", status=400), Reply(""), Reply("no", status=401)]
    with serve([*bad, Reply("{}")]) as server:
        wanted = settings(server.api_base)
        answers = [ask(REQUEST, wanted, books(tmp_path, wanted)) for _ in range(5)]
    assert [answer.content for answer in answers] == [None, None, None, "{}", "{}"] and len(server.requests) == 4


def test_an_answer_that_is_no_json_is_kept_all_the_same(tmp_path: Path) -> None:
    # The next question states what was wrong with it, so it is another one; a second run asks neither again.
    with serve([Reply("Sorry, what?")]) as server:
        wanted = settings(server.api_base)
        for _ in range(2):
            assert ask(REQUEST, wanted, books(tmp_path, wanted)).content == "Sorry, what?"
    assert len(server.requests) == 1


def test_tool_calls_and_missing_pictures_are_kept_with_the_answer(tmp_path: Path) -> None:
    request = REQUEST.model_copy(update={"tools": (TOOL,), "images": (LabelledImage(label="front", png=picture(64)),)})
    replies = [Reply("image input is not supported", status=400), Reply(None, tool_calls=(("render", '{"a": 1}'),))]
    with serve(replies) as server:
        wanted = settings(server.api_base)
        first = ask(request, wanted, books(tmp_path, wanted))
        again = ask(request, wanted, books(tmp_path, wanted))
    assert len(server.requests) == 2 and first.content is None is again.content
    assert first.tool_calls == again.tool_calls == (ToolCall(call_id="call_0", name="render", arguments='{"a": 1}'),)
    assert first.without_images is not None and first.without_images == again.without_images


@pytest.mark.parametrize("damage", ["", '{"content": "{}"', "[]", '{"model": "m"}', "\0\0\0"])
def test_a_damaged_file_is_replaced(damage: str, tmp_path: Path) -> None:
    with serve([Reply("{}")]) as server:
        wanted = settings(server.api_base)
        ask(REQUEST, wanted, books(tmp_path, wanted))
        (file,) = (tmp_path / ".cache" / "answers").iterdir()
        whole = file.read_bytes()
        file.write_text(damage)
        assert ask(REQUEST, wanted, books(tmp_path, wanted)).content == "{}"
    assert len(server.requests) == 2 and file.read_bytes() == whole


def test_the_question_is_not_kept_and_the_folder_holds_nothing_else(tmp_path: Path) -> None:
    with serve([Reply("{}")]) as server:
        wanted = settings(server.api_base)
        ask(REQUEST.model_copy(update={"text": "a private prompt"}), wanted, books(tmp_path, wanted))
    (file,) = (tmp_path / ".cache" / "answers").iterdir()
    kept = json.loads(file.read_text())
    assert len(file.stem) == 64 and "private" not in file.read_text()
    assert (kept["model"], kept["purpose"], kept["content"]) == ("openai/scripted", "synthesis", "{}")


def test_it_can_be_switched_off(tmp_path: Path) -> None:
    with serve([Reply("{}")]) as server:
        wanted = settings(server.api_base, cache=False)
        for _ in range(2):
            assert ask(REQUEST, wanted, books(tmp_path, wanted)).calls[0].outcome == "ok"
    assert len(server.requests) == 2 and not (tmp_path / ".cache" / "answers").exists()


def test_an_offline_prior_is_asked_once_until_its_tables_change(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def outcome() -> str:
        return ask(REQUEST, ModelSettings(), books(tmp_path, ModelSettings())).calls[0].outcome

    assert [outcome(), outcome()] == ["ok", "cached"]
    monkeypatch.setattr(cache, "tables_digest", lambda: "other tables")
    assert [outcome(), outcome()] == ["ok", "cached"]


STORED = (
    '{"model":"openai/gpt-4o","purpose":"synthesis","prompt_hash":"0123456789abcdef","content":"{\\"scale\\": 1}",'
    '"tool_calls":[{"call_id":"call_0","name":"render","arguments":"{}"}],"without_images":null}'
)
"""A file of the answer cache as it was before the rooms of ``models``."""


def test_answers_that_an_earlier_version_stored_are_found(tmp_path: Path) -> None:
    served = ModelSettings(model="openai/gpt-4o", api_base="http://user:pw@127.0.0.1:8000/v1")
    call = ToolCall(call_id="1", name="render", arguments="{}")
    turns = (Turn(role="assistant", tool_calls=(call,)), Turn(role="tool", content="done", call_id="1"))
    shown = (LabelledImage(label="front", png=b"no picture"),)
    full = REQUEST.model_copy(
        update={"images": shown, "answer_schema": {"type": "object"}, "tools": (TOOL,), "sample": 3, "turns": turns}
    )
    told = overlay_request("synthesis", make_features("7"), "a small steel box")
    assert [cache.answer_key(request, served, True) for request in (REQUEST, full, told)] == [
        "979e20603bbc0ee6cf6cb9b305c493974407f4883ab3bf326a1206b6157ad39c",
        "6a11ff2bb69478e179775cb924fb070166643a960fad129a3034c479b669d7ad",
        "fef9721818ea4bff054f857d2fe9ed484242eacdc04201bfcad559ab76eb61f0",
    ]
    folder = tmp_path / cache.FOLDER
    folder.mkdir(parents=True)
    (folder / f"{cache.answer_key(REQUEST, served, True)}.json").write_text(STORED)
    answer = ask(REQUEST, served, books(tmp_path, served))
    assert answer.content == '{"scale": 1}' and [call.outcome for call in answer.calls] == ["cached"]


def test_many_writers_of_one_answer_leave_one_whole_file(tmp_path: Path) -> None:
    with serve([Reply("x" * 200_000)]) as server:
        wanted = settings(server.api_base)

        def one(_: int) -> ModelAnswer:
            return ask(REQUEST, wanted, books(tmp_path, wanted))

        with ThreadPoolExecutor(8) as pool:
            answers = list(pool.map(one, range(16)))
    assert {answer.content for answer in answers} == {"x" * 200_000}
    assert len(list((tmp_path / ".cache" / "answers").iterdir())) == 1


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_takes_nothing_costs_the_cache_only(tmp_path: Path) -> None:
    folder = tmp_path / ".cache" / "answers"
    folder.mkdir(parents=True)
    folder.chmod(0o500)
    with serve([Reply("{}")]) as server:
        wanted = settings(server.api_base)
        assert ask(REQUEST, wanted, books(tmp_path, wanted)).content == "{}"
    folder.chmod(0o700)
