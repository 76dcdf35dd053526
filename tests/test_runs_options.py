"""Models, budgets and limits on the command line, and how they reach the workers."""

from pathlib import Path

import pytest

from asset2sim.intake.dataset import load_dataset
from asset2sim.runs.asking_attempt import ask_settings
from asset2sim.runs.check_request import check_packages
from asset2sim.runs.doctor import check_model_answers
from asset2sim.runs.options import parse
from asset2sim.runs.request import (
    bounded_by_memory,
    machine_memory_mb,
    parse_request,
    settings_for_run,
    stated_settings,
)
from flows import PIPELINE
from schemas.errors import UsageError
from schemas.inputs import InputSettings
from schemas.location import Location
from schemas.model_names import named_models, settings_for
from schemas.settings import EngineSettings, MethodSettings, ModelSettings, RunSettings, SearchSettings, Settings
from schemas.vocabulary import Correction, Engine, FailureMode, Gate, Method, Proposer, Status, UpAxis
from tests.assets import ROOT
from tests.model_server import Reply, serve
from tests.whole_records import refine_all

OPTIONS = (
    ("--refinement-model", "openai/two"),
    ("--judge-model", "openai/three"),
    ("--proposer", "model"),
    ("--correct", "units"),
    ("--samples", "3"),
    ("--budget-usd", "1.5"),
    ("--budget-calls", "0"),
    ("--budget-tokens", "90000"),
    ("--asset-budget-usd", "0"),
    ("--asset-budget-calls", "4"),
    ("--rpm", "30"),
    ("--asset-timeout", "20"),
    ("--min-success", "0.95"),
    ("--max-new-failures", "3"),
    ("--gate", "warn"),
    ("--check", "used"),
)


def test_the_options_become_settings() -> None:
    words = [word for option in OPTIONS for word in option]
    request = parse_request(["refine", "data", "--out", "out", *words, "--no-answer-cache"])
    assert request.settings.model == ModelSettings(
        refinement_model="openai/two", judge_model="openai/three", run_usd=1.5, run_calls=0, run_tokens=90_000,
        asset_usd=0.0, asset_calls=4, requests_per_minute=30.0, cache=False,
    )  # fmt: skip
    assert request.settings.search == SearchSettings(proposer=Proposer.MODEL)
    assert request.settings.checks == ("used",)
    assert (request.settings.correct, request.settings.doubt.samples) == (Correction.UNITS, 3)
    run = request.settings.run
    assert (run.asset_time_limit_s, run.min_success, run.max_new_failures, run.gate) == (20.0, 0.95, 3, Gate.WARN)
    plain = parse_request(["refine", "data", "--out", "out"])
    assert plain.settings.model == ModelSettings() and plain.settings.search.proposer is Proposer.SEARCH
    assert (plain.settings.run.asset_time_limit_s, plain.settings.run.min_success) == (300.0, None)


@pytest.mark.parametrize(
    ("words", "correction", "again"),
    [
        ("", Correction.SEMANTIC, False),
        ("--model prior/noisy@2", Correction.SEMANTIC, False),
        ("--model openai/gpt-4o", Correction.UNITS, True),
        ("--model recorded/answers", Correction.UNITS, True),
        ("--model openai/gpt-4o --correct semantic", Correction.SEMANTIC, False),
        ("--model openai/gpt-4o --correct off", Correction.OFF, True),
        ("--model openai/gpt-4o --no-ask-again", Correction.UNITS, False),
        ("--correct semantic --ask-again", Correction.SEMANTIC, True),
        ("--method no-semantics --ask-again", Correction.UNITS, False),
    ],
)
def test_a_models_meaning_is_its_own_and_the_priors_is_its_tables(
    words: str, correction: Correction, again: bool
) -> None:
    settings = parse_request(["refine", "data", "--out", "out", *words.split()]).settings
    assert (settings.correction, settings.asks_again) == (correction, again)


def test_packages_and_leave_to_read_outside_are_settings(tmp_path: Path) -> None:
    def inputs(*words: str) -> InputSettings:
        return parse_request(["refine", "data", "--out", "out", *words]).settings.inputs

    assert inputs() == InputSettings() and not inputs().allow_outside and inputs("--allow-outside").allow_outside
    found = inputs("--package", f"kit={tmp_path}", "--package", "s3kit=s3://bucket/kit/")
    assert found.package_folders == {"kit": str(tmp_path), "s3kit": "s3://bucket/kit"}
    assert inputs("--package", f"a={tmp_path},b=here").package_folders == {
        "a": str(tmp_path),
        "b": str(Path("here").absolute()),
    }
    for wrong in ("kit", "=x", "kit=", "a/b=x"):
        with pytest.raises(UsageError, match=r"argument --package: .*NAME=PATH"):
            inputs("--package", wrong)


def test_a_package_that_is_not_there_is_the_users_mistake(tmp_path: Path) -> None:
    for place, said in (
        (str(tmp_path / "gone"), "no such folder"),
        ("s3://bucket/kit", "in the bucket of its dataset"),
    ):
        with pytest.raises(UsageError, match=f"--package kit=.*{said}"):
            check_packages({"kit": place}, Location(tmp_path))
    check_packages({"kit": str(tmp_path), "more": "s3://bucket/kit"}, Location("s3://bucket/data"))


@pytest.mark.parametrize("words", [["--up=-y"], ["--up", "x"], []])
def test_the_up_axis_may_be_stated(words: list[str]) -> None:
    found = parse_request(["refine", "data", "--out", "out", *words]).settings.up
    assert found == (UpAxis(words[-1].removeprefix("--up=")) if words else None)


