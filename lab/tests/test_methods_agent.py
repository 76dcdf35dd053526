"""The agent's loop over real HTTP: scripted, faulty and hostile conversations, all bounded; and the offline agent."""

import functools
import json
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from asset2sim.assets.extract import Extraction
from asset2sim.intake.origin import extract
from asset2sim.models.ask_overlay import SynthesisError
from asset2sim.models.gateway.ask import ask
from asset2sim.models.gateway.session import open_gateway_session
from lab.methods.agent.conversation import bounded
from lab.methods.agent.offline import next_turn
from lab.methods.agent.run import run_agent
from lab.methods.agent.specs import MAX_ANSWER_CALLS, MAX_SAME, MAX_TALK_CHARS
from schemas.asset import AssetRef
from schemas.finding import Finding
from schemas.overlay import Overlay
from schemas.request import LabelledImage, ModelAnswer, ModelAsk, ModelCall, ToolCall, Turn
from schemas.settings import MethodSettings, ModelSettings, RunSettings, Settings
from schemas.vocabulary import FailureMode, Method
from tasks.progress import AssetJob
from tests.assets import cabinet, read, sample, written
from tests.factories import guidance_of
from tests.model_server import ModelServer, Reply, serve

pytestmark = [pytest.mark.system, pytest.mark.usefixtures("no_keys")]

GOOD: dict[str, Any] = {
    "scale": 0.3,
    "links": [{"name": "body", "mass_kg": 2.0, "inertia": [0.03, 0, 0, 0.03, 0, 0.03]}],
    "joints": [{"name": "lid_hinge", "damping": 0.01, "friction": 0.001}],
    "initial_joint_positions": [{"joint": "lid_hinge", "position": 0.5}],
}
STEPS = 6


@pytest.fixture(scope="module")
def asset(tmp_path_factory: pytest.TempPathFactory) -> Extraction:
    return read(written(tmp_path_factory.mktemp("agent") / "cabinet", cabinet()), "StorageFurniture")


def wish(*wanted: tuple[str, object], text: str | None = None) -> Reply:
    """An answer that calls tools; arguments that are no string are written as JSON."""
    return Reply(
        content=text,
        finish_reason="tool_calls",
        tool_calls=tuple(
            (name, arguments if isinstance(arguments, str) else json.dumps(arguments)) for name, arguments in wanted
        ),
    )


def settings_for(server: ModelServer) -> Settings:
    model = ModelSettings(
        # This model does not look at its pictures: small ones are made sooner.
        model="openai/scripted", api_base=server.api_base, timeout_s=60, max_attempts=2, cache=False, image_side_px=64,
    )  # fmt: skip
    return Settings(method=Method.AGENT, model=model, methods=MethodSettings(agent_steps=STEPS))


class Done(NamedTuple):
    """The agent's overlay, all its calls, and findings."""

    overlay: Overlay
    calls: tuple[ModelCall, ...]
    findings: tuple[Finding, ...]

    @property
    def steps(self) -> int:
        """The number of the agent's answers, as its finding has it."""
        (ended,) = (finding for finding in self.findings if finding.code == "agent_ended")
        return int(ended.value or 0)


def agent(ref: AssetRef, asset: Extraction, settings: Settings, asker: ModelAsk) -> Done:
    job = AssetJob(ref, Path(), settings, asker, guidance_of(ref.prompt, asset.features))
    return Done(*run_agent(job, asset))


def run(server: ModelServer, asset: Extraction, prompt: str | None = "a small cabinet") -> Done:
    settings = settings_for(server)
    ref = AssetRef(asset_id="cabinet", path=str(asset.folder), prompt=prompt)
    return agent(ref, asset, settings, functools.partial(ask, settings=settings.model))


def results(server: ModelServer) -> list[str]:
    """What the tools returned, as the last request has it."""
    return [message["content"] for message in server.requests[-1]["messages"] if message["role"] == "tool"]


