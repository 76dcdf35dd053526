"""The hook: what it is told, and that nothing of a run can become part of a command or hold a run up."""

import json
import os
import shlex
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from asset2sim.catalog.changes import Previous, find_changes
from asset2sim.catalog.mlflow_log import run_params
from asset2sim.catalog.rows import run_row
from asset2sim.catalog.run import finish_run, start_run
from asset2sim.catalog.summarize import summarize_all
from asset2sim.runs.result import (
    INTERRUPTED,
    MAX_VALUE,
    RunResult,
    alert,
    alert_error,
    exit_code,
    hook_environment,
    hook_values,
    run_hook,
)
from flows.nightly import code_of_state, state_of
from schemas.asset import Unchanged
from schemas.errors import Asset2SimError, UsageError
from schemas.settings import RunSettings, Settings
from schemas.vocabulary import FailureMode, Status
from tests.factories import make_failure, make_record

EVIL = "$(touch evil); `touch evil`; \" ' ; touch evil #\n touch evil"
WRITE = f"{shlex.quote(sys.executable)} -c \"import json, os; json.dump(dict(os.environ), open('told.json', 'w'))\""


def told(folder: Path) -> dict[str, str]:
    found: dict[str, str] = json.loads((folder / "told.json").read_text(encoding="utf-8"))
    return found


def result_of(out: Path, hook: str | None, stopped: str | None = None) -> RunResult:
    """A good, a mended and a newly failing asset, whose name is hostile."""
    records = (make_record("good"), make_record("mended"), make_failure(EVIL, FailureMode.DRIFT))
    run = finish_run(start_run(Settings(run=RunSettings(hook=hook)), "data"))
    refined = summarize_all(records)
    changes = find_changes(refined, Previous({"good": "none", "mended": "drift"}))
    return RunResult(out, run, refined, stopped, (), report=out / "report" / "index.html", changes=changes)


def test_the_hook_is_told_everything_by_its_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    result = result_of(tmp_path, WRITE)
    assert alert(result, strict=True) == result
    found = told(tmp_path)
    expected = {
        "REPORT": str(tmp_path / "report" / "index.html"), "ASSETS": "3", "OK": "2", "FAILED": "1", "NEW_FAILURES": "1",
        "MENDED": "1", "EXIT": "1", "OUTCOME": "finished", "QUERIES": "2", "COST_USD": "0.0200", "ERROR": "",
        "RUN_ID": result.run.run_id, "OUT": str(tmp_path),
    }  # fmt: skip
    assert {name: found[f"ASSET2SIM_{name}"] for name in expected} == expected
    assert found["PATH"] == os.environ["PATH"]


def test_the_hook_counts_unchanged_failures_as_the_exit_code_does(tmp_path: Path) -> None:
    left = [Unchanged(asset_id=name, status=Status.FAILED, failure_mode=FailureMode.DRIFT) for name in "abc"]
    still = Unchanged(asset_id="d", status=Status.OK, failure_mode=FailureMode.NONE)
    result = replace(result_of(tmp_path, None), records=(), unchanged=(*left, still))
    values = hook_values(result, strict=True)
    assert [values[name] for name in ("assets", "unchanged", "ok", "failed", "exit")] == [4, 4, 1, 3, 1]


def test_nothing_of_a_run_becomes_part_of_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    settings = RunSettings(hook=f'printf "%s" "$ASSET2SIM_ERROR" > said; {WRITE}')
    warning = alert_error(tmp_path, settings, Asset2SimError(EVIL))
    assert warning is None
    assert (tmp_path / "said").read_text(encoding="utf-8") == EVIL
    assert (told(tmp_path)["ASSET2SIM_EXIT"], told(tmp_path)["ASSET2SIM_OUTCOME"]) == ("1", "failed")
    assert not (tmp_path / "evil").exists()


def test_every_hook_is_told_the_same_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names = {f"ASSET2SIM_{name.upper()}" for name in hook_values(result_of(tmp_path, None), strict=False)}
    assert alert_error(tmp_path, RunSettings(hook=WRITE), UsageError("no such dataset")) is None
    assert names <= told(tmp_path).keys()
    assert told(tmp_path)["ASSET2SIM_EXIT"] == "2"