@pytest.mark.parametrize("method", list(Method))
def test_every_method_can_be_chosen(method: Method) -> None:
    assert parse_request(["nightly", "data", "--out", "out", "--method", method]).settings.method is method


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("--budget-usd", "-1", "'-1' is not a number from 0 on"),
        ("--budget-usd", "nan", "not a number from 0 on"),
        ("--asset-budget-usd", "much", "not a number from 0 on"),
        ("--budget-calls", "1.5", "whole number from 0 on"),
        ("--budget-tokens", "-3", "whole number from 0 on"),
        ("--rpm", "0", "'0' is not a number above 0"),
        ("--rpm", "inf", "not a number above 0"),
        ("--asset-timeout", "0", "'0' is not a number above 0"),
        ("--min-success", "95", "'95' is not a number from 0 to 1"),
        ("--max-new-failures", "-1", "whole number from 0 on"),
        ("--gate", "fatal", "choose from warn, error"),
    ],
)
def test_amounts_that_are_none_are_a_mistake(option: str, value: str, words: str) -> None:
    with pytest.raises(UsageError, match=words):
        parse(["refine", "data", "--out", "out", f"{option}={value}"])


@pytest.mark.parametrize(("words", "written"), [([], True), (["--views"], True), (["--no-views"], False)])
def test_views_are_written_or_not(words: list[str], written: bool, tmp_path: Path) -> None:
    file = tmp_path / "settings.yaml"
    file.write_text(f"views: {{write: {str(not written).lower()}}}")
    plain = parse_request(["refine", "data", "--out", "out", *words]).settings.views
    over = parse_request(["refine", "data", "--out", "out", *words, "--settings", str(file)]).settings.views
    assert plain.write is written and over.write is (written if words else not written)


@pytest.mark.system
def test_the_doctor_checks_each_named_model(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ANTHROPIC_API_KEY", raising=False)
    monkeypatch.delenv("ANTHROPIC_AUTH_TOKEN", raising=False)
    found = settings_for_run(
        None, stated_settings(parse(["doctor", "--judge-model", "anthropic/claude-sonnet-4-5"]))
    ).model
    assert named_models(found) == ("prior/household", "anthropic/claude-sonnet-4-5")
    assert "answers in this process" in check_model_answers(settings_for(found, "prior/household"))
    with pytest.raises(Exception, match="ANTHROPIC_API_KEY"):
        check_model_answers(settings_for(found, "anthropic/claude-sonnet-4-5"))


def test_repeats_are_asked_at_a_temperature_and_nothing_else_is() -> None:
    settings = Settings(method=Method.IVW, methods=MethodSettings(ivw_temperature=0.4))
    assert ask_settings(settings, "ivw").temperature == 0.4
    assert ask_settings(settings, "synthesis", sample=2).temperature == settings.doubt.sample_temperature > 0.0
    assert ask_settings(settings, "judge").temperature == 0.0 == ask_settings(Settings(), "synthesis").temperature


@pytest.mark.system
def test_a_spent_run_budget_ends_each_remaining_asset_with_its_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    refs = load_dataset(ROOT / "data" / "raw", None, ("box_wooden", "stapler_desk", "toilet_white"), None)
    with serve([Reply("down", status=500, headers={"Retry-After": "0"})]) as server:
        settings = Settings(
            model=ModelSettings(
                model="openai/scripted", api_base=server.api_base, max_attempts=2, run_calls=3, image_side_px=64
            ),
            engine=EngineSettings(verify=(Engine.PYBULLET,), interact=False),
            run=RunSettings(workers=1),
        )
        records = refine_all(refs, tmp_path, settings, PIPELINE, run_id="one").records
        again = refine_all(refs[:1], tmp_path, settings, PIPELINE, run_id="one").records
    assert len(server.requests) == 3
    assert all(record.status is Status.FAILED for record in (*records, *again))
    modes = [record.failure_mode for record in records]
    assert sorted(modes) == [FailureMode.BUDGET, FailureMode.BUDGET, FailureMode.MODEL_ERROR]
    assert sum(len(record.calls) for record in records) == 3
    (spent,) = again
    assert spent.failure_mode is FailureMode.BUDGET and spent.calls == ()
    assert "the run's budget of 3 model calls is spent: 3 made" in spent.reason


@pytest.mark.parametrize("word", ["", " "])
def test_an_empty_folder_is_a_mistake_and_not_the_current_one(word: str) -> None:
    for words in (["refine", word, "--out", "out"], ["refine", "data", "--out", word], ["failures", "--out", word]):
        with pytest.raises(UsageError, match="name is empty"):
            parse(words)


def test_workers_are_bounded_by_memory_with_a_sentence() -> None:
    asked = Settings(run=RunSettings(workers=64))
    settings, sentence = bounded_by_memory(asked, memory_mb=8192)
    assert settings.run.workers == 8 and sentence is not None
    assert "8 assets are refined at once, not 64: each takes up to 768 MB, the run itself 1536 MB, and" in sentence
    assert "this machine has 8192 MB" in sentence
    assert bounded_by_memory(asked, memory_mb=65_536) == (asked, None)
    assert bounded_by_memory(asked, memory_mb=100)[0].run.workers == 1
    elsewhere = Settings(run=RunSettings(workers=64, scheduler="tcp://h:1"))
    assert bounded_by_memory(elsewhere, memory_mb=100) == (elsewhere, None)
    assert machine_memory_mb() > 256