def test_a_conversation_that_goes_well(asset: Extraction) -> None:
    script = [
        wish(("read_asset", {"part": "joints"}), ("render", {"views": ["front", "left"]})),
        wish(("set_parameters", GOOD), ("simulate", {}), ("read_contacts", {})),
        wish(("set_parameters", {"joints": [{"name": "lid_hinge", "damping": 0.02}]}), ("finish", {"notes": "done"})),
    ]
    with serve(script) as server:
        done = run(server, asset)
    assert (done.steps, len(done.calls), len(server.requests)) == (3, 3, 3)
    assert [call.outcome for call in done.calls] == ["ok"] * 3
    # Merged field by field: what the second set_parameters did not name stays.
    (hinge,) = done.overlay.joints
    assert (hinge.damping, hinge.friction) == (0.02, 0.001) and done.overlay.scale == 0.3
    assert done.overlay.initial_joint_positions == {"lid_hinge": 0.5} and done.overlay.notes == ("done",)
    (finding,) = done.findings
    assert finding.code == "agent_ended" and "3 answers and 7 tool calls: it finished" in finding.message

    first, second, _ = server.requests
    assert {tool["function"]["name"] for tool in first["tools"]} >= {"render", "set_parameters", "simulate", "finish"}
    assert "response_format" not in first and "<structured_information>" in str(first["messages"][1]["content"])
    joints, boxes = [message["content"] for message in second["messages"] if message["role"] == "tool"]
    assert '"lid_hinge"' in joints and '"drawer_slide"' in joints
    body = next(row for row in json.loads(boxes)["boxes"] if row["link"] == "body")
    assert body["low_m"] == [-0.5, -0.5, -0.5] and body["high_m"] == [0.5, 0.5, 0.5]
    shown = second["messages"][-1]
    assert shown["role"] == "user" and sum(part["type"] == "image_url" for part in shown["content"]) == 2
    assert "front" in json.dumps(shown) and "left" in json.dumps(shown)
    simulated = json.loads(results(server)[3])
    assert simulated["limits"]["drift_m"] == 1e-3 and simulated["drift_m"] < 1.0
    assert {"passed", "reason", "penetration_m", "pairs", "moving_joints"} <= simulated.keys()
    contacts = json.loads(results(server)[4])
    assert contacts["penetration_m"] == pytest.approx(simulated["penetration_m"], rel=1e-3, abs=1e-6)


def test_a_simulation_sees_the_parameters_that_were_set(asset: Extraction) -> None:
    light = {"scale": 0.3, "initial_joint_positions": [{"joint": "lid_hinge", "position": 0.9}]}
    springy = {"joints": [{"name": "lid_hinge", "damping": 1e-4, "stiffness": 40.0, "spring_rest": 0.0}]}
    script = [
        wish(("set_parameters", GOOD | light), ("simulate", {})),
        wish(("set_parameters", springy), ("simulate", {})),
        wish(("finish", {})),
    ]
    with serve(script) as server:
        run(server, asset)
    calm, wild = (json.loads(text) for text in results(server) if "moving_joints" in text)
    moved = {row["joint"]: row["moved_while_settling"] for row in wild["moving_joints"]}
    assert moved["lid_hinge"] > 0.3 and wild["peak_speed_m_s"] > calm["peak_speed_m_s"]


def test_the_same_calls_for_ever_end_early(asset: Extraction) -> None:
    with serve([wish(("set_parameters", GOOD), ("read_contacts", {}))]) as server:
        done = run(server, asset)
    assert len(server.requests) == len(done.calls) == done.steps == MAX_SAME < STEPS
    assert done.overlay.scale == 0.3 and "same calls" in done.findings[0].message


def test_a_loop_that_varies_ends_with_its_steps(asset: Extraction) -> None:
    script = [wish(("read_asset", {"part": "links", "start": index})) for index in range(STEPS + 5)]
    with serve(script) as server, pytest.raises(SynthesisError, match="no scale in 6 answers: its steps") as caught:
        run(server, asset)
    assert len(server.requests) == len(caught.value.calls) == STEPS
    assert caught.value.mode is FailureMode.NO_VALID_ESTIMATE


