"""What is sent: answer formats and what is left of them when a server refuses, pictures, tools and turns; over HTTP."""

import base64
import io
from typing import Any

import pytest
from PIL import Image

from asset2sim.models.gateway.ask import ask
from schemas.model_names import model_for, named_models, settings_for
from schemas.request import LabelledImage, ModelRequest, Tool, ToolCall, Turn
from schemas.settings import ModelSettings
from tests import gateway
from tests.model_server import ModelServer, Reply, serve

pytestmark = [pytest.mark.system, pytest.mark.usefixtures("one_key")]

SCHEMA: dict[str, Any] = {
    "type": "object",
    "properties": {
        "scale": {"type": "number"},
        "initial_joint_positions": {"type": "object", "additionalProperties": {"type": "number"}},
    },
    "required": ["scale"],
    "additionalProperties": False,
}
REQUEST = gateway.REQUEST.model_copy(update={"answer_schema": SCHEMA})
TOOL = Tool(name="render", description="Draws it.", parameters={"type": "object", "properties": {}})


def settings(api_base: str, **changes: object) -> ModelSettings:
    return gateway.settings(api_base, **{"model": "openai/gpt-4o", **changes})


def formats(server: ModelServer) -> list[object]:
    return [sent.get("response_format", {}).get("type") for sent in server.requests]


def picture(width: int, height: int) -> bytes:
    out = io.BytesIO()
    Image.radial_gradient("L").resize((width, height)).convert("RGB").save(out, format="PNG")
    return out.getvalue()


def shown(part: dict[str, Any]) -> tuple[int, int]:
    kind, data = part["image_url"]["url"].split(",")
    assert kind == "data:image/png;base64"
    with Image.open(io.BytesIO(base64.b64decode(data))) as image:
        return image.size


def test_a_model_that_can_be_held_to_a_schema_is_given_it_with_its_free_keys() -> None:
    with serve([Reply("{}")]) as server:
        ask(REQUEST, settings(server.api_base))
    wanted = server.requests[0]["response_format"]
    assert wanted["type"] == "json_schema"
    assert wanted["json_schema"] == {"name": "synthesis", "schema": SCHEMA, "strict": False}


def test_without_a_schema_or_for_a_model_without_the_mode_any_json_is_asked_for() -> None:
    with serve([Reply("{}")]) as server:
        ask(REQUEST.model_copy(update={"answer_schema": None}), settings(server.api_base))
        ask(REQUEST, settings(server.api_base, model="openai/scripted"))
    assert formats(server) == ["json_object", "json_object"]


def test_no_map_with_free_keys_is_closed_on_the_way(monkeypatch: pytest.MonkeyPatch) -> None:
    """LiteLLM gives Claude a schema in which such a map may only be empty: no joint position could be stated."""
    monkeypatch.setenv("ANTHROPIC_API_KEY", "test-key-0123456789")
    closed = {**SCHEMA, "properties": {"scale": {"type": "number"}}}
    with serve([Reply("no", status=400)]) as server:
        wanted = settings(server.api_base, model="anthropic/claude-sonnet-4-5")
        ask(REQUEST, wanted)
        ask(REQUEST.model_copy(update={"answer_schema": closed}), wanted)
    free, held = server.requests
    assert "output_format" not in free and "tools" not in free
    assert held["output_format"]["schema"]["properties"] == {"scale": {"type": "number"}}


@pytest.mark.parametrize("status", [400, 415, 422])
def test_a_server_is_asked_for_less_and_less_and_remembers(status: int) -> None:
    def script(body: dict[str, Any]) -> Reply:
        kind = body.get("response_format", {}).get("type")
        if kind == "json_schema":
            return Reply("response_format.type json_schema is unavailable now", status=status)
        return Reply("Unknown field: response_format", status=status) if kind else Reply("{}")

    with serve(script) as server:
        first = ask(REQUEST, settings(server.api_base, max_attempts=1))
        second = ask(REQUEST, settings(server.api_base, max_attempts=1))
    assert first.content == second.content == "{}"
    assert formats(server) == ["json_schema", "json_object", None, None]
    assert [call.outcome for call in first.calls] == ["provider_error", "provider_error", "ok"]
    assert [call.attempt for call in first.calls] == [1, 2, 3] and len(second.calls) == 1


