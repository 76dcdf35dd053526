"""The settings file: read back as printed, below the options, above the built-in values, mistakes in one line."""

import json
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
import pytest

from asset2sim.catalog.read import read_table
from asset2sim.runs.plan.content_hash import shared_hash
from asset2sim.runs.request import RefineRequest, parse_request, settings_for_run, usable_cores
from asset2sim.runs.settings_file import read_settings, settings_text
from flows.command import run_command
from flows.serve_nightly import parameters
from schemas.errors import UsageError
from schemas.settings import ModelSettings, RunSettings, Settings, Thresholds
from schemas.vocabulary import Engine, Export, Method
from tests.assets import RAW
from tests.commands import one_after_the_other

CHANGED = Settings(
    method=Method.RAW,
    exports=(Export.USD,),
    model=ModelSettings(judge_model="openai/gpt-4o", run_usd=1e-7, temperature=1e20),
    thresholds=Thresholds(drift_m=1e-5, oscillation_sign_changes=7),
    run=RunSettings(workers=3, hook="echo \"a: b\" # 'c' \\ [d] Φ"),
)


def asked(words: Sequence[str]) -> RefineRequest:
    return parse_request(["refine", "data", "--out", "out", *words])


def written(folder: Path, text: str, name: str = "settings.yaml") -> Path:
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.parametrize("form", ["yaml", "toml"])
@pytest.mark.parametrize("settings", [settings_for_run(None, {}), CHANGED], ids=["built in", "changed"])
def test_what_is_printed_is_read_back_as_it_was(settings: Settings, form: str, tmp_path: Path) -> None:
    file = written(tmp_path, settings_text(settings, form), f"settings.{form}")  # type: ignore[arg-type]
    assert settings_for_run(file, {}) == settings
    fields = pd.json_normalize(json.loads(settings.model_dump_json())).columns
    assert len(fields) > 115
    text = file.read_text(encoding="utf-8")
    assert all(f"{name.rpartition('.')[2]}{' =' if form == 'toml' else ':'}" in text for name in fields)
    assert "# Furthest the root may move over the test, m." in text


def test_the_command_prints_what_a_file_comes_to(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def never(request: RefineRequest) -> int:
        raise AssertionError(request)

    words = ["settings", "--settings", str(written(tmp_path, "thresholds: {drift_m: 0.5}"))]
    assert run_command(words, refine=never, nightly=never) == 0  # type: ignore[arg-type]
    printed = written(tmp_path, capsys.readouterr().out, "printed.yml")
    assert settings_for_run(printed, {}).thresholds == Thresholds(drift_m=0.5)


def test_an_option_goes_before_the_file_and_the_file_before_what_is_built_in(tmp_path: Path) -> None:
    text = """
model: {model: openai/one, judge_model: openai/two, run_calls: 5}
engine: {verify: [mujoco], interact: false}
views: {write: false}
run: {workers: 7, redo: all}
search:
  # mend_rounds: 3
"""
    file = str(written(tmp_path, text))
    plain = asked(["--settings", file]).settings
    assert (plain.model.model, plain.model.run_calls, plain.run.workers) == ("openai/one", 5, 7)
    assert plain.engine.verify == (Engine.MUJOCO,) and not plain.engine.interact and not plain.views.write
    assert plain.search == Settings().search and plain.thresholds == Settings().thresholds
    options = ["--model", "prior/household", "--judge-model", "null", "--workers", "1", "--interaction", "--views"]
    options += ["--engines", "", "--retry-failed"]
    over = asked(["--settings", file, *options]).settings
    assert over.model == ModelSettings(run_calls=5) and over.run == RunSettings(workers=1, redo="failed")
    assert over.engine.verify is None and over.engine.interact and over.views.write
    assert asked([]).settings == Settings(run=RunSettings(workers=usable_cores()))


def test_a_file_of_built_in_values_changes_no_content_hash(tmp_path: Path) -> None:
    file = written(tmp_path, settings_text(settings_for_run(None, {}), "yaml"))
    same, without = asked(["--settings", str(file)]).settings, asked([]).settings
    assert shared_hash(same, "p") == shared_hash(without, "p")
    whole = written(tmp_path, "physics: {max_density_kg_m3: 20000, max_inertia_ratio: 1e5}", "whole.yaml")
    assert shared_hash(settings_for_run(whole, {}), "p") == shared_hash(without, "p")
    other = written(tmp_path, "physics: {max_density_kg_m3: 20001}", "other.yaml")
    assert shared_hash(settings_for_run(other, {}), "p") != shared_hash(without, "p")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("thresholds: {drift_mm: 1}", "unknown field thresholds.drift_mm; did you mean thresholds.drift_m?"),
        ("drift_m: 1", "unknown field drift_m; did you mean thresholds.drift_m?"),
        ("threshold: {drift_m: 1}", "unknown field threshold; did you mean thresholds?"),
        ("views: {zzz: 1}", "unknown field views.zzz; choose from width, height, write"),
        ("thresholds: {drift_m: 0}", "thresholds.drift_m: '0' is not a number above 0"),
        ("thresholds: {drift_m: .nan}", "thresholds.drift_m: 'nan' is not a number above 0"),
        ("thresholds: {nudge_remaining: 1.5}", "thresholds.nudge_remaining: '1.5' is not a number from 0 to 1"),
        ("run: {workers: true}", "run.workers: 'True' is not a whole number from 1 on"),
        ("run: {workers: 2.5}", "run.workers: '2.5' is not a whole number from 1 on"),
        ("views: {write: 'no'}", "views.write: 'no' is not true or false"),
        ("collision: {mode: hull}", "collision.mode: invalid choice: 'hull' (choose from keep, repair, decompose)"),
        ("engine: {verify: [bullet]}", "engine.verify.0: invalid choice: 'bullet' (choose from pybullet"),
        ("exports: mjcf", "exports: 'mjcf' is not a list"),
        ("thresholds: 5", "thresholds: '5' is not a section of fields"),
        ("- method", "it holds no fields"),
        ("[a", "it cannot be read: while parsing"),
    ],
)
def test_a_mistake_names_the_file_the_field_and_what_would_be_right(text: str, message: str, tmp_path: Path) -> None:
    file = written(tmp_path, text)
    with pytest.raises(UsageError) as found:
        read_settings(file)
    said = str(found.value)
    assert said.startswith((f"{file}, line 1: {message}", f"{file}: {message}")) and "\n" not in said


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("s.yaml", "# mine\nmethod: magic\nrun:\n  # many\n  workers: 0\n\nviews:\n  zzz: 1\n  width: wide\n"),
        ("s.toml", '# mine\nmethod = "magic"\n[run]\n# many\nworkers = 0\n\n[views]\nzzz = 1\nwidth = "wide"\n'),
    ],
)
def test_all_mistakes_of_a_file_are_said_at_once_with_their_lines(name: str, text: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError) as found:
        read_settings(written(tmp_path, text, name))
    said = [line.split(f"{name}, ")[1] for line in str(found.value).splitlines()[1:]]
    assert [line.partition(": ")[0] for line in said] == ["line 2", "line 5", "line 8", "line 9"]
    for line, words in zip(said, ("method: invalid", "run.workers: '0'", "field views.zzz", "'wide'"), strict=True):
        assert words in line