@pytest.mark.parametrize(
    ("name", "arguments", "words"),
    [
        ("set_parameters", '{"scale": ', "not JSON"),
        ("set_parameters", "[1, 2]", "one JSON object"),
        ("set_parameters", '{"scale": -1}', "scale: Input should be greater than 0"),
        ("set_parameters", '{"scale": NaN}', "not a finite number"),
        ("set_parameters", '{"size": 1}', "size: no such field; fields are: contact_material, initial"),
        ("set_parameters", {"links": [{"name": "lid", "mass_kg": -2}]}, "links[0].mass_kg"),
        ("set_parameters", {"links": [{"name": "roof"}]}, "unknown link 'roof'; links are: body, lid, drawer, knob"),
        ("set_parameters", {"joints": [{"name": "lid_hinge", "coast_s": 1}]}, "coast_s: no such field; fields are: d"),
        ("set_parameters", {"joints": "all"}, "joints: Input should be a valid array"),
        ("set_parameters", {"initial_joint_positions": [{"joint": "roof", "position": 1}]}, "movable joints are:"),
        ("set_parameters", {"scale": 1e200, "links": [{"name": "lid", "mass_kg": 1.0}]}, "cannot be written"),
        ("set_parameters", '{"contact_material": "' + "x" * 3_000_000 + '"}', "the most is"),
        ("render", {"views": ["below"]}, "views[0]: Input should be 'front', 'back', 'left', 'right' or 'perspective'"),
        ("render", {"views": 7}, "views: Input should be a valid array"),
        ("read_asset", {"part": "secrets"}, "part: Input should be 'summary', 'links', 'joints' or 'files'"),
        ("read_asset", {"part": "files", "start": -1}, "start: Input should be greater than or equal to 0"),
        ("finish", {}, "no scale is set"),
        ("run_shell", {"command": "id"}, "unknown tool 'run_shell'; choose from: finish, read_asset, read_contacts"),
    ],
)
def test_what_a_tool_refuses_goes_back_to_the_model(
    asset: Extraction, name: str, arguments: object, words: str
) -> None:
    with serve([wish((name, arguments)), wish(("set_parameters", GOOD), ("finish", {}))]) as server:
        done = run(server, asset)
    assert words in json.loads(results(server)[0])["error"]
    assert [call.outcome for call in done.calls] == ["invalid_answer", "ok"]
    assert done.overlay.scale == 0.3 and {finding.code for finding in done.findings} == {"agent_ended", "agent_refused"}
    sent = server.requests[1]["messages"][2]["tool_calls"][0]
    assert isinstance(json.loads(sent["function"]["arguments"]), dict) and len(sent["function"]["arguments"]) < 1000


def test_a_hundred_calls_in_one_answer(asset: Extraction) -> None:
    many = [("set_parameters", {"scale": 0.1 + index / 1000}) for index in range(100)]
    with serve([wish(*many), wish(("finish", {}))]) as server:
        done = run(server, asset)
    assert len(results(server)) == MAX_ANSWER_CALLS and done.overlay.scale == pytest.approx(0.107)
    assert "92 of 100 calls were not run" in str(server.requests[1]["messages"][-1]["content"])


def test_prose_is_told_once_to_use_tools(asset: Extraction) -> None:
    with serve([Reply("Let me think about this cabinet."), wish(("set_parameters", GOOD), ("finish", {}))]) as server:
        done = run(server, asset)
    assert (done.steps, [call.outcome for call in done.calls]) == (2, ["invalid_answer", "ok"])
    assert "calling one of the tools" in str(server.requests[1]["messages"][-1]["content"])


def test_nothing_but_prose_ends_after_two_answers(asset: Extraction) -> None:
    with serve([Reply("I am a poet.")]) as server, pytest.raises(SynthesisError, match="went on talking") as caught:
        run(server, asset)
    assert len(server.requests) == len(caught.value.calls) == 2
    assert caught.value.mode is FailureMode.NO_VALID_ESTIMATE


def test_prose_after_a_scale_leaves_what_was_set(asset: Extraction) -> None:
    with serve([wish(("set_parameters", GOOD)), Reply("All is set, goodbye.")]) as server:
        done = run(server, asset)
    assert done.steps == 3 and done.overlay.scale == 0.3


def test_an_overlay_in_text_counts(asset: Extraction) -> None:
    with serve([Reply('```json\n{"scale": 0.4, "joints": [{"name": "lid_hinge", "damping": 0.1}]}\n```')]) as server:
        done = run(server, asset)
    assert len(server.requests) == done.steps == 1
    assert done.overlay.scale == 0.4 and "overlay in text" in done.findings[0].message


