"""Assets that take too long night after night: three are enough."""

from pathlib import Path

from asset2sim.catalog.read import read_table
from asset2sim.runs.plan.timeouts import LEFT_ALONE, with_left_alone
from schemas.asset import AssetRecord, AssetRef
from schemas.settings import RunSettings, Settings
from schemas.vocabulary import FailureMode, Redo
from tests.factories import make_failure
from tests.incremental_runs import NO_VIEWS, dataset, done, good, manifest, run


def limited(seconds: float = 300.0, redo: Redo = Redo.CHANGED) -> Settings:
    return NO_VIEWS.model_copy(update={"run": RunSettings(asset_time_limit_s=seconds, redo=redo)})


def late(before: int, settings: Settings) -> "object":
    def make(ref: AssetRef) -> AssetRecord:
        if ref.asset_id != "b":
            return good(ref)
        return with_left_alone(make_failure("b", FailureMode.TIMEOUT, ref=ref), before, settings.run)

    return make


def test_the_third_timeout_in_a_row_is_the_last_until_something_changes(tmp_path: Path) -> None:
    data, out = dataset(tmp_path / "data", ("a", "b")), tmp_path / "out"
    for before in range(3):
        plan = run(data, out, limited(), late(before, limited()))  # type: ignore[arg-type]
        assert done(plan).endswith("b") and plan.timeouts.get("b", 0) == before
    row = read_table(out, "assets").set_index("asset_id").loc["b"]
    assert row["failure_mode"] == "timeout" and "3 runs in a row, and is left alone" in row["reason"]
    assert LEFT_ALONE in set(read_table(out, "findings")["code"])
    for _ in range(2):
        plan = run(data, out, limited(), late(3, limited()))  # type: ignore[arg-type]
        assert done(plan) == "" and [item.asset_id for item in plan.unchanged] == ["a", "b"]
    assert done(run(data, out, limited(redo=Redo.FAILED), late(3, limited()))) == "b"  # type: ignore[arg-type]
    assert done(run(data, out, limited(), late(4, limited()))) == ""  # type: ignore[arg-type]
    assert done(run(data, out, limited(600.0), late(4, limited(600.0)))) == "b", "it has more time now"  # type: ignore[arg-type]
    assert done(run(data, out, limited(600.0))) == ""
    manifest(data, {"a": "", "b": "smaller"})
    plan = run(data, out, limited(600.0), late(0, limited()))  # type: ignore[arg-type]
    assert done(plan) == "b" and plan.timeouts == {}, "another content begins anew"
    assert done(run(data, out, limited(600.0))) == "b"


def test_no_other_failure_and_no_shorter_row_is_left_alone() -> None:
    run_settings = RunSettings()
    once = make_failure("b", FailureMode.TIMEOUT)
    assert with_left_alone(once, 1, run_settings) == once
    assert with_left_alone(once, 9, RunSettings(max_timeouts=0)) == once
    crash = make_failure("b", FailureMode.ENGINE_CRASH)
    assert with_left_alone(crash, 9, run_settings) == crash
