"""A run's answers become a folder of files, and the folder the same run; questions become files, and a hand answers."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from asset2sim.catalog.read import read_table
from asset2sim.catalog.run import finish_run, start_run
from asset2sim.catalog.write import write_run
from asset2sim.intake.dataset import load_dataset
from asset2sim.models.gateway.abilities import check_model
from asset2sim.models.gateway.answer_cache import StoredAnswer, store_answer
from asset2sim.models.prior.answer import answer
from asset2sim.runs.plan.plan import Plan, make_plan, mark_published
from asset2sim.runs.record_answers import collect, record_answers, write_questions
from asset2sim.runs.spread.job import Job
from asset2sim.runs.spread.worker import refine_on_worker
from flows import PIPELINE
from flows.command import main
from schemas.errors import UsageError
from schemas.request import Recording, ToolCall
from schemas.settings import EngineSettings, MethodSettings, ModelSettings, RunSettings, Settings, ViewSettings
from schemas.vocabulary import Engine, Method, Status
from tests.assets import RAW
from tests.factories import make_call, make_record
from tests.model_server import Reply
from tests.scripted_server import Asked, competent, scripted
from tests.whole_records import refine_all

QUICK = Settings(
    engine=EngineSettings(verify=(Engine.PYBULLET,), interact=False),
    views=ViewSettings(write=False),
    run=RunSettings(workers=2),
)


def asking(model: ModelSettings, **changes: object) -> Settings:
    return QUICK.model_copy(update={"model": model, **changes})


def refined(out: Path, settings: Settings, asset_ids: tuple[str, ...], data: Path = RAW) -> Plan:
    """Refine samples as the flow does, without Prefect. Returns the plan."""
    out.mkdir(exist_ok=True)
    refs, started = load_dataset(data, asset_ids=asset_ids), start_run(settings, str(data))
    plan = make_plan(refs, out, settings, PIPELINE)
    done = refine_all(refs, out, settings, PIPELINE, started.run_id, plan)
    write_run(out, finish_run(started), done.records, plan.unchanged)
    mark_published(out, done.records)
    return plan


def overlays(out: Path) -> dict[str, bytes]:
    return {path.parent.name: path.read_bytes() for path in sorted(out.glob("assets/*/overlay.json"))}


def outcomes(out: Path) -> dict[str, tuple[str, str]]:
    table = read_table(out, "assets")
    return {str(row.asset_id): (str(row.failure_mode), str(row.reason)) for row in table.itertuples()}


JUDGED = '{"scale": {"score": 1, "reason": "fits"}, "state": {"score": 0.5, "reason": "half"}}'


def judging(make: Callable[[Asked], Reply]) -> Callable[[Asked], Reply]:
    """A script with a judge; its first answer about the box is one that does not fit."""

    def reply(asked: Asked) -> Reply:
        if asked.purpose == "judge":
            return Reply(JUDGED)
        if asked.asset_id == "box_wooden" and "<validation_errors>" not in asked.text:
            return Reply('A box: {"scale": 1, "magic": 2}')
        return make(asked)

    return reply


@pytest.mark.system
def test_a_recorded_run_comes_out_as_the_run_did(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    monkeypatch.chdir(tmp_path)
    chosen = ("box_wooden", "laptop_silver")
    with scripted(judging(competent)) as server:
        # Neither looks at its pictures: small ones are made sooner.
        models = {"model": "openai/scripted", "judge_model": "openai/judge", "image_side_px": 64}
        asked = ModelSettings.model_validate({**models, "api_base": server.api_base})
        refined(tmp_path / "asked", asking(asked), chosen)
        questions = len(server.asked)
    assert main(["record", "kept", "--out", "asked"]) == 0
    kept = tmp_path / "kept"
    names = sorted(path.name for path in kept.iterdir())
    assert len(names) == questions + 1
    assert {"box_wooden.json", "box_wooden.synthesis.2.json", "laptop_silver.json", "box_wooden.judge.json"} <= {*names}
    assert (kept / "box_wooden.json").read_text() == 'A box: {"scale": 1, "magic": 2}'
    recording = Recording.model_validate_json((kept / "recording.json").read_text())
    origin = recording.answers["laptop_silver.json"]
    assert origin.model == "openai/scripted" and origin.prompt is not None and "version" in origin.prompt
    assert recording.recorded_at is not None and origin.answered_at is not None and (origin.prompt_tokens or 0) > 1000

    again = asking(ModelSettings(model="recorded/kept", judge_model="recorded/kept", image_side_px=64))
    refined(tmp_path / "again", again, chosen)
    assert overlays(tmp_path / "again") == overlays(tmp_path / "asked") and len(overlays(tmp_path / "again")) == 2
    first, second = (read_table(tmp_path / name, "model_calls") for name in ("asked", "again"))
    same = ["asset_id", "purpose", "outcome", "prompt_tokens", "completion_tokens", "cost_usd", "prompt_hash"]
    assert second[same].equals(first[same]) and set(second["answered_by"]) == {"openai/scripted", "openai/judge"}
    assert set(read_table(tmp_path / "again", "assets")["model"]) == {"recorded/kept"}
    judged = (read_table(tmp_path / name, "alignment")["judged"].tolist() for name in ("asked", "again"))
    assert next(judged) == next(judged) == [0.75, 0.75]

    assert main(["record", "twice", "--out", "again"]) == 0
    texts = [{path.name: path.read_bytes() for path in kept.iterdir()} for kept in (kept, tmp_path / "twice")]
    assert all(texts[0][name] == texts[1][name] for name in names if name != "recording.json")

    # A worker of a cluster was started elsewhere, and is told from where folders count.
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    (box,) = load_dataset(RAW, asset_ids=("box_wooden",))
    there = refine_on_worker(Job(box, "0" * 64), tmp_path / "there", again, PIPELINE, "r", str(tmp_path))
    lost = refine_on_worker(Job(box, "1" * 64), tmp_path / "lost", again, PIPELINE, "r")
    assert (there.kept.record.status, lost.kept.record.status) == (Status.OK, Status.FAILED)
    monkeypatch.chdir(tmp_path)

    (kept / "laptop_silver.json").unlink()
    plan = refined(tmp_path / "again", again, chosen)
    assert [ref.asset_id for ref in plan.todo] == ["laptop_silver"]
    mode, reason = outcomes(tmp_path / "again")["laptop_silver"]
    assert mode == "model_error" and "put one into laptop_silver.json" in reason


@pytest.mark.system
def test_questions_are_written_and_answered_by_hand(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    chosen = ("laptop_silver", "planted_not_xml")
    words = ["ask", str(RAW), "mine", "--assets", ",".join(chosen), "--workers", "1"]
    assert main(words) == 0
    said = capsys.readouterr()
    assert "laptop_silver.json" in said.out and "recorded/mine" in said.out
    assert "no question about asset planted_not_xml" in said.err
    folder = tmp_path / "mine" / "questions" / "laptop_silver"
    views = ["back.png", "front.png", "left.png", "parts.png", "parts_closed.png", "parts_open.png", "perspective.png"]
    assert sorted(path.name for path in folder.iterdir()) == sorted([*views, "question.json", "question.md"])
    assert all((folder / name).read_bytes().startswith(b"\x89PNG") for name in views)
    text = (folder / "question.md").read_text(encoding="utf-8")
    plain = json.loads((folder / "question.json").read_text(encoding="utf-8"))
    assert plain["system"] in text and plain["text"] in text and all(f"({name})" in text for name in views)
    assert "../../laptop_silver.json" in text and '"initial_joint_positions"' in text

    settings = asking(ModelSettings(model="recorded/mine"))
    with pytest.raises(UsageError, match="holds no answers"):
        check_model(settings.model)
    (folder / plain["answer_file"]).write_text(answer(plain["text"]), encoding="utf-8")
    refined(tmp_path / "out", settings, chosen)
    found = outcomes(tmp_path / "out")
    assert found["laptop_silver"][0] == "none" and found["planted_not_xml"][0] == "unreadable_asset"
    findings = read_table(tmp_path / "out", "findings")
    assert "other_question" not in set(findings["code"])

    (tmp_path / "mine" / "laptop_silver.json").write_text('{"scale": 0.3}', encoding="utf-8")
    assert main(words) == 0
    assert (tmp_path / "mine" / "laptop_silver.json").read_text() == '{"scale": 0.3}'


@pytest.mark.system
def test_questions_that_follow_from_answers_are_written_once_these_are_there(tmp_path: Path) -> None:
    refs = load_dataset(RAW, asset_ids=("laptop_silver",))
    settings = asking(ModelSettings(), method=Method.IVW, methods=MethodSettings(ivw_queries=1))
    first = write_questions(refs, tmp_path, settings, PIPELINE)
    # Three of five without an answer, and half can no longer be valid.
    assert list(first.origins) == [f"laptop_silver.ivw{part}.json" for part in ("", ".2", ".3")]
    for name in first.origins:
        asked = json.loads((tmp_path / "questions" / name.removesuffix(".json") / "question.json").read_text())
        (tmp_path / name).write_text(answer(asked["text"]), encoding="utf-8")
    shown = {tuple(json.loads(path.read_text())["images"]) for path in tmp_path.glob("questions/*/question.json")}
    assert len(shown) == 3

    second = write_questions(refs, tmp_path, settings, PIPELINE)
    assert list(second.origins) == ["laptop_silver.ivw.4.json", "laptop_silver.ivw.5.json"]
    for name in second.origins:
        (tmp_path / name).write_text((tmp_path / "laptop_silver.ivw.json").read_text(), encoding="utf-8")
    third = write_questions(refs, tmp_path, settings, PIPELINE)
    assert third.answered == ["laptop_silver"] and not third.origins and not third.failed


def test_a_method_that_asks_nothing_has_no_questions(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"method raw asks no model; choose from: .*direct"):
        write_questions([], tmp_path / "q", asking(ModelSettings(), method=Method.RAW), PIPELINE)
    assert not (tmp_path / "q").exists()


def rows(*calls: Mapping[str, object]) -> pd.DataFrame:
    plain = {"asset_id": "7", "method": "asset2sim", "call_model": "openai/x", "purpose": "synthesis", "outcome": "ok"}
    return pd.DataFrame([{**plain, "call_index": index, **call} for index, call in enumerate(calls)])


def keep(folder: Path, key: str, content: str | None, **more: Any) -> str:
    store_answer(folder, key, StoredAnswer(model="openai/x", purpose="p", prompt_hash="h", content=content, **more))
    return f"{key}.json"


def test_answers_are_numbered_as_they_were_asked_for(tmp_path: Path) -> None:
    tool = ToolCall(call_id="1", name="render", arguments="{}")
    first, second = keep(tmp_path, "a", "one", cost_usd=0.1), keep(tmp_path, "b", None, tool_calls=(tool,))
    calls = rows(
        {"answer_file": None, "outcome": "provider_error"},
        {"answer_file": first, "outcome": "invalid_answer"},
        {"answer_file": first, "outcome": "cached"},  # a second attempt, after the first one's process died
        {"answer_file": second},
        {"answer_file": second, "purpose": "agent"},
        {"answer_file": "gone.json", "purpose": "judge"},
        {"answer_file": None, "asset_id": "8"},
    )
    found = collect(calls.sample(frac=1.0, random_state=3), tmp_path)
    assert set(found.texts) == {"7.json", "7.synthesis.2.json", "7.agent.json"}
    assert found.texts["7.json"] == b"one" and found.origins["7.json"].cost_usd == 0.1
    assert json.loads(found.texts["7.agent.json"])["tool_calls"] == [tool.model_dump()]
    assert [line.split(":")[0] for line in found.lost] == ["asset 7, judge", "asset 8, synthesis"]


def test_a_folder_keeps_what_it_holds(tmp_path: Path) -> None:
    out = tmp_path / "out"
    (out / ".cache" / "answers").mkdir(parents=True)
    file = keep(out / ".cache" / "answers", "a", "one")
    record = make_record("7", calls=(make_call(purpose="synthesis", answer_file=file),))
    write_run(out, finish_run(start_run(Settings(), "data")), [record])
    folder = tmp_path / "kept"
    folder.mkdir()
    (folder / "7.json").write_text("another")
    (folder / "recording.json").write_text('{"note": "mine", "answers": {"9.json": {"model": "me"}}}')
    with pytest.raises(UsageError, match=r"another answer in 7\.json"):
        record_answers(out, folder)
    assert sorted(path.name for path in folder.iterdir()) == ["7.json", "recording.json"]
    (folder / "7.json").write_text("one")
    record_answers(out, folder)
    recording = Recording.model_validate_json((folder / "recording.json").read_text())
    assert recording.note == "mine" and set(recording.answers) == {"7.json", "9.json"}


def test_a_run_that_kept_no_answers_says_why(tmp_path: Path) -> None:
    for calls, words in (((), "made no model calls"), ((make_call(),), "--no-answer-cache")):
        out = tmp_path / words.strip("-").replace(" ", "-")
        write_run(out, finish_run(start_run(Settings(), "data")), [make_record("7", calls=calls, status=Status.OK)])
        with pytest.raises(UsageError, match=words):
            record_answers(out, tmp_path / "kept")
    assert not (tmp_path / "kept").exists()
