"""The catalog: rows, schema on write, merge by key, one switch for all tables, reading."""

import io
import os
import shutil
import signal
import time
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rich.console import Console

from asset2sim.catalog import switch
from asset2sim.catalog import write as store
from asset2sim.catalog.changes import find_changes, read_previous
from asset2sim.catalog.enforce import CatalogError, to_arrow
from asset2sim.catalog.failures import compare_runs, failure_breakdown, failures_by
from asset2sim.catalog.read import latest_rows, query, read_table
from asset2sim.catalog.rows import asset_row, asset_rows, joint_rows, run_row, trace_rows
from asset2sim.catalog.run import finish_run, start_run, without_credentials
from asset2sim.catalog.show import describe_asset
from asset2sim.catalog.stored_tables import check_catalog
from asset2sim.catalog.summarize import summarize_all
from asset2sim.catalog.write import write_run
from asset2sim.storage.lock import lock_output
from flows.schedule import nightly_schedule
from schemas.errors import UnknownChoiceError, UsageError
from schemas.settings import ModelSettings, Settings, Thresholds
from schemas.table import Table
from schemas.tables import HISTORY, PUBLISHED, REVIEWS, TABLES
from schemas.vocabulary import FailureMode, Grouping
from tests.factories import (
    make_expected,
    make_failure,
    make_measurement,
    make_motion,
    make_record,
    make_run,
    make_run_records,
)
from tests.killing import killed_at

CATALOG_FILE = Path(__file__).resolve().parents[1] / "catalog.yaml"
SWITCH_AND_STORE = {switch.__file__, store.__file__}


def columns(out: Path, name: str, *wanted: str) -> list[tuple[Any, ...]]:
    return list(read_table(out, name)[list(wanted)].itertuples(index=False, name=None))


# Rows


def test_an_asset_row_holds_hand_computed_numbers() -> None:
    row = asset_row(make_run("r"), make_record())
    assert row["penetration_mm"] == pytest.approx(0.5)
    assert row["deepest_contact_mm"] == pytest.approx(0.3)
    assert row["mass_kg"] == pytest.approx(0.01 + 2.0 + 0.5 + 0.49)
    assert (row["size_x_m"], row["n_links"], row["n_joints"]) == (0.25, 4, 2)
    assert (row["queries"], row["cached_calls"], row["prompt_tokens"], row["cost_usd"]) == (1, 1, 1000, 0.01)
    assert row["seconds_total"] == pytest.approx(0.1 + 0.2 + 0.3 + 0.4 + 0.5 + 0.6)
    assert row["seconds_publish"] is None
    assert row["processor_s_total"] is None, "its process died"
    spent = asset_row(
        make_run("r"), make_record().model_copy(update={"processor_s": {"extract": 0.25, "measure": 1.5}})
    )
    assert (spent["processor_s_measure"], spent["processor_s_apply"], spent["processor_s_total"]) == (1.5, None, 1.75)


def test_what_was_never_measured_is_null_not_zero(tmp_path: Path) -> None:
    write_run(tmp_path, make_run("r"), [make_failure("1", FailureMode.MISSING_MESH)])
    row = read_table(tmp_path, "assets").iloc[0]
    unmeasured = [
        "penetration_mm", "drift_m", "drift_rad", "oscillating_joints", "scale", "mass_kg", "n_links", "finite",
    ]  # fmt: skip
    assert row[unmeasured].isna().all()
    assert row["queries"] == 0 and row["paper_failure_mode"] == "segmentation problem"


def test_a_simulation_that_left_the_finite_numbers_keeps_phi_and_loses_drift() -> None:
    row = asset_row(make_run("r"), make_record(measurement=make_measurement(finite=False, drift_m=0.0)))
    assert row["penetration_mm"] == pytest.approx(0.5)
    assert row["drift_m"] is None and row["drift_rad"] is None and row["finite"] is False


def test_a_table_that_an_earlier_version_did_not_have_reads_as_empty(tmp_path: Path) -> None:
    write_run(tmp_path, make_run("r"), [make_record("1")])
    (tmp_path / "catalog" / "alignment.parquet").unlink()
    assert read_table(tmp_path, "alignment").empty and not read_table(tmp_path, "assets").empty
    write_run(tmp_path, make_run("s"), [make_record("1")])
    assert columns(tmp_path, "alignment", "alignment", "scale_deviation", "joint_deviation_rad") == [(0.75, 0.25, 0.2)]


