"""The history of all runs: what a run leaves there, and what changed between two runs."""

import shutil
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow.parquet as pq
import pytest

from asset2sim.catalog.failures import compare_runs, failures_by, find_run
from asset2sim.catalog.history import history_files, remove_old_history
from asset2sim.catalog.read import latest_rows, query, read_table
from asset2sim.catalog.run import RunRow
from asset2sim.catalog.write import write_run
from schemas.asset import AssetRecord, AssetRef, Unchanged
from schemas.errors import UnknownChoiceError, UsageError
from schemas.tables import COST_COLUMNS, OUTCOME_COLUMNS
from schemas.vocabulary import FailureMode, Grouping, Status
from tests.factories import make_failure, make_record

OK = FailureMode.NONE


def night(day: int, month: int = 11) -> RunRow:
    """The run of a night at two o'clock."""
    start = datetime(2026, month, day, 2, tzinfo=UTC)
    return RunRow(run_id=f"{start:%Y%m%dT%H%M%S}-aaaa", started_at=start, finished_at=start, dataset="data")


def ended(**modes: FailureMode) -> list[AssetRecord]:
    """A record for each asset, failed in its mode or not at all."""
    return [make_record(name) if mode is OK else make_failure(name, mode) for name, mode in modes.items()]


def left(*names: str) -> list[Unchanged]:
    return [Unchanged(asset_id=name, status=Status.OK, failure_mode=OK) for name in names]


def kept(out: Path, *columns: str) -> list[tuple[Any, ...]]:
    rows = read_table(out, "asset_history").sort_values(["started_at", "asset_id"])
    return list(rows[list(columns)].itertuples(index=False, name=None))


def test_a_run_leaves_a_row_for_each_of_its_assets_and_unchanged_ones_cost_nothing(tmp_path: Path) -> None:
    write_run(tmp_path, night(1), ended(a=OK, b=FailureMode.JAM, other=OK))
    write_run(tmp_path, night(2), ended(b=OK), left("a"))
    assert kept(tmp_path, "run_id", "asset_id", "status", "unchanged", "queries") == [
        ("20261101T020000-aaaa", "a", "ok", False, 1),
        ("20261101T020000-aaaa", "b", "failed", False, 0),
        ("20261101T020000-aaaa", "other", "ok", False, 1),
        ("20261102T020000-aaaa", "a", "ok", True, 0),
        ("20261102T020000-aaaa", "b", "ok", False, 1),
    ]
    rows, assets = read_table(tmp_path, "asset_history"), read_table(tmp_path, "assets").set_index("asset_id")
    unchanged = rows[rows["unchanged"]].iloc[0]
    assert (unchanged[list(COST_COLUMNS)] == 0).all()
    for name in OUTCOME_COLUMNS:
        assert str(unchanged[name]) == str(assets.loc["a", name]), name
    assert (rows[~rows["unchanged"] & (rows["status"] == "ok")]["seconds_total"] > 0).all()


def test_files_lie_by_the_month_of_the_start_and_pandas_opens_the_folder(tmp_path: Path) -> None:
    for run in (night(30, 11), night(1, 12), night(2, 12)):
        write_run(tmp_path, run, ended(a=OK))
    assert [path.relative_to(tmp_path).as_posix() for path in history_files(tmp_path)] == [
        "history/month=2026-11/20261130T020000-aaaa.parquet",
        "history/month=2026-12/20261201T020000-aaaa.parquet",
        "history/month=2026-12/20261202T020000-aaaa.parquet",
    ]
    (tmp_path / "history" / "month=2026-12" / ".half.parquet.part").write_bytes(b"half")
    whole = pd.read_parquet(tmp_path / "history")
    assert whole["month"].astype(str).tolist() == ["2026-11", "2026-12", "2026-12"]
    assert query(tmp_path, "SELECT count(*) AS n FROM asset_history")["n"].tolist() == [3]
    write_run(tmp_path, night(2, 12), ended(a=FailureMode.DRIFT))
    assert kept(tmp_path, "failure_mode") == [("none",), ("none",), ("drift",)]
    assert not (tmp_path / "history" / "month=2026-12" / ".half.parquet.part").exists()


def test_a_file_of_another_version_is_read_with_nulls(tmp_path: Path) -> None:
    for day in (1, 2):
        write_run(tmp_path, night(day), ended(a=OK))
    first = history_files(tmp_path)[0]
    pq.write_table(pq.read_table(first, partitioning=None).drop_columns(["peak_speed_m_s"]), first)
    assert read_table(tmp_path, "asset_history")["peak_speed_m_s"].isna().tolist().count(True) == 1


