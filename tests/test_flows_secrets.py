"""Hooks and addresses with keys: whole where they are used, redacted in tables, MLflow, Prefect and process lists."""

import json
import pickle
import shutil
import sqlite3
import stat
import subprocess
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from asset2sim.catalog.mlflow_log import run_params
from asset2sim.catalog.read import read_table
from asset2sim.catalog.rows import run_row
from asset2sim.catalog.run import finish_run, start_run
from asset2sim.runs.plan.content_hash import shared_hash
from asset2sim.runs.request import parse_request
from asset2sim.runs.settings_file import read_settings, settings_text
from flows.serve_nightly import parameters
from flows.server.night_secrets import remove_old_secrets, secrets_kept, with_secrets
from schemas.errors import UsageError
from schemas.secret import redacted_address, secret_parts
from schemas.settings import ModelSettings, RunSettings, Settings
from tests.assets import ROOT
from tests.incremental_runs import dataset
from tests.prefect_server import using

BASE = "https://me:pass-word-1@127.0.0.1:1/v1/a1b2c3d4e5f6a7b8c9d0e1f2?code=query-key-2#part-3"
HOOK = "curl https://chat.example/hook-secret-4"
SECRETS = ("pass-word-1", "a1b2c3d4e5f6a7b8c9d0e1f2", "query-key-2", "part-3", "hook-secret-4")
ASKED = Settings(model=ModelSettings(model="openai/x", api_base=BASE), run=RunSettings(hook=HOOK))


def assert_none(text: str) -> None:
    assert not [secret for secret in SECRETS if secret in text], text[:500]


def test_json_is_redacted_and_nothing_else_is() -> None:
    assert_none(ASKED.model_dump_json())
    assert_none(json.dumps(run_params(ASKED)) + str(run_row(finish_run(start_run(ASKED, "data")), ())))
    assert redacted_address(BASE) == "https://***@127.0.0.1:1/v1/***?***#***"
    assert redacted_address("http://127.0.0.1:8000/v1") == "http://127.0.0.1:8000/v1"
    assert set(secret_parts(BASE)) >= set(SECRETS[:4])
    assert pickle.loads(pickle.dumps(ASKED)) == ASKED and ASKED.model_dump()["run"]["hook"] == HOOK
    assert shared_hash(ASKED, "p") == shared_hash(Settings.model_validate_json(ASKED.model_dump_json()), "p")


@pytest.mark.parametrize("form", ["yaml", "toml"])
def test_a_settings_file_has_them_whole(form: str, tmp_path: Path) -> None:
    file = tmp_path / f"settings.{form}"
    file.write_text(settings_text(ASKED, form), encoding="utf-8")  # type: ignore[arg-type]
    assert Settings.model_validate(read_settings(file)) == ASKED


def test_a_nightlys_parameters_hold_a_token(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PREFECT_HOME", str(tmp_path / "home"))
    words = ["nightly", "data", "--out", str(tmp_path / "out"), "--api-base", BASE, "--hook", HOOK, "--rpm", "3"]
    with secrets_kept(parse_request(words)) as safe:
        assert_none(safe.model_dump_json() + json.dumps(parameters(safe)))
        told = Settings.model_validate(parameters(safe)["settings"])
        found = with_secrets(told, str(parameters(safe)["secrets"]))
        assert (found.run.hook, found.model.api_base, found.model.requests_per_minute) == (HOOK, BASE, 3.0)
        (file,) = (tmp_path / "home" / "nightlies" / "secrets").iterdir()
        assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert not file.exists()
    with pytest.raises(UsageError, match="start `asset2sim nightly` again"):
        with_secrets(told, safe.secrets)
    with pytest.raises(KeyboardInterrupt), secrets_kept(parse_request(words)):
        raise KeyboardInterrupt
    remove_old_secrets(tmp_path / "out")
    assert not list(file.parent.iterdir())
    with secrets_kept(parse_request(words[:4])) as plain:
        assert plain.secrets is None and with_secrets(Settings(), None) == Settings()


def test_with_a_settings_file_only_what_options_state_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PREFECT_HOME", str(tmp_path / "home"))
    file = tmp_path / "settings.yaml"
    file.write_text(f"run: {{hook: '{HOOK}'}}", encoding="utf-8")
    words = ["nightly", "data", "--out", str(tmp_path / "out"), "--settings", str(file)]
    with secrets_kept(parse_request(words)) as safe:
        assert safe.secrets is None and parameters(safe)["settings"] == {}, "the file is read each night"
    with secrets_kept(parse_request([*words, "--api-base", BASE])) as safe:
        assert_none(json.dumps(parameters(safe)) + safe.model_dump_json())
        found = with_secrets(Settings.model_validate(parameters(safe)["settings"]), safe.secrets)
        assert found.model.api_base == BASE and found.run.hook is None


@pytest.mark.system
def test_no_file_of_a_run_holds_a_key(
    tmp_path: Path, prefect_server: str, prefect_server_home: Path, ready: list[str]
) -> None:
    """A whole run against an address where nobody listens: OUT, MLflow and Prefect, tables and databases decoded."""
    data, out, home = dataset(tmp_path / "data", ("a",)), tmp_path / "out", tmp_path / "home"
    shutil.copytree(ROOT / "data" / "raw" / "Box" / "box_wooden", data / "box")
    (data / "manifest.csv").write_text("asset_id,path\na,box\n", encoding="utf-8")
    settings = tmp_path / "settings.yaml"
    settings.write_text("model: {max_attempts: 1}", encoding="utf-8")
    told = tmp_path / "told"
    hook = f"echo hook-secret-4 $ASSET2SIM_EXIT > '{told}'"
    words = ["refine", str(data), "--out", str(out), "--model", "openai/x", "--api-base", BASE, "--hook", hook]
    environment = {**using(prefect_server, home), "OPENAI_API_KEY": "sk-key-5-of-a-test"}
    ran = subprocess.run(
        [*ready, "-m", "flows.command", *words, "--no-views", "--settings", str(settings)], cwd=ROOT, text=True,
        capture_output=True, env=environment, timeout=300,
    )  # fmt: skip
    assert ran.returncode == 0 and told.read_text() == "hook-secret-4 0\n", ran.stderr
    (row,) = read_table(out, "assets").to_dict("records")
    assert row["failure_mode"] == "model_error", row["reason"]
    assert "could not be reached at https://***@127.0.0.1:1/v1/***?***" in row["reason"]
    everything = [ran.stdout, ran.stderr]
    for path in (file for place in (out, home, prefect_server_home) for file in place.rglob("*") if file.is_file()):
        everything.append(path.read_bytes().decode("utf-8", "replace"))
        if path.suffix == ".parquet":
            everything.append(str(pq.read_table(path, partitioning=None).to_pylist()))
        if path.read_bytes().startswith(b"SQLite format 3"):
            with sqlite3.connect(path) as database:
                everything += list(database.iterdump())
    assert len(everything) > 20
    assert_none("\n".join(everything))
    assert "sk-key-5" not in "\n".join(everything)