def test_oscillation_is_judged_by_the_joint_s_type() -> None:
    limits = Thresholds()
    motions = (
        make_motion("hinge", amplitude=0.02, sign_changes=5),
        make_motion("slider", amplitude=0.02, sign_changes=5),
    )
    record = make_record(measurement=make_measurement(joints=motions))
    assert {row["joint"]: row["oscillates"] for row in joint_rows({}, record, limits)} == {
        "hinge": False,
        "slider": True,
    }
    few = (make_motion("hinge", amplitude=1.0, sign_changes=2), make_motion("slider", amplitude=1.0, sign_changes=3))
    assert asset_row(make_run("r"), make_record(measurement=make_measurement(joints=few)))["oscillating_joints"] == 1


def test_every_table_takes_the_rows_that_are_made_for_it() -> None:
    records = make_run_records(2, [FailureMode.TIMEOUT])
    runs = {"runs": [run_row(make_run("r"), summarize_all(records))]}
    for made in (*(asset_rows(make_run("r"), record) for record in records), runs):
        for name, rows in made.items():
            built = to_arrow(TABLES[name], rows)
            assert built.schema.equals(TABLES[name].schema, check_metadata=True)
    assert trace_rows({}, records[0])[0]["phi_before_mm"] == pytest.approx(4.0)


def test_every_column_is_described_and_keys_are_required() -> None:
    for table in TABLES.values():
        assert all(field.metadata[b"description"] for field in table.schema), table.name
        assert not any(table.schema.field(name).nullable for name in table.key), table.name
        assert "run_id" in table.schema.names


# Schema on write


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"scale": "large"}, "table 'assets', column 'scale'"),
        ({"n_links": 1.5}, "table 'assets', column 'n_links'"),
        ({"category": None}, "table 'assets', column 'category': null in row 0"),
        ({"colour": "red"}, "table 'assets', column 'colour': unknown"),
    ],
)
def test_a_row_that_does_not_fit_names_table_and_column(change: dict[str, object], message: str) -> None:
    row = asset_row(make_run("r"), make_record()) | change
    with pytest.raises(CatalogError, match=message):
        to_arrow(TABLES["assets"], [row])


def test_a_missing_column_and_a_repeated_key_are_refused() -> None:
    row = asset_row(make_run("r"), make_record("7"))
    with pytest.raises(CatalogError, match="more than one row with asset_id='7'"):
        to_arrow(TABLES["assets"], [row, row])
    del row["prompt"]
    with pytest.raises(CatalogError, match="column 'prompt': missing"):
        to_arrow(TABLES["assets"], [row])


def test_a_refused_run_leaves_the_tables_as_they_were(tmp_path: Path) -> None:
    write_run(tmp_path, make_run("good"), [make_record("1")])
    with pytest.raises(CatalogError):
        write_run(tmp_path, make_run("bad"), [make_record("2"), make_record("2")])
    assert columns(tmp_path, "runs", "run_id") == [("good",)]


def test_a_catalog_of_an_older_version_gains_columns_and_one_of_a_newer_is_refused(tmp_path: Path) -> None:
    write_run(tmp_path, make_run("first"), [make_record("1")])
    path = tmp_path / "catalog" / "assets.parquet"
    current = pq.read_table(path)
    pq.write_table(current.drop_columns(["peak_speed_m_s"]), path)
    write_run(tmp_path, make_run("second"), [make_record("2")])
    assert read_table(tmp_path, "assets")["peak_speed_m_s"].isna().tolist() == [True, False]
    pq.write_table(current.append_column("later", pa.array([1])), path)
    with pytest.raises(CatalogError, match="table 'assets', column 'later': unknown"):
        check_catalog(tmp_path)
    path.write_bytes(b"not parquet")
    with pytest.raises(CatalogError, match="cannot be read"):
        check_catalog(tmp_path)


# Merge

Runs = st.lists(
    st.dictionaries(st.sampled_from(["1", "12", "2", "a:b"]), st.sampled_from(["m", "n"]), max_size=4), max_size=4
)


