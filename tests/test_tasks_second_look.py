"""Guessed closed ends, asked over real HTTP: the answer decides, its calls count, a failure changes nothing."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from asset2sim.models.gateway.ask import ask
from asset2sim.models.gateway.session import open_gateway_session
from asset2sim.models.prior.answer import answer
from asset2sim.runs.record_answers import write_questions
from asset2sim.validation.second_look import ENDS
from flows import PIPELINE
from schemas.asset import AssetRecord, AssetRef, Overrides
from schemas.model_names import settings_for
from schemas.overlay import JointPhysics
from schemas.settings import DoubtSettings, EngineSettings, ModelSettings, Settings, ViewSettings
from schemas.vocabulary import Engine
from tasks.pipeline import refine_asset
from tests.assets import joint, link, robot, shape, written
from tests.model_server import Reply
from tests.scripted_server import Asked, ScriptedServer, information, scripted

pytestmark = [pytest.mark.system, pytest.mark.usefixtures("no_keys")]

GUESSED, ASKED, UNANSWERED = "closed_end_guessed", "closed_end_asked", "closed_end_unanswered"
FLAP = robot(
    link("frame", "".join(shape("0.3 0.02 0.6", xyz=f"0 {y} 0.3") for y in (-0.2, 0.2))),
    link("flap", shape("0.01 0.3 0.12", xyz="0 0 -0.06")),
    joint("hinge", "revolute", "frame", "flap", xyz="0 0 0.36", axis="0 1 0", limit="0 1"),
)
"""A flap between two boards: by its weight it is closed where it hangs, at 0; its shape does not tell."""


def model_says(said: str | Reply) -> Callable[[Asked], Reply]:
    """A script that answers the question about ends so, and everything else as the tables do."""

    def reply(asked: Asked) -> Reply:
        if asked.purpose != ENDS:
            return Reply(answer(asked.text))
        return said if isinstance(said, Reply) else Reply(said)

    return reply


def settings_of(model: ModelSettings, **doubt: bool) -> Settings:
    return Settings(
        model=model,
        doubt=DoubtSettings(**doubt),
        engine=EngineSettings(verify=(Engine.PYBULLET,), interact=False),
        views=ViewSettings(width=48, height=48, write=False),
    )


def refined(tmp_path: Path, settings: Settings, overrides: Overrides | None = None) -> AssetRecord:
    """The flap through all stages, asked through the gateway."""
    folder = written(tmp_path / "flap", FLAP)
    ref = AssetRef(asset_id="flap", path=str(folder), category="Box", overrides=overrides)
    model = settings_for(settings.model, settings.model.model)
    session = open_gateway_session(tmp_path / "out", "run", "flap", model)
    return refine_asset(ref, tmp_path / "out", settings, lambda request: ask(request, model, session))


def asked_at(server: ScriptedServer) -> ModelSettings:
    return ModelSettings(
        model="openai/scripted", api_base=server.api_base, max_attempts=1, cache=False, image_side_px=128
    )


def hinge(record: AssetRecord) -> JointPhysics:
    assert record.overlay is not None, record.reason
    return record.overlay.joints[0]


def codes(record: AssetRecord) -> list[str]:
    found = (finding.code for finding in record.findings)
    return [code for code in found if code in (GUESSED, ASKED, UNANSWERED)]


def ends(end: str, sure: float) -> str:
    return json.dumps({"joints": {"hinge": {"closed": end, "sure": sure, "why": "it covers the opening"}}})


@pytest.mark.parametrize(
    ("end", "sure", "closed", "found"),
    [("a", 0.9, 0.0, [ASKED]), ("b", 0.9, 1.0, [ASKED]), ("b", 0.1, 1.0, [ASKED, GUESSED])],
)
def test_the_model_that_saw_both_ends_decides(
    tmp_path: Path, end: str, sure: float, closed: float, found: list[str]
) -> None:
    with scripted(model_says(ends(end, sure))) as server:
        record = refined(tmp_path, settings_of(asked_at(server)))
    assert hinge(record).closed == pytest.approx(closed) and codes(record) == found
    (question,) = server.of("flap", ENDS)
    assert [image[0] for image in question.images] == ["perspective", "1a", "1b"]
    assert all(image[3] > 300 for image in question.images)
    facts = information(question.text)["joints"]
    assert [(item["name"], item["a"], item["b"]) for item in facts] == [(
        "hinge",
        {"position": 0.0, "picture": "1a", "would": []},
        {"position": 1.0, "picture": "1b", "would": ["fall open"]},
    )]  # fmt: skip
    calls = [call.purpose for call in record.calls]
    assert calls == [ENDS, "synthesis"] and record.calls[0].prompt_tokens > 100
    told = next(item for item in record.findings if item.code == ASKED)
    assert "it covers the opening" in told.message and ("as guessed" in told.message)
    later = information(server.of("flap", "synthesis")[0].text)["joints"][0]
    assert (later["closed"], later["open_confidence"]) == (closed, sure), "what is told goes on to the next question"


@pytest.mark.parametrize(
    ("said", "calls", "why"),
    [
        (Reply("no such model", status=400), 1, "no such model"),
        ('{"joints": {}}', 2, "joints.hinge: this field is required"),
        ('{"joints": {"lid": {"closed": "a", "sure": 1}}}', 2, "joints.lid: this joint is not asked about"),
        ('{"joints": {"hinge": {"closed": "c", "sure": 1}}}', 2, "joints.hinge.closed"),
    ],
)
def test_a_model_that_does_not_answer_changes_nothing(tmp_path: Path, said: str | Reply, calls: int, why: str) -> None:
    with scripted(model_says(said)) as server:
        record = refined(tmp_path, settings_of(asked_at(server)))
    assert hinge(record).closed == 0.0 and codes(record) == [UNANSWERED, GUESSED]
    assert why in next(item.message for item in record.findings if item.code == UNANSWERED)
    assert [call.purpose for call in record.calls] == [*[ENDS] * calls, "synthesis"]


def test_nothing_is_asked_where_nothing_is_to_be_told(tmp_path: Path) -> None:
    """Without doubts, where the user states the position, and of the tables, which see no pictures."""
    with scripted(model_says(ends("b", 0.9))) as server:
        model = asked_at(server)
        stated = Overrides.model_validate({"joints": {"hinge": {"value": 0.5, "unit": "rad"}}})
        for name, settings, own, found in (
            ("calm", settings_of(model, ask_again=False), None, [GUESSED]),
            ("stated", settings_of(model), stated, []),
            ("prior", settings_of(ModelSettings()), None, [GUESSED]),
        ):
            assert codes(refined(tmp_path / name, settings, own)) == found, name
    assert not server.of("flap", ENDS)


def test_recorded_answers_have_one_or_leave_the_guess(tmp_path: Path) -> None:
    """The question of ends is written first, since the synthesis follows from it; both answers refine the object."""
    kept = tmp_path / "kept"
    kept.mkdir()
    ref = AssetRef(asset_id="flap", path=str(written(tmp_path / "flap", FLAP)), category="Box")
    settings = settings_of(ModelSettings(model=f"recorded/{kept}", image_side_px=64))
    assert set(write_questions([ref], kept, settings, PIPELINE).origins) == {"flap.ends.json"}
    shown = {path.name for path in (kept / "questions/flap.ends").iterdir()}
    assert {"1a.png", "1b.png", "question.md"} <= shown
    (kept / "flap.ends.json").write_text(ends("b", 0.8), encoding="utf-8")
    assert set(write_questions([ref], kept, settings, PIPELINE).origins) == {"flap.json"}
    plain = json.loads((kept / "questions/flap/question.json").read_text(encoding="utf-8"))
    (kept / "flap.json").write_text(answer(plain["text"]), encoding="utf-8")
    record = refined(tmp_path, settings)
    assert hinge(record).closed == 1.0 and codes(record) == [ASKED]
    assert not [item for item in record.findings if item.code == "other_question"]
    (kept / "flap.ends.json").unlink()
    record = refined(tmp_path, settings)
    assert hinge(record).closed == 0.0 and codes(record) == [UNANSWERED, GUESSED]
