"""The failure-mode breakdown, and people's reviews beside it."""

import io
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pandas as pd
import pytest
from rich.console import Console

from asset2sim.catalog.failures import Review, failure_breakdown, render_failures, reviewed_failures
from asset2sim.catalog.own_files import OwnFile
from asset2sim.catalog.query import connect
from asset2sim.catalog.read import read_table
from asset2sim.catalog.run import start_run
from asset2sim.catalog.write import write_run
from asset2sim.viewer.walk import Show, chosen_stops, reviews_of, stops_of
from schemas.errors import UsageError
from schemas.settings import Settings
from schemas.table import Row
from schemas.tables import REVIEWS
from schemas.vocabulary import FailureMode
from tests.factories import MODEL, make_failure, make_record
from tests.object_store import Store
from tests.test_catalog_history import night
from tests.test_catalog_query import told


def rendered(out: Path) -> str:
    console = Console(width=160, record=True, file=io.StringIO())
    console.print(render_failures(failure_breakdown(out)))
    return console.export_text()


def test_counts_shares_causes_and_examples(tmp_path: Path) -> None:
    records = [make_record(f"{i}") for i in range(6)]
    records += [make_failure(f"m{i}", FailureMode.MISSING_MESH, "mesh_absent") for i in range(3)]
    records += [make_failure("t", FailureMode.TIMEOUT, "time_limit")]
    write_run(tmp_path, start_run(Settings(), "data"), records)
    found = failure_breakdown(tmp_path).set_index("failure_mode")
    assert found.index.tolist() == ["none", "missing_mesh", "timeout"]
    assert found["assets"].tolist() == [6, 3, 1]
    assert found["share_percent"].tolist() == pytest.approx([60.0, 30.0, 10.0])
    assert found.loc["missing_mesh", "causes"] == "mesh_absent ×3"
    assert found.loc["missing_mesh", "paper_failure_mode"] == "segmentation problem"
    assert found["example_asset_ids"].iloc[0].tolist() == ["0", "1", "2", "3", "4"]
    text = rendered(tmp_path)
    assert "none (ok)" in text and "60.0" in text and "time_limit ×1" in text and MODEL in text
    assert found.loc["missing_mesh", "reason"] == "mesh_absent: cannot go on"
    assert "reason of the" in text and "mesh_absent: cannot" in text and "time_limit: cannot" in text
    assert not isinstance(found.loc["timeout", "paper_failure_mode"], str), "the paper has no name for it"


def test_models_are_counted_apart(tmp_path: Path) -> None:
    write_run(tmp_path, start_run(Settings(), "data"), [make_record("1"), make_record("2")])
    write_run(tmp_path, start_run(Settings(), "data"), [make_failure("1", FailureMode.DRIFT, model="other/model")])
    found = failure_breakdown(tmp_path)
    assert found[["model", "failure_mode", "assets", "share_percent"]].values.tolist() == [
        ["other/model", "drift", 1, 100.0],
        [MODEL, "none", 2, 100.0],
    ]
    assert "other/model" in rendered(tmp_path)


NOW = datetime(2026, 11, 2, 8, tzinfo=UTC)


def review(asset_id: str, run_id: str, verdict: str = "bad", note: str = "", minutes: int = 0) -> Row:
    return Review(run_id, asset_id, "asset2sim", MODEL, NOW + timedelta(minutes=minutes), "ann", verdict, note).row


def two_nights(out: Path) -> None:
    """``b`` breaks in the second night, and ``c`` goes on failing."""
    jam = make_failure("c", FailureMode.JAM)
    write_run(out, night(1), [make_record("a"), make_record("b"), jam])
    write_run(out, night(2), [make_record("a"), make_failure("b", FailureMode.DRIFT), jam])


def test_the_next_run_neither_loses_nor_rewrites_reviews(tmp_path: Path) -> None:
    two_nights(tmp_path)
    assert read_table(tmp_path, "reviews").empty
    mine, yours = OwnFile(tmp_path, REVIEWS), OwnFile(tmp_path, REVIEWS)
    mine.add([review("b", night(2).run_id, note="sticks | at the end, 'half' open")])
    yours.add([review("c", night(2).run_id, "good", minutes=1)])
    mine.add([review("a", night(2).run_id, "good", minutes=2)])
    before = {path.name: (path.read_bytes(), path.stat().st_mtime_ns) for path in (tmp_path / "reviews").iterdir()}
    assert len(before) == 3, "one of each viewer, and the one without rows"
    write_run(tmp_path, night(3), [make_record("a"), make_record("b")], present={"a", "b"})
    assert {
        path.name: (path.read_bytes(), path.stat().st_mtime_ns) for path in (tmp_path / "reviews").iterdir()
    } == before
    rows = read_table(tmp_path, "reviews")
    assert rows["asset_id"].tolist() == ["b", "c", "a"] and rows["verdict"].tolist() == ["bad", "good", "good"]
    assert rows["note"].iloc[0] == "sticks | at the end, 'half' open" and list(rows.columns) == REVIEWS.schema.names
    with connect(tmp_path) as tables:
        assert tables.sql("SELECT count(*) FROM reviews").fetchall() == [(3,)]