@given(runs=Runs)
@settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_the_latest_run_of_each_asset_and_model_is_what_stays(
    tmp_path_factory: pytest.TempPathFactory, runs: list[Any]
) -> None:
    out = tmp_path_factory.mktemp("out")
    expected: dict[tuple[str, str], str] = {}
    for index, run in enumerate(runs):
        run_id = f"run{index}"
        # Every other run's assets failed: their links must go, and the others' stay.
        made = [
            make_record(a, model=m) if index % 2 == 0 else make_failure(a, FailureMode.DRIFT, model=m)
            for a, m in run.items()
        ]
        write_run(out, make_run(run_id), made)
        expected |= dict.fromkeys(run.items(), run_id)
    if not runs:
        return
    rows = columns(out, "assets", "asset_id", "model", "run_id")
    assert sorted(rows) == sorted((asset, model, run_id) for (asset, model), run_id in expected.items())
    linked = {(a, m): r for (a, m), r in expected.items() if int(r[3:]) % 2 == 0}
    links = columns(out, "links", "asset_id", "model", "run_id", "link")
    assert sorted(set(links)) == sorted(links) and len(links) == 4 * len(linked)
    assert {(a, m, r) for a, m, r, _ in links} == {(a, m, r) for (a, m), r in linked.items()}
    assert len(read_table(out, "findings")) == len(expected)
    assert columns(out, "runs", "run_id") == [(f"run{index}",) for index in range(len(runs))]


def test_writing_a_run_again_replaces_it(tmp_path: Path) -> None:
    write_run(tmp_path, make_run("r"), [make_record("1")])
    write_run(tmp_path, make_run("r"), [make_record("1"), make_record("2")])
    assert columns(tmp_path, "runs", "run_id", "assets") == [("r", 2)]
    assert columns(tmp_path, "assets", "asset_id") == [("1",), ("2",)]


def test_other_files_in_the_catalog_folder_stay(tmp_path: Path) -> None:
    write_run(tmp_path, make_run("first"), [make_record("1")])
    (tmp_path / "catalog" / "notes.txt").write_text("mine")
    write_run(tmp_path, make_run("second"), [make_record("1")])
    assert (tmp_path / "catalog" / "notes.txt").read_text() == "mine"
    assert not list(tmp_path.glob(".catalog*"))


# One switch for all tables


def state(out: Path) -> set[tuple[str, str]]:
    """(table, run) of every row; reading goes through the public functions."""
    per_table = " UNION ALL ".join(f"SELECT '{name}', run_id FROM {name}" for name in TABLES)
    return set(query(out, per_table).itertuples(index=False, name=None))


@pytest.mark.system
@pytest.mark.parametrize("exchange", [True, False], ids=["exchange", "two renames"])
@pytest.mark.parametrize("existing", [True, False], ids=["over a catalog", "the first"])
def test_a_killed_switch_leaves_the_whole_old_or_the_whole_new_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, exchange: bool, existing: bool
) -> None:
    if not exchange:
        monkeypatch.setattr(switch, "swap_names", lambda first, second: False)

    def publish(out: Path, content: str) -> None:
        switch.recover(out)
        with switch.replace_catalog(out) as folder:
            for name in ("a", "b"):
                (folder / name).write_text(content)

    def found(out: Path) -> str:
        folder = switch.find_catalog(out)
        return "".join((folder / name).read_text() for name in ("a", "b")) if folder else ""

    old = "11" if existing else ""
    seen = []
    for line in range(1, 1000, 2):
        out = tmp_path / str(line)
        out.mkdir()
        if existing:
            publish(out, "1")
        killed = killed_at(line, SWITCH_AND_STORE, lambda out=out: publish(out, "2"))  # type: ignore[misc]
        seen.append(found(out))
        assert seen[-1] in (old, "22"), f"killed before line {line}"
        # The next run puts right what was left, and loses nothing even if it does no more than that.
        switch.recover(out)
        assert found(out) == seen[-1] and (out / "catalog").is_dir() == bool(seen[-1])
        assert not list(out.glob(".catalog*"))
        if not killed:
            break
    assert len(seen) > 20 and seen[0] == old and seen[-1] == "22"


@pytest.mark.system
def test_a_killed_run_leaves_the_tables_of_one_run_and_the_next_adds_to_them(tmp_path: Path) -> None:
    records = [make_record("1", expected=(make_expected(),)), make_record("2")]
    old, new = {(name, "old") for name in TABLES}, {(name, "new") for name in TABLES} | {("runs", "old")}
    write_run(tmp_path / "template", make_run("old"), records)
    seen = []
    for line in range(1, 10_000, 41):
        out = tmp_path / str(line)
        shutil.copytree(tmp_path / "template", out)
        killed = killed_at(line, SWITCH_AND_STORE, lambda out=out: write_run(out, make_run("new"), records))  # type: ignore[misc]
        seen.append(state(out))
        assert seen[-1] in (old, new), f"killed before line {line}"
        if not killed:
            break
        write_run(out, make_run("next"), [make_record("3", expected=(make_expected(),))])
        assert state(out) == seen[-1] | {(name, "next") for name in TABLES}
    assert len(seen) > 3 and seen[0] == old and seen[-1] == new


