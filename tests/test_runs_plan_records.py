"""What a killed run leaves to the next: the rest is finished, and the tables are those of an undisturbed one."""

import json
import os
import shutil
import signal
from functools import partial
from pathlib import Path

import pytest

from asset2sim.catalog import history, switch
from asset2sim.catalog import write as store
from asset2sim.catalog.index import write_index
from asset2sim.catalog.read import read_table
from asset2sim.catalog.run import finish_run, start_run
from asset2sim.catalog.write import write_run
from asset2sim.intake.dataset import load_dataset
from asset2sim.runs.plan import plan, records, state
from asset2sim.runs.plan.hand_changes import SET_ASIDE, set_aside
from asset2sim.runs.plan.plan import make_plan, mark_published
from asset2sim.runs.plan.records import KeptRecord, keep_record, kept_records, record_file
from asset2sim.runs.plan.timeouts import LEFT_ALONE, with_left_alone
from schemas.asset import AssetRecord, AssetRef
from schemas.settings import RunSettings, Settings
from schemas.vocabulary import FailureMode, Method, Redo, Severity
from tests.factories import make_failure, make_finding, make_measurement, make_record
from tests.incremental_runs import NAMES, NO_VIEWS, Make, asking, dataset, done, failing, good, manifest, run, timeless
from tests.killing import killed_at


def test_a_record_is_kept_to_the_last_bit(tmp_path: Path) -> None:
    measured = make_measurement(finite=False, drift_m=0.1 + 0.2)
    exploded = make_finding(Severity.ERROR, "peak_speed").model_copy(update={"value": float("inf")})
    record = make_record("é", measurement=measured, findings=(exploded,), content_hash="0" * 64)
    kept = KeptRecord(run_id="r", redo=Redo.CHANGED, record=record)
    keep_record(tmp_path, kept)
    (found,) = kept_records(tmp_path)
    assert found == kept
    record_file(tmp_path, "0" * 64).write_text('{"half": ')
    (tmp_path / records.RECORDS_FOLDER / "left.part").write_text("")
    assert list(kept_records(tmp_path)) == [] and not list((tmp_path / records.RECORDS_FOLDER).iterdir())


MODES = failing({"b": FailureMode.TIMEOUT})
WATCHED = {module.__file__ for module in (plan, records, state, store, switch, history)}


def dying(after: int) -> Make:
    """A pipeline whose second asset runs out of time, and which takes its run along after so many assets."""
    made: list[str] = []

    def make(ref: AssetRef) -> AssetRecord:
        if len(made) == after:
            os.kill(os.getpid(), signal.SIGKILL)
        made.append(ref.asset_id)
        return MODES(ref)

    return make


@pytest.mark.system
@pytest.mark.parametrize("redo", [Redo.CHANGED, Redo.ALL])
def test_a_run_that_is_killed_anywhere_and_started_again_finishes_the_rest(tmp_path: Path, redo: Redo) -> None:
    data, settings = dataset(tmp_path / "data"), asking(redo)
    if redo is Redo.ALL:
        run(data, tmp_path / "template", make=MODES)
        shutil.copytree(tmp_path / "template", tmp_path / "undisturbed")
    run(data, tmp_path / "undisturbed", settings, MODES)
    expected = timeless(tmp_path / "undisturbed")
    resumed, killed = set(), True
    for line, after in [*((-1, after) for after in range(4)), *((line, 9) for line in range(40, 100_000, 151))]:
        out = tmp_path / f"{line} {after}"
        if redo is Redo.ALL:
            shutil.copytree(tmp_path / "template", out)
        else:
            out.mkdir()
        killed = killed_at(line, WATCHED, partial(run, data, out, settings, dying(after)))
        left = {kept.record.ref.asset_id for kept in kept_records(out)}
        published = len(read_table(out, "runs")) > (redo is Redo.ALL) if (out / "catalog").exists() else False
        again = run(data, out, settings, MODES)
        if not published:
            resumed.add(len(again.finished))
            assert {ref.asset_id for ref in again.finished.refs} == left
            assert {ref.asset_id for ref in again.todo} == set(NAMES) - left
        assert timeless(out) == expected, f"killed before line {line} or after {after} assets"
        past = read_table(out, "asset_history").groupby("run_id")["asset_id"].agg(list).to_dict()
        assert past == {run_id: list(NAMES) for run_id in read_table(out, "runs")["run_id"]}
        assert not list((out / records.RECORDS_FOLDER).iterdir())
        assert not list((out / "history").glob("**/.*"))
        if not killed:
            break
    assert not killed and resumed >= {0, 1, 2, 3, 4}


def test_a_killed_forced_run_is_not_taken_for_an_unforced_one_and_the_other_way_round(tmp_path: Path) -> None:
    data, out = dataset(tmp_path / "data"), tmp_path / "out"
    first = run(data, out)
    record = make_record("a", content_hash=first.hashes["a"])
    keep_record(out, KeptRecord(run_id="killed", redo=Redo.CHANGED, record=record))
    forced = run(data, out, asking(Redo.ALL))
    assert done(forced) == "abcd" and not forced.finished
    keep_record(out, KeptRecord(run_id="killed", redo=Redo.ALL, record=record))
    assert done(run(data, out, asking(Redo.ALL))) == "bcd"