def test_failures_know_what_is_unreviewed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    two_nights(tmp_path)
    assert "2 of 2 failures not reviewed; look at them: asset2sim view" in " ".join(
        told(["failures"], tmp_path, capsys).split()
    )
    file = OwnFile(tmp_path, REVIEWS)
    file.add([review("c", night(1).run_id, "bad", "the flap")])
    file.add([review("b", night(2).run_id, "bad", "first thought")])
    file.add([review("b", night(2).run_id, "good", "fine to me", minutes=5)])
    found = reviewed_failures(tmp_path)
    assert found[["asset_id", "verdict", "current"]].values.tolist() == [["c", "bad", False], ["b", "good", True]]
    shown = told(["failures", "--reviewed"], tmp_path, capsys)
    assert "1 of 2 failures not reviewed" in shown and "fine to me" in shown and "(bad)" in shown
    assert "first thought" not in shown
    assert "not allowed with" in told(["failures", "--reviewed", "--by", "category"], tmp_path, capsys, code=2)
    assert "1 of 2 failures not reviewed" in told(["failures"], tmp_path, capsys)


def test_a_catalog_without_failures_or_reviews(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_run(tmp_path, night(1), [make_record("a")])
    for path in (tmp_path / "reviews").iterdir():
        path.unlink()
    (tmp_path / "reviews").rmdir()
    assert read_table(tmp_path, "reviews").empty
    assert "no failures" in told(["failures", "--reviewed"], tmp_path, capsys)
    assert "not reviewed" not in told(["failures"], tmp_path, capsys)


def test_a_night_s_new_failures_are_walked_until_none_is_left(tmp_path: Path) -> None:
    two_nights(tmp_path)
    stops = stops_of(tmp_path)

    def ids(show: Show) -> list[str]:
        return [stop.asset_id for stop in chosen_stops(stops, reviews_of(tmp_path, stops), show)]

    assert ids(Show.ALL) == ["a", "b", "c"] and ids(Show.FAILURES) == ["b", "c"] == ids(Show.UNREVIEWED)
    assert ids(Show.NEW) == ["b"]
    file = OwnFile(tmp_path, REVIEWS)
    file.add([review("c", night(1).run_id)])
    assert ids(Show.UNREVIEWED) == ["b", "c"], "it was refined again since"
    file.add([review("c", night(2).run_id, minutes=1)])
    file.add([review("b", night(2).run_id)])
    assert ids(Show.UNREVIEWED) == [] and ids(Show.NEW) == ["b"]
    assert reviews_of(tmp_path, stops)["c"].current


def test_a_verdict_is_good_or_bad_and_an_out_that_cannot_be_written_to_says_so(tmp_path: Path) -> None:
    two_nights(tmp_path)
    file = OwnFile(tmp_path, REVIEWS)
    with pytest.raises(UsageError, match="good or bad, not 'fair'"):
        file.add([review("b", "r", "fair")])
    for path in (tmp_path / "reviews").iterdir():
        path.unlink()
    (tmp_path / "reviews").rmdir()
    (tmp_path / "reviews").write_text("in the way", encoding="utf-8")
    with pytest.raises(UsageError, match="reviews: nothing is stored"):
        file.add([review("b", "r")])
    assert not file.rows


def test_reviews_behind_a_url_are_written_beside_those_of_others(store: Store, tmp_path: Path) -> None:
    """A run's tables put there by hand; a viewer writes an object of its own, and reads what all have written."""
    two_nights(tmp_path)
    url = f"{store.url}/out"
    for path in sorted(tmp_path.rglob("*.parquet")):
        store.files.pipe_file(f"{url}/{path.relative_to(tmp_path).as_posix()}", path.read_bytes())
    OwnFile(url, REVIEWS).add([review("b", night(2).run_id, note="mine")])
    other = OwnFile(url, REVIEWS)
    other.add([review("c", night(2).run_id, "good", minutes=1)])
    other.add([review("a", night(2).run_id, "good", minutes=2)])
    found = read_table(url, "reviews")
    assert isinstance(found, pd.DataFrame) and found["asset_id"].tolist() == ["b", "c", "a"]
    assert sum("/reviews/" in name or name.startswith("reviews/") for name in store.keys(url)) == 3
    assert reviewed_failures(url)["current"].tolist() == [True, True]
