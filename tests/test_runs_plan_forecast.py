"""A dry run: what would be refined and why, what that would take, and that nothing is written."""

from pathlib import Path

import pytest

from asset2sim.catalog.text import duration
from asset2sim.intake.dataset import load_dataset
from asset2sim.runs.plan import state
from asset2sim.runs.plan.forecast import Forecast, forecast
from flows.command import run_command
from flows.dry_run import expected_lines
from schemas.errors import GATE
from schemas.settings import ModelSettings, PhysicsSettings, RunSettings, Settings
from schemas.vocabulary import FailureMode, Redo
from tests.incremental_runs import NO_VIEWS, asking, dataset, failing, manifest, run


def told(data: Path, out: Path, settings: Settings = NO_VIEWS) -> Forecast:
    return forecast(load_dataset(data), out, settings, "p")


def tree(folder: Path) -> dict[str, tuple[int, int]]:
    """Every file and folder below, with its time and size."""
    return {str(path): (path.stat().st_mtime_ns, path.stat().st_size) for path in sorted(folder.rglob("*"))}


def test_every_asset_has_its_reason_and_nothing_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(state, "SETTLED_NS", 0)  # the files are as old as the test
    data, out = dataset(tmp_path / "data"), tmp_path / "out"
    assert told(data, out).reasons == {"new": ["a", "b", "c", "d"]} and not out.exists()
    run(data, out, make=failing({"c": FailureMode.MISSING_MESH, "d": FailureMode.TIMEOUT}))
    before = tree(out)
    found = told(data, out)
    assert found.reasons == {"failed in a way that may pass": ["d"]} and found.failing == ["c"]
    manifest(data, {"a": "open", "b": "", "c": "", "d": ""})
    (data / "b" / "mobility.urdf").write_text("<robot name='other'/>")
    (data / "overrides.csv").write_text("asset_id,mass_kg\nc,3\n")
    reasons = {asset_id: why for why, ids in told(data, out).reasons.items() for asset_id in ids}
    assert "files mobility.urdf" in reasons["b"] and "its prompt" in reasons["a"]
    assert reasons["c"] == "changed: its overrides"
    (data / "overrides.csv").unlink()
    assert told(data, out, asking(Redo.FAILED)).reasons["failed, and --retry-failed"] == ["c", "d"]
    assert told(data, out, asking(Redo.ALL)).reasons["--force"] == ["c", "d"]
    other = NO_VIEWS.model_copy(update={"physics": PhysicsSettings(hold_margin=2.5)})
    (c,) = (why for why, ids in told(data, out, other).reasons.items() if "c" in ids)
    assert c.startswith("changed: settings physics.hold_margin")
    assert tree(out) == before


def test_a_dry_plan_is_the_plan_of_the_run_that_follows(tmp_path: Path) -> None:
    data, out = dataset(tmp_path / "data"), tmp_path / "out"
    run(data, out, make=failing({"b": FailureMode.ENGINE_CRASH}))
    manifest(data, {"a": "", "b": "", "c": "wide", "d": ""})
    dry = told(data, out).plan
    real = run(data, out)
    assert [ref.asset_id for ref in dry.todo] == [ref.asset_id for ref in real.todo] == ["b", "c"]
    assert (dry.unchanged, dry.hashes, dry.why) == (real.unchanged, real.hashes, real.why)


@pytest.mark.system
def test_what_it_takes_is_read_from_the_history(tmp_path: Path) -> None:
    data, out = dataset(tmp_path / "data"), tmp_path / "out"
    run(data, out)
    found = told(data, out, asking(Redo.ALL)).expected
    # Each record of the factory has a call that was paid for, 1000 + 200 tokens at 0.01 USD, and one from the cache.
    assert (found.calls, found.prompt_tokens, found.completion_tokens) == (8.0, 8000.0, 1600.0)
    assert found.cost_usd == pytest.approx(0.08) and found.assets == 4 and not found.others
    assert found.work_s == pytest.approx(8.4) and found.wall_s == pytest.approx(4.2)
    other = NO_VIEWS.model_copy(update={"model": ModelSettings(model="openai/gpt-4o", run_calls=3)})
    guessed = told(data, out, other).expected
    assert guessed.others and guessed.calls == 8.0 and guessed.cost_usd and guessed.cost_usd > 0.0
    lines = expected_lines(guessed, other, 4)
    assert "of other models" in lines[1] and lines[2].endswith("--budget-calls 3 allows")
    assert expected_lines(told(tmp_path / "data", tmp_path / "none").expected, NO_VIEWS, 4)[0].startswith(
        "expected: not known"
    )


def test_the_command_says_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data, out = dataset(tmp_path / "data"), tmp_path / "out"

    def never(request: object) -> object:
        raise AssertionError(f"a dry run must not start: {request}")

    for command in ("refine", "nightly"):
        words = [command, str(data), "--out", str(out), "--dry-run"]
        assert run_command(words, refine=never, nightly=never) == 0  # type: ignore[arg-type]
        assert "4 of 4 assets would be refined" in capsys.readouterr().out
    assert not out.exists() and GATE == 3
    assert [duration(s) for s in (3.2, 600.0, 7500.0)] == ["3 s", "10 min", "2 h 05 min"]
    assert RunSettings().max_timeouts == 3