def test_a_file_that_cannot_be_read_is_a_mistake(tmp_path: Path) -> None:
    (tmp_path / "bytes.yaml").write_bytes(b"\xff\xfe\xff")
    files = {"none.yaml": "No such file", "": "Is a directory", "bytes.yaml": "cannot be read"}
    files |= {"settings.json": "ends in .yaml, .yml or .toml", "bad.toml": "cannot be read"}
    written(tmp_path, "{}", "settings.json")
    written(tmp_path, "a = ", "bad.toml")
    for name, words in files.items():
        with pytest.raises(UsageError, match=words):
            settings_for_run(tmp_path / name, {})


def test_a_nightly_reads_its_file_when_a_night_begins_and_its_options_go_before(tmp_path: Path) -> None:
    from flows.nightly import nightly, tonight

    file = written(tmp_path, "thresholds: {drift_m: 0.5}\nrun: {workers: 5}")
    request = parse_request(["nightly", "data", "--out", "out", "--settings", str(file), "--workers", "2"])
    sent = RefineRequest.model_validate_json(request.model_dump_json())
    kept = nightly.validate_parameters(json.loads(json.dumps(parameters(sent))))
    assert kept["settings_file"] == file and kept["settings"].model_fields_set == {"run"}
    assert tonight(kept["settings"], kept["settings_file"]) == request.settings
    written(tmp_path, "thresholds: {drift_m: 0.25}\nrun: {workers: 5}")
    found = tonight(kept["settings"], kept["settings_file"])
    assert (found.thresholds.drift_m, found.run.workers) == (0.25, 2)
    written(tmp_path, "thresholds: {drift: 0.25}")
    with pytest.raises(UsageError, match=r"did you mean thresholds\.drift_m"):
        tonight(kept["settings"], kept["settings_file"])
    without = parameters(parse_request(["nightly", "data", "--out", "out"]))
    assert without["settings_file"] is None and without["settings"] == asked([]).settings.model_dump(mode="json")


@pytest.mark.system
def test_a_real_run_by_a_file_then_by_none(tmp_path: Path, prefect_server: str) -> None:
    out, quick = tmp_path / "out", "engine: {verify: [pybullet], interact: false}\nviews: {write: false}\n"
    strict = quick.replace("false}", "false, test_s: 0.5}", 1) + "thresholds: {drift_m: 1.0e-12, drift_rad: 1.0e-12}\n"
    options = ("--engines", "pybullet", "--no-interaction", "--no-views")
    refine = ("refine", str(RAW), "--out", str(out), "--assets", "box_wooden")
    files = [written(tmp_path, text, name) for text, name in ((strict, "my settings.yaml"), (quick, "quick.yaml"))]
    commands = [(*refine, "--settings", str(files[0])), (*refine, "--settings", str(files[1])), (*refine, *options)]
    _, second, third = one_after_the_other(commands, prefect_server)
    first = read_table(out, "runs").sort_values("started_at").iloc[0]
    stated = json.loads(first["settings_json"])
    assert stated["thresholds"]["drift_m"] == 1e-12 and stated["engine"]["test_s"] == 0.5
    history = read_table(out, "asset_history")
    modes = history[history["run_id"] == first["run_id"]]["failure_mode"].tolist()
    assert modes == ["drift"], "what every object passes by the built-in 1 mm fails by the file's"
    assert "1 of 1 ok" in second and "1 of 1 assets are unchanged" in third