@pytest.mark.system
def test_a_reader_never_sees_two_runs_at_once(tmp_path: Path) -> None:
    records = [make_record(str(index)) for index in range(3)]
    write_run(tmp_path, make_run("0"), records)
    enough = tmp_path / "enough"
    child = os.fork()
    if child == 0:
        try:
            for index in range(1, 40):
                write_run(tmp_path, make_run(str(index)), records)
                if enough.exists():
                    os._exit(0)
                time.sleep(0.02 * 1.25**index)  # longer each time, until the slowest reader gets between two of them
        except BaseException:
            os._exit(3)
        os._exit(4)
    seen = set[str]()
    try:
        # However busy the machine is: the writer goes on until the reader has seen three of its runs.
        while len(seen) < 3 and os.waitpid(child, os.WNOHANG) == (0, 0):
            with suppress(UsageError):  # "is being rewritten all the time": what a slow reader is told at first
                runs = {run for table, run in state(tmp_path) if table != "runs"}
                assert len(runs) == 1
                seen |= runs
    finally:
        enough.touch()
    assert os.waitpid(child, 0)[1] == 0


@pytest.mark.system
def test_the_lock_admits_one_run_and_goes_with_its_process(tmp_path: Path) -> None:
    out = tmp_path / "made" / "out"
    mine = rf"another run \(process {os.getpid()}\) is writing"
    with lock_output(out), pytest.raises(UsageError, match=mine), lock_output(out):
        pass
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        with lock_output(out):
            os.write(write, b"x")
            signal.pause()
    os.read(read, 1)
    with pytest.raises(UsageError, match=str(child)), lock_output(out):
        pass
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    with lock_output(out):
        pass


# Reading and the rest


def test_tables_open_with_pandas_alone(tmp_path: Path) -> None:
    write_run(tmp_path, make_run("r"), make_run_records(3))
    assert len(pd.read_parquet(tmp_path / "catalog" / "links.parquet")) == 12
    described = pq.read_schema(tmp_path / "catalog" / "links.parquet").field("mass_kg").metadata
    assert described[b"unit"] == b"kg"


KNOWN = {"method": "asset2sim", "model": "prior/household", "dataset": "data/raw", "position_unit": "rad"}
KINDS = {pa.string(): "text", pa.float64(): 0.5, pa.int64(): 1, pa.bool_(): True}


def filled(table: Table, row: dict[str, object]) -> dict[str, object]:
    """A row of a table from its schema alone: these values, one of the column's type, or null where that may be."""
    values = {field.name: None if field.nullable else KINDS.get(field.type, []) for field in table.schema}
    return {name: row.get(name, KNOWN.get(name, value)) for name, value in values.items()}


def test_tables_on_disk_are_read_by_every_command_and_taken_up_by_the_next_run(tmp_path: Path) -> None:
    ended = [("r1", 1, "a", "ok", "none"), ("r1", 1, "b", "ok", "none"),
             ("r2", 2, "a", "failed", "jam"), ("r2", 2, "b", "ok", "none")]  # fmt: skip
    rows = [
        {"run_id": run_id, "started_at": datetime(2026, 1, day, tzinfo=UTC), "asset_id": asset, "status": status,
         "failure_mode": mode, "finished_at": datetime(2026, 1, day, 1, tzinfo=UTC), "unchanged": 0}
        for run_id, day, asset, status, mode in ended
    ]  # fmt: skip
    latest = {"runs": rows[1:3]}
    (tmp_path / "catalog").mkdir()
    for table in TABLES.values():
        some = [filled(table, row) for row in latest.get(table.name, rows[2:])]
        pq.write_table(pa.Table.from_pylist(some, schema=table.schema), tmp_path / "catalog" / table.file)
    for run_id in ("r1", "r2"):
        some = [filled(HISTORY, row | {"unchanged": False}) for row in rows if row["run_id"] == run_id]
        file = tmp_path / "history" / "month=2026-01" / f"{run_id}.parquet"
        file.parent.mkdir(parents=True, exist_ok=True)
        pq.write_table(pa.Table.from_pylist(some, schema=HISTORY.schema), file)

    check_catalog(tmp_path)
    assert {name: len(read_table(tmp_path, name)) for name in PUBLISHED} == dict.fromkeys(TABLES, 2) | {
        HISTORY.name: 4, REVIEWS.name: 0}  # fmt: skip
    assert failure_breakdown(tmp_path)[["failure_mode", "assets"]].values.tolist() == [["none", 1], ["jam", 1]]
    assert failures_by(tmp_path, Grouping.CATEGORY)["failures"].tolist() == [1]
    assert compare_runs(tmp_path, "previous", "latest")[["change", "asset_id"]].values.tolist() == [["broke", "a"]]
    console = Console(width=200, file=io.StringIO(), record=True)
    console.print(describe_asset(tmp_path, "a"))
    assert "failed: jam" in console.export_text()
    assert [len(table) for table in latest_rows(tmp_path, "assets", "links")] == [2, 2]
    run = make_run("r3")
    before = read_previous(tmp_path, run)
    assert before.modes == {"a": "jam", "b": "none"}
    assert len(find_changes(summarize_all([make_record("a")]), before).mended) == 1
    write_run(tmp_path, run, [make_record("a")])
    assert len(read_table(tmp_path, HISTORY.name)) == 5
    assert {row["asset_id"]: row["run_id"] for row in read_table(tmp_path, "assets").to_dict("records")} == {
        "a": "r3", "b": "r2"}  # fmt: skip