def test_a_provider_that_fails(asset: Extraction) -> None:
    with serve([Reply("no such model", status=404)]) as server, pytest.raises(SynthesisError) as caught:
        run(server, asset)
    assert caught.value.mode is FailureMode.MODEL_ERROR and len(server.requests) == 1
    with serve([wish(("set_parameters", GOOD)), Reply("not any more", status=400)]) as server:
        done = run(server, asset)
    assert done.overlay.scale == 0.3 and "gave no answer" in done.findings[0].message and len(done.calls) == 2


def test_a_budget_that_is_spent(asset: Extraction) -> None:
    spent = ModelAnswer(content=None, calls=(), error="no calls are left", budget_spent=True)
    ref = AssetRef(asset_id="cabinet", path=str(asset.folder))
    with pytest.raises(SynthesisError, match="no calls are left") as caught:
        agent(ref, asset, Settings(), lambda request: spent)
    assert caught.value.mode is FailureMode.BUDGET


def test_tools_have_a_time_limit(asset: Extraction) -> None:
    with serve([wish(("set_parameters", GOOD), ("simulate", {})), wish(("finish", {}))]) as server:
        settings = settings_for(server)
        settings = settings.model_copy(update={"run": RunSettings(asset_time_limit_s=1.0)})
        ref = AssetRef(asset_id="cabinet", path=str(asset.folder))
        done = agent(ref, asset, settings, functools.partial(ask, settings=settings.model))
    assert "time for tools is spent" in results(server)[1] and done.overlay.scale == 0.3


def test_a_model_without_vision_gets_boxes_in_words(asset: Extraction) -> None:
    refusal = Reply("this model does not support image input", status=400)
    script = [refusal, wish(("render", {})), wish(("set_parameters", GOOD), ("finish", {}))]
    with serve(script) as server:
        done = run(server, asset)
    assert "does not support image input" in json.loads(results(server)[0])["images"]
    assert len(json.loads(results(server)[0])["boxes"]) == 4
    assert ["image_url" in json.dumps(sent) for sent in server.requests] == [True, False, False]
    assert {finding.code for finding in done.findings} == {"agent_ended", "images_not_sent"}


def test_the_same_conversation_again_costs_no_call(asset: Extraction, tmp_path: Path) -> None:
    script = [wish(("render", {}), ("read_asset", {"part": "files"})), wish(("set_parameters", GOOD), ("simulate", {})),
              wish(("finish", {}))]  # fmt: skip
    with serve(script) as server:
        settings = settings_for(server)
        model = settings.model.model_copy(update={"cache": True})
        ref = AssetRef(asset_id="cabinet", path=str(asset.folder))
        found = [
            agent(
                ref,
                asset,
                settings,
                functools.partial(ask, settings=model, session=open_gateway_session(tmp_path, name, "a", model)),
            )
            for name in ("first", "second")
        ]
    assert len(server.requests) == 3 and str(asset.folder) not in json.dumps(server.requests)
    assert [call.outcome for call in found[1].calls] == ["cached"] * 3
    assert found[0].overlay == found[1].overlay


def test_a_conversation_stays_short() -> None:
    image = LabelledImage(label="front", png=b"png")
    turns = []
    for index in range(40):
        call = ToolCall(call_id=f"c{index}", name="read_asset", arguments=json.dumps({"part": "x" * 5000}))
        turns += [
            Turn(role="assistant", tool_calls=(call,)),
            Turn(role="tool", content="y" * 15_000, call_id=call.call_id),
            Turn(role="user", content="look", images=(image,)),
        ]
    kept = bounded(turns)
    assert [turn.role for turn in kept] == [turn.role for turn in turns]
    assert [turn.call_id for turn in kept] == [turn.call_id for turn in turns]
    length = sum(len(turn.content) + sum(len(call.arguments) for call in turn.tool_calls) for turn in kept)
    assert length < MAX_TALK_CHARS + 40 * 400
    assert sum(len(turn.images) for turn in kept) == 1 and kept[-1].images == (image,)
    assert kept[-2] == turns[-2] and "left out" in kept[1].content