def test_another_mistake_in_the_request_is_not_asked_again() -> None:
    with serve([Reply("max_tokens is too large", status=400), Reply("{}")]) as server:
        answer = ask(REQUEST, settings(server.api_base))
    assert len(server.requests) == 1 and answer.error is not None and "max_tokens is too large" in answer.error


def test_pictures_are_scaled_down_in_proportion_and_follow_their_labels() -> None:
    images = tuple(LabelledImage(label=name, png=picture(*size)) for name, size in (
        ("front", (2000, 1000)), ("left", (300, 900)), ("small", (40, 30)),
    ))  # fmt: skip
    with serve([Reply("{}")]) as server:
        answer = ask(REQUEST.model_copy(update={"images": images}), settings(server.api_base, image_side_px=256))
    parts = server.requests[0]["messages"][1]["content"]
    assert [part["text"] for part in parts if part["type"] == "text"] == [
        "What is it?", "Image: front", "Image: left", "Image: small",
    ]  # fmt: skip
    assert [shown(part) for part in parts[2::2]] == [(256, 128), (85, 256), (40, 30)]
    assert base64.b64decode(parts[6]["image_url"]["url"].split(",")[1]) == images[2].png
    assert answer.without_images is None


@pytest.mark.parametrize("bad", [b"", b"no picture", picture(900, 900)[:500]])
def test_a_picture_that_cannot_be_read_is_the_providers_to_judge(bad: bytes) -> None:
    request = REQUEST.model_copy(update={"images": (LabelledImage(label="front", png=bad),)})
    with serve([Reply("{}")]) as server:
        assert ask(request, settings(server.api_base, image_side_px=64)).content == "{}"


def with_picture() -> ModelRequest:
    return REQUEST.model_copy(update={"images": (LabelledImage(label="front", png=picture(64, 64)),)})


def without_pictures(sent: dict[str, Any]) -> bool:
    return all(isinstance(message["content"], str) for message in sent["messages"])


def test_a_model_known_to_be_blind_gets_text_alone_and_says_so() -> None:
    with serve([Reply("{}")]) as server:
        answer = ask(with_picture(), settings(server.api_base, model="openai/gpt-3.5-turbo"))
        plain = ask(REQUEST, settings(server.api_base, model="openai/gpt-3.5-turbo"))
    assert all(without_pictures(sent) for sent in server.requests)
    assert answer.without_images is not None and "openai/gpt-3.5-turbo" in answer.without_images
    assert plain.without_images is None


def test_a_server_that_takes_no_pictures_is_asked_with_one_only_once() -> None:
    def script(body: dict[str, Any]) -> Reply:
        return Reply("{}") if without_pictures(body) else Reply("This model does not support image input", status=400)

    with serve(script) as server:
        wanted = settings(server.api_base, model="openai/scripted")
        first, second = (ask(with_picture(), wanted) for _ in range(2))
        plain = ask(REQUEST, wanted)
    assert [len(answer.calls) for answer in (first, second, plain)] == [2, 1, 1]
    for answer in (first, second):
        assert answer.content == "{}" and answer.without_images is not None and "image input" in answer.without_images
    assert plain.without_images is None


def test_one_broken_picture_does_not_blind_a_model_for_the_rest() -> None:
    broken = Reply("Could not process image: file too large", status=400)
    with serve([broken, Reply("{}"), Reply("{}")]) as server:
        wanted = settings(server.api_base, model="openai/scripted")
        first, second = (ask(with_picture(), wanted) for _ in range(2))
    assert first.without_images is not None and second.without_images is None
    assert [without_pictures(sent) for sent in server.requests] == [False, True, False]


CONVERSATION = (
    Turn(
        role="assistant",
        content="Let me look.",
        tool_calls=(
            ToolCall(call_id="a", name="render", arguments='{"view": "front"}'),
            ToolCall(call_id="b", name="render", arguments="not JSON"),
        ),
    ),
    Turn(role="tool", call_id="a", content="done", images=(LabelledImage(label="front", png=picture(900, 300)),)),
    Turn(role="tool", call_id="b", content="arguments are not JSON"),
    Turn(role="assistant", content="It is a box."),
    Turn(role="user", content="Are you sure?"),
)