def test_a_user_s_mistakes_are_one_line(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no catalog in"):
        read_table(tmp_path, "assets")
    with pytest.raises(
        UnknownChoiceError, match="'asset'; choose from: alignment, asset_history, assets, expectations, findings"
    ):
        read_table(tmp_path, "asset")
    write_run(tmp_path, make_run("r"), [make_record()])
    with pytest.raises(UsageError, match="the query failed") as caught:
        query(tmp_path, "SELECT colour FROM assets")
    assert "\n" not in str(caught.value)
    assert query(tmp_path, "SELECT asset_id FROM assets WHERE scale < ?", [1.0])["asset_id"].tolist() == ["100"]


def test_a_run_names_what_it_ran_on_and_no_password() -> None:
    run = finish_run(start_run(Settings(), "data/raw"), "interrupted")
    assert run.outcome == "interrupted" and run.finished_at >= run.started_at
    assert run.versions["pyarrow"] == pa.__version__
    assert without_credentials("http://me:secret@host/x") == "http://host/x"
    private = Settings(model=ModelSettings(api_base="https://me:secret@host/v1"))
    row = run_row(make_run("r").model_copy(update={"settings": private}), [])
    assert "secret" not in str(row) and "https://host/v1" in str(row)


def test_catalog_yaml_lists_every_table_with_grain_and_key() -> None:
    content = yaml.safe_load(CATALOG_FILE.read_text(encoding="utf-8"))
    assert content["version"] == 2
    assert set(content["entries"]) == set(content["aliases"]) == set(PUBLISHED)
    for name, table in PUBLISHED.items():
        entry = content["entries"][name]
        assert entry["metadata"] == {"description": table.description, "grain": table.grain, "key": list(table.key)}
        assert entry["kwargs"]["args"] == [f"{{data({name}_file)}}"]
        place = {"asset_history": "history", "reviews": "reviews"}.get(name, f"catalog/{table.file}")
        assert content["data"][f"{name}_file"]["kwargs"]["url"] == f"{{out}}/{place}"


def test_the_nightly_schedule_comes_from_catalog_yaml(tmp_path: Path) -> None:
    assert nightly_schedule(CATALOG_FILE) == ("0 2 * * *", "UTC")
    broken = tmp_path / "catalog.yaml"
    for text, message in (
        ("metadata: {}", "no schedule"),
        ("metadata: {nightly: {cron: '2 * *'}}", "needs five fields"),
        ("metadata: {nightly: {cron: '0 2 * * *', timezone: Mars/Base}}", "unknown timezone"),
        ("{", "is not YAML"),
    ):
        broken.write_text(text)
        with pytest.raises(UsageError, match=message):
            nightly_schedule(broken)
    with pytest.raises(UsageError, match="cannot read"):
        nightly_schedule(tmp_path / "absent.yaml")


def test_half_a_surrogate_pair_in_a_text_is_an_escape_and_no_dead_run() -> None:
    """As a category from JSON or a file's name may hold."""
    row = asset_row(make_run("r"), make_record()) | {"category": "a\udcff"}
    assert to_arrow(TABLES["assets"], [row]).column("category").to_pylist() == ["a\\udcff"]