def test_the_offline_agent_refines_a_sample() -> None:
    ref = sample("laptop_silver")
    settings = Settings(method=Method.AGENT)
    done = agent(ref, extract(ref), settings, functools.partial(ask, settings=settings.model))
    assert 2 <= done.steps == len(done.calls) <= settings.methods.agent_steps
    assert all(call.model == "prior/household" and call.outcome == "ok" for call in done.calls)
    assert 0.1 < done.overlay.scale < 0.5 and done.overlay.initial_joint_positions
    assert "it finished" in done.findings[0].message


Called = tuple[str, dict[str, Any], dict[str, Any]]


def conversation(*results: Called) -> list[dict[str, Any]]:
    """A conversation about a door in which these tools were called."""
    door = {"name": "hinge", "type": "revolute", "parent": "body", "child": "door", "lower": 0, "upper": 1,
            "closed": 0, "open": 1}  # fmt: skip
    information = {"purpose": "agent", "category": "Microwave", "joints": [door]}
    messages: list[dict[str, Any]] = [
        {"role": "user", "content": f"<structured_information>\n{json.dumps(information)}\n</structured_information>"}
    ]
    for index, (name, arguments, result) in enumerate(results):
        function = {"name": name, "arguments": json.dumps(arguments)}
        messages += [
            {"role": "assistant", "tool_calls": [{"id": str(index), "type": "function", "function": function}]},
            {"role": "tool", "tool_call_id": str(index), "content": json.dumps(result)},
        ]
    return messages


def wanted(messages: list[dict[str, Any]], proposal: str = '{"scale": 2}') -> list[tuple[str, str]]:
    _, calls = next_turn(messages, lambda text: proposal)
    return [(call["function"]["name"], call["function"]["arguments"]) for call in calls]


def test_the_offline_agent_corrects_what_it_sees() -> None:
    assert wanted(conversation()) == [("set_parameters", '{"scale": 2}'), ("simulate", "{}")]
    estimate: Called = ("set_parameters", {"scale": 2}, {"scale": 2})
    moving = {"joint": "hinge", "damping": 0.1, "friction": 0.0}
    swings = {"passed": False, "failed": "oscillation", "moving_joints": [moving]}
    (_, changes), (name, _) = wanted(conversation(estimate, ("simulate", {}, swings)))
    assert json.loads(changes) == {"joints": [{"name": "hinge", "damping": pytest.approx(0.3)}]} and name == "simulate"
    overlaps = {"passed": False, "failed": "penetration", "pairs": [{"link_a": "body", "link_b": "door"}]}
    (_, changes), _ = wanted(conversation(estimate, ("simulate", {}, overlaps)))
    assert json.loads(changes) == {"initial_joint_positions": [{"joint": "hinge", "position": pytest.approx(0.05)}]}
    passes = {"passed": True, "failed": "none"}
    assert wanted(conversation(estimate, ("simulate", {}, passes))) == [("finish", "{}")]
    for_ever: list[Called] = [estimate, ("simulate", {}, swings)] * 5
    assert wanted(conversation(*for_ever)) == [("finish", "{}")]


def test_the_offline_agent_goes_back_to_the_best_it_saw() -> None:
    limits = {"penetration_m": 0.002, "drift_m": 1e-3, "drift_rad": 1e-2, "peak_speed_m_s": 6.0}

    def overlap(depth: float) -> Called:
        return ("simulate", {}, {"passed": False, "failed": "penetration", "penetration_m": depth, "limits": limits})

    def start(position: float) -> Called:
        return ("set_parameters", {"initial_joint_positions": [{"joint": "hinge", "position": position}]}, {})

    calls = wanted(conversation(start(0.1), overlap(0.02), start(0.2), overlap(0.01), start(0.3), overlap(0.05)))
    assert [name for name, _ in calls] == ["set_parameters", "finish"]
    assert json.loads(calls[0][1])["initial_joint_positions"] == [{"joint": "hinge", "position": 0.2}]


def test_the_offline_agent_passes_on_what_a_fallible_model_says() -> None:
    assert wanted(conversation(), '{"scale": ')[0] == ("set_parameters", '{"scale": ')
    refused: Called = ("set_parameters", {}, {"error": "not JSON"})
    assert wanted(conversation(refused, ("simulate", {}, {})))[0] == ("set_parameters", '{"scale": 2}')
    text, calls = next_turn(conversation(refused, ("simulate", {}, {}), refused), lambda text: "gibberish")
    assert (text, calls) == ("gibberish", [])