def test_tools_and_turns_go_out_as_the_protocol_has_them() -> None:
    request = REQUEST.model_copy(update={"tools": (TOOL,), "turns": CONVERSATION})
    with serve([Reply(None, tool_calls=(("render", '{"view": "left"}'), ("render", "{")))]) as server:
        answer = ask(request, settings(server.api_base, image_side_px=90))
    sent = server.requests[0]
    assert sent["tools"] == [
        {"type": "function", "function": {"name": "render", "description": "Draws it.", "parameters": TOOL.parameters}}
    ]
    assert "response_format" not in sent
    roles = [message["role"] for message in sent["messages"]]
    assert roles == ["system", "user", "assistant", "tool", "tool", "user", "assistant", "user"]
    wishes = sent["messages"][2]
    assert wishes["content"] == "Let me look."
    assert [(call["id"], call["type"], call["function"]) for call in wishes["tool_calls"]] == [
        ("a", "function", {"name": "render", "arguments": '{"view": "front"}'}),
        ("b", "function", {"name": "render", "arguments": "not JSON"}),
    ]
    assert [(m["tool_call_id"], m["content"]) for m in sent["messages"][3:5]] == [
        ("a", "done"), ("b", "arguments are not JSON"),
    ]  # fmt: skip
    label, image = sent["messages"][5]["content"]
    assert label["text"] == "Image: front" and shown(image) == (90, 30)
    assert answer.content is None and answer.error is None
    assert [(call.name, call.arguments) for call in answer.tool_calls] == [
        ("render", '{"view": "left"}'), ("render", "{"),
    ]  # fmt: skip
    assert [call.outcome for call in answer.calls] == ["ok"]


def test_tools_that_nobody_offered_are_no_answer() -> None:
    with serve([Reply(None, tool_calls=(("rm", "{}"),))]) as server:
        answer = ask(REQUEST, settings(server.api_base))
    assert answer.content is None and answer.tool_calls == () and answer.calls[0].outcome == "provider_error"
    assert answer.error is not None and "tools that nobody offered (rm)" in answer.error


def test_repeats_are_seeded() -> None:
    with serve([Reply("{}")]) as server:
        for sample in (0, 1, 25):
            ask(REQUEST.model_copy(update={"sample": sample}), settings(server.api_base))
    assert [sent.get("seed") for sent in server.requests] == [None, 1, 25]


def test_models_of_this_process_hear_of_tools_and_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    heard: list[object] = []

    def answer(model: str, messages: object, tools: bool, sample: int) -> tuple[str | None, list[dict[str, Any]]]:
        heard.append((model, tools, sample))
        return "{}", []

    monkeypatch.setattr("asset2sim.models.prior.answer.next_answer", answer)
    ask(REQUEST.model_copy(update={"sample": 3}), ModelSettings(model="prior/noisy@2:7"))
    ask(REQUEST.model_copy(update={"tools": (TOOL,)}), ModelSettings())
    assert heard == [("prior/noisy@2:7", False, 3), ("prior/household", True, 0)]


def test_each_purpose_has_its_model_at_its_address() -> None:
    with serve([Reply("{}")]) as server:
        wanted = settings(
            server.api_base, model="openai/one", refinement_model="openai/two", judge_model="openai/three"
        )
        for purpose in ("synthesis", "refinement", "judge", "agent", "direct"):
            answer = ask(REQUEST.model_copy(update={"purpose": purpose}), wanted)
            assert answer.calls[0].purpose == purpose
    assert [sent["model"] for sent in server.requests] == ["one", "two", "three", "one", "one"]


def test_the_address_goes_with_one_provider() -> None:
    mixed = ModelSettings(model="prior/household", refinement_model="openai/local", judge_model="gemini/gemini-2.5-pro",
                          api_base="http://127.0.0.1:8000/v1")  # fmt: skip
    assert named_models(mixed) == ("prior/household", "openai/local", "gemini/gemini-2.5-pro")
    assert [settings_for(mixed, name).api_base for name in named_models(mixed)] == [None, mixed.api_base, None]
    assert model_for(mixed, "refinement") == "openai/local" and model_for(mixed, "synthesis") == "prior/household"
    same = ModelSettings(model="openai/a", judge_model="openai/b", api_base="http://127.0.0.1:8000/v1")
    assert settings_for(same, "openai/b").api_base == same.api_base


PROSE = ['Sure!\n```json\n{"scale": 2}\n```\nHope this helps.', '{"scale": 2} // that is all']


@pytest.mark.parametrize("text", PROSE)
def test_what_the_model_says_comes_back_as_it_said_it(text: str) -> None:
    with serve([Reply(text)]) as server:
        answer = ask(REQUEST, settings(server.api_base))
    assert answer.content == text