@pytest.mark.parametrize(
    ("command", "words"),
    [("exit 7", "exit code 7"), ("no-such-program-here 2>/dev/null", "exit code 127"), ("kill -9 $$", "SIGKILL")],
)
def test_a_hook_that_fails_is_a_warning(tmp_path: Path, command: str, words: str) -> None:
    (warning,) = alert(result_of(tmp_path, command), strict=False).warnings
    assert words in warning and "\n" not in warning


def test_a_hook_that_hangs_is_killed_with_what_it_started(tmp_path: Path) -> None:
    started = time.monotonic()
    warning = run_hook(f"sleep 600 & echo $! > {tmp_path}/pid; wait", {}, 2.0)
    assert warning is not None and "killed after 2 s" in warning
    assert time.monotonic() - started < 300.0
    sleeper = Path("/proc") / (tmp_path / "pid").read_text(encoding="ascii").strip()
    end = time.monotonic() + 60.0
    while sleeper.exists() and " Z " not in (sleeper / "stat").read_text(encoding="ascii") and time.monotonic() < end:
        time.sleep(0.05)
    assert not sleeper.exists() or " Z " in (sleeper / "stat").read_text(encoding="ascii")


def test_values_that_an_environment_cannot_take_do_not_stop_the_hook() -> None:
    values = hook_environment(
        {"error": "a\0b", "out": Path(os.fsdecode(b"/caf\xe9")), "long": "x" * 99999, "none": None}
    )
    assert values["ASSET2SIM_ERROR"] == "ab" and values["ASSET2SIM_NONE"] == ""
    assert os.fsencode(values["ASSET2SIM_OUT"]) == b"/caf\xe9" and len(values["ASSET2SIM_LONG"]) == MAX_VALUE
    assert run_hook("true", {"error": "a\0b", "lone": "\ud800"}, 10.0) is None


def test_without_a_hook_nothing_runs(tmp_path: Path) -> None:
    result = result_of(tmp_path, None)
    assert alert(result, strict=True) is result
    assert alert_error(tmp_path, RunSettings(), ValueError()) is None


def test_an_interrupted_run_tells_so(tmp_path: Path) -> None:
    result = result_of(tmp_path, None, stopped=INTERRUPTED)
    assert (hook_values(result, False)["exit"], exit_code(result, True)) == (130, 130)
    assert hook_values(result, False)["error"] == INTERRUPTED


def test_no_table_and_no_log_keeps_the_hook() -> None:
    settings = Settings(run=RunSettings(hook="curl https://chat.example/secret"))
    run = finish_run(start_run(settings, "data"))
    assert "secret" not in str(run_row(run, []))
    assert "secret" not in str(run_params(settings))


def gated(out: Path, **run: object) -> RunResult:
    """Two of three assets pass, and one newly fails."""
    result = result_of(out, None)
    settings = Settings(run=RunSettings.model_validate(run))
    return replace(result, run=result.run.model_copy(update={"settings": settings}))


@pytest.mark.parametrize(
    ("run", "code", "words"),
    [
        ({"min_success": 0.95}, 3, "2 of 3 assets are ok (66.7 %), the gate --min-success asks for 95 %"),
        ({"min_success": 0.95, "gate": "warn"}, 0, "gate (warn): 2 of 3"),
        ({"max_new_failures": 0}, 3, "1 new failure, the gate --max-new-failures allows 0"),
        ({"min_success": 2 / 3, "max_new_failures": 1}, 0, ""),
        ({}, 0, ""),
    ],
)
def test_a_missed_gate_is_an_exit_code_of_its_own_or_a_warning(
    tmp_path: Path, run: dict[str, object], code: int, words: str
) -> None:
    result = gated(tmp_path, **run)
    assert exit_code(result, strict=False) == code and exit_code(result, strict=True) == 1
    warnings = alert(result, strict=False).warnings
    assert (words in warnings[0]) if words else warnings == ()
    assert bool(hook_values(result, strict=False)["gate"]) == bool(words)
    assert exit_code(replace(result, stopped=INTERRUPTED), strict=False) == 130
    assert code_of_state(state_of(result, strict=False)) == code


def test_a_hook_that_was_not_kept_does_not_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a").write_text("touch ran", encoding="utf-8")
    settings = Settings.model_validate_json(Settings(run=RunSettings(hook="touch ran")).model_dump_json())
    assert settings.run.hook == "***"
    assert "was not kept" in str(alert_error(tmp_path, settings.run, Asset2SimError("down")))
    assert not (tmp_path / "ran").exists()