def test_what_met_a_full_disk_in_a_run_that_broke_down_is_done_again(tmp_path: Path) -> None:
    """There was just room for the record, and for nothing else; now there may be more."""
    data, out = dataset(tmp_path / "data"), tmp_path / "out"
    hashes = run(data, tmp_path / "elsewhere").hashes
    for asset_id, mode in (("a", FailureMode.DISK_FULL), ("b", FailureMode.TIMEOUT)):
        record = make_failure(asset_id, mode).model_copy(update={"content_hash": hashes[asset_id]})
        keep_record(out, KeptRecord(run_id="killed", redo=Redo.CHANGED, record=record))
    again = run(data, out)
    assert done(again) == "acd" and [ref.asset_id for ref in again.finished.refs] == ["b"]


def test_what_a_killed_run_of_another_method_left_is_dropped_with_its_folder(tmp_path: Path) -> None:
    data, out = dataset(tmp_path / "data"), tmp_path / "out"
    hashes = run(data, tmp_path / "elsewhere").hashes
    keep_record(out, KeptRecord(run_id="killed", redo=Redo.CHANGED, record=make_record("a", content_hash=hashes["a"])))
    (out / "assets" / "a").mkdir(parents=True)
    raw = NO_VIEWS.model_copy(update={"method": Method.RAW})
    run(data, out, raw, lambda ref: make_record(ref.asset_id, ref=ref, method=Method.RAW))
    assert done(run(data, out)) == "abcd"


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


def night(data: Path, out: Path, settings: Settings = NO_VIEWS, make: Make = good, writes: str = "") -> None:
    """Run as the flow does; the assets in ``writes``, and those that pass, get a new folder."""
    out.mkdir(exist_ok=True)
    started, refs = start_run(settings, str(data)), load_dataset(data)
    plan = make_plan(refs, out, settings, "p")
    records = []
    for ref in plan.todo:
        record = make(ref).model_copy(update={"content_hash": plan.hashes[ref.asset_id], "method": settings.method})
        folder = out / "assets" / ref.asset_id
        if record.overlay is not None or ref.asset_id in writes:
            staged = out / "assets" / f".{ref.asset_id}"
            staged.mkdir(parents=True)
            for name in ("mobility.urdf", "overlay.json"):
                (staged / name).write_text(json.dumps({"run": started.run_id}))
            if folder.exists():
                folder.rename(out / "assets" / f".old-{ref.asset_id}-{started.run_id}")
            staged.rename(folder)
        records.append(record)
    kept = [set_aside(out, record, plan.owned.get(record.ref.asset_id)) for record in records]
    write_run(out, finish_run(started), kept, plan.unchanged)
    write_index(out)
    mark_published(out, kept)


def paths(out: Path) -> dict[str, str | None]:
    """Asset id → what the index names to load."""
    document = json.loads((out / "assets" / "index.json").read_text())
    return {item["asset_id"]: item["path"] for item in document["assets"]}


def test_an_old_folder_goes_aside_and_comes_to_an_end_with_the_next_success(tmp_path: Path) -> None:
    data, out = dataset(tmp_path / "data", ("a", "b", "c")), tmp_path / "out"
    night(data, out)
    first = (out / "assets" / "a" / "overlay.json").read_text()
    modes = {"a": FailureMode.MODEL_ERROR, "b": FailureMode.PENETRATION}
    night(data, out, asking(Redo.ALL), failing(modes), writes="b")
    assert not (out / "assets" / "a").exists() and (out / SET_ASIDE / "a" / "overlay.json").read_text() == first
    assert (out / "assets" / "b").is_dir() and not (out / SET_ASIDE / "b").exists(), "what failed this night is its own"
    assert paths(out) == {"a": None, "b": "b", "c": "c"}
    found = read_table(out, "findings").query(f"code == '{SET_ASIDE}'")
    assert found["asset_id"].tolist() == ["a"] and f"{SET_ASIDE}/a" in found["message"].iloc[0]
    night(data, out, NO_VIEWS, failing({"a": FailureMode.MODEL_ERROR}))
    assert (out / SET_ASIDE / "a" / "overlay.json").read_text() == first, "a second failure keeps it"
    night(data, out)
    assert paths(out)["a"] == "a" and not (out / SET_ASIDE / "a").exists()


def test_a_folder_that_another_method_wrote_is_not_ours_to_move(tmp_path: Path) -> None:
    data, out = dataset(tmp_path / "data", ("a",)), tmp_path / "out"
    direct = asking(Redo.ALL).model_copy(update={"method": Method.DIRECT})
    night(data, out, direct)
    night(data, out)
    night(data, out, direct, failing({"a": FailureMode.MODEL_ERROR}))
    assert (out / "assets" / "a").is_dir() and not (out / SET_ASIDE).exists()
    assert make_record().method is Method.ASSET2SIM