def test_two_runs_held_against_each_other(tmp_path: Path) -> None:
    write_run(tmp_path, night(1), ended(a=OK, b=FailureMode.JAM, c=FailureMode.JAM, d=OK, e=OK, f=FailureMode.DROP))
    write_run(tmp_path, night(2), [*ended(a=FailureMode.HOLD, b=OK, c=FailureMode.DRIFT, g=OK),
                                   make_failure("f", FailureMode.DROP)], left("e"))  # fmt: skip
    found = compare_runs(tmp_path, "previous", "latest")
    assert found[["change", "asset_id", "before", "after"]].fillna("").values.tolist() == [
        ["broke", "a", "none", "hold"],
        ["fails otherwise", "c", "jam", "drift"],
        ["mended", "b", "jam", "none"],
        ["came", "g", "", "none"],
        ["went", "d", "none", ""],
    ]
    assert found["reason"].iloc[0] == "bad_file: cannot go on"
    assert find_run(tmp_path, "20261101") == night(1).run_id
    with pytest.raises(UsageError, match="the beginning of 2 runs"):
        find_run(tmp_path, "2026")
    with pytest.raises(UnknownChoiceError, match="unknown run 'yesterday'; choose from: 20261101"):
        find_run(tmp_path, "yesterday")
    elsewhere = night(3).model_copy(update={"dataset": "other"})
    write_run(tmp_path, elsewhere, ended(a=OK))
    with pytest.raises(UsageError, match="is the first over this part of its dataset"):
        find_run(tmp_path, "previous")


def test_failures_since_a_day_count_every_night(tmp_path: Path) -> None:
    write_run(tmp_path, night(1), ended(a=FailureMode.JAM, b=OK))
    write_run(tmp_path, night(2), ended(a=FailureMode.JAM, b=FailureMode.DROP))
    write_run(tmp_path, night(3), ended(a=FailureMode.JAM), left("b"))
    every = failures_by(tmp_path, Grouping.FAILURE_MODE, datetime(2026, 11, 2, tzinfo=UTC))
    assert every[["failure_mode", "assets", "failures", "causes"]].values.tolist() == [
        ["drop", 1, 2, "Box ×2"],
        ["jam", 1, 2, "Box ×2"],
    ]
    assert every["share_percent"].tolist() == [50.0, 50.0]
    assert every["first_at"].dt.day.tolist() == [2, 2] and every["last_at"].dt.day.tolist() == [3, 3]
    since_first = failures_by(tmp_path, Grouping.ASSET, datetime(2026, 11, 1, tzinfo=UTC))
    assert since_first[["asset_id", "failures", "share_percent", "causes"]].values.tolist() == [
        ["a", 3, 100.0, "jam ×3"],
        ["b", 2, pytest.approx(200.0 / 3.0), "drop ×2"],
    ]
    now = failures_by(tmp_path, Grouping.CATEGORY)
    assert now[["category", "assets", "failures", "causes"]].values.tolist() == [["Box", 2, 2, "drop ×1, jam ×1"]]
    write_run(tmp_path, night(4), [make_failure("n", FailureMode.JAM, ref=AssetRef(asset_id="n", path="n"))])
    unnamed = failures_by(tmp_path, Grouping.SUBSET).fillna("none")
    assert unnamed[["subset", "assets"]].values.tolist() == [["paper9", 2], ["none", 1]]
    assert failures_by(tmp_path, Grouping.FAILURE_MODE, datetime(2027, 1, 1, tzinfo=UTC)).empty


def test_the_latest_run_s_rows_are_those_of_unchanged_assets_too(tmp_path: Path) -> None:
    write_run(tmp_path, night(1), ended(a=OK, b=OK, c=OK))
    write_run(tmp_path, night(2), ended(a=OK), left("b"))
    assets, links = latest_rows(tmp_path, "assets", "links")
    assert sorted(assets["asset_id"]) == ["a", "b"] and sorted(set(links["asset_id"])) == ["a", "b"]
    shutil.rmtree(tmp_path / "history")
    assert latest_rows(tmp_path, "assets")[0]["asset_id"].tolist() == ["a"]


def test_what_is_too_old_is_removed_and_the_newest_of_each_dataset_is_not(tmp_path: Path) -> None:
    other = night(1, 7).model_copy(update={"run_id": "other", "dataset": "elsewhere"})
    write_run(tmp_path, other, ended(z=OK))
    for month, day in ((7, 2), (8, 1), (8, 30), (10, 1), (10, 30)):
        write_run(tmp_path, night(day, month), ended(a=OK, b=OK))
    said = remove_old_history(tmp_path, night(1).started_at, 40)
    assert said == "history: removed 6 rows of 3 runs from before 2026-09-22"
    starts = [start for start, _ in kept(tmp_path, "run_id", "asset_id")]
    assert starts == ["other", *["20261001T020000-aaaa"] * 2, *["20261030T020000-aaaa"] * 2]
    assert [path.parent.name for path in history_files(tmp_path)] == ["month=2026-07", *["month=2026-10"] * 2]
    assert remove_old_history(tmp_path, night(1).started_at, 40) is None
    assert len(read_table(tmp_path, "runs")) == 6, "runs are small, and stay"
    assert not list((tmp_path / "history").glob(".*"))
    # A year in which nothing ran: the last night is still there to compare with.
    assert remove_old_history(tmp_path, night(30, 12).started_at, 1) is not None
    assert {run for run, _ in kept(tmp_path, "run_id", "asset_id")} == {"other", "20261030T020000-aaaa"}
