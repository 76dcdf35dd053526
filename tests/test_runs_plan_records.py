"""What a killed run leaves to the next: the rest is finished, and the tables are those of an undisturbed one."""

import os
import shutil
import signal
from functools import partial
from pathlib import Path

import pytest

from asset2sim.catalog import history, switch
from asset2sim.catalog import write as store
from asset2sim.catalog.read import read_table
from asset2sim.runs.plan import plan, records, state
from asset2sim.runs.plan.records import KeptRecord, keep_record, kept_records, record_file
from schemas.asset import AssetRecord, AssetRef
from schemas.vocabulary import FailureMode, Method, Redo, Severity
from tests.factories import make_failure, make_finding, make_measurement, make_record
from tests.incremental_runs import NAMES, NO_VIEWS, Make, asking, dataset, done, failing, run, timeless
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
