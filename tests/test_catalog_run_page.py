"""A run's page in Markdown: its contents, its bounded length, and that names and reasons cannot break it."""

import time
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from asset2sim.catalog.changes import Previous, change_figures, find_changes, read_previous
from asset2sim.catalog.failures import find_run
from asset2sim.catalog.run import MARK, RunRow, remove_run_marker, selection_of, write_run_marker
from asset2sim.catalog.summarize import summarize_all
from asset2sim.catalog.summary import MAX_LISTED, escape, headline, run_page
from asset2sim.catalog.write import write_run
from schemas.asset import AssetRecord, Unchanged
from schemas.settings import ModelSettings, Settings
from schemas.vocabulary import FailureMode, Status
from tests.factories import make_failure, make_record, make_run_records

OK = FailureMode.NONE
START = datetime(2026, 3, 1, 2, 0, tzinfo=UTC)


def make_run(run_id: str = "now", hours: float = 0.0, **changes: object) -> RunRow:
    started = START + timedelta(hours=hours)
    fields: dict[str, object] = {
        "run_id": run_id, "started_at": started, "finished_at": started + timedelta(minutes=14), "dataset": "data",
        "git_commit": "0123456789abcdef", "git_dirty": True,
    }  # fmt: skip
    return RunRow.model_validate(fields | changes)


def written(records: list[AssetRecord], previous: Previous, *problems: str, run: RunRow | None = None) -> str:
    refined = summarize_all(records)
    return run_page(run or make_run(), refined, find_changes(refined, previous), problems)


def left(*modes: FailureMode) -> list[Unchanged]:
    """Unchanged assets by how they end, called 0, 1, …"""
    return [
        Unchanged(asset_id=f"{i}", status=Status.OK if mode is OK else Status.FAILED, failure_mode=mode)
        for i, mode in enumerate(modes)
    ]


@pytest.fixture
def records() -> list[AssetRecord]:
    slow = make_record("slow", seconds={"extract": 1.0, "measure": 99.5})
    return [
        slow, make_record("mended"), make_failure("broke", FailureMode.DRIFT, "drift_large"),
        make_failure("added", FailureMode.MISSING_MESH, "no_mesh"),
        make_failure("always", FailureMode.DRIFT, "drift_large"),
    ]  # fmt: skip


@pytest.fixture
def previous() -> Previous:
    was = {"slow": "none", "mended": "oscillation", "broke": "none", "always": "drift", "elsewhere": "none"}
    return Previous(was)


def test_what_a_run_changed(records: list[AssetRecord], previous: Previous) -> None:
    changes = find_changes(summarize_all(records), previous)
    assert [(item.record.ref.asset_id, item.was) for item in changes.new_failures] == [
        ("broke", "none"),
        ("added", None),
    ]
    assert [(item.record.ref.asset_id, item.was) for item in changes.mended] == [("mended", "oscillation")]
    assert [item.record.ref.asset_id for item in changes.still_failing] == ["always"]
    assert dict(changes.standing) == {"none": 3, "drift": 2, "missing_mesh": 1}
    figures = change_figures(changes)
    assert (figures["standing_assets"], figures["standing_success_rate"]) == (6, 0.5)
    assert change_figures(find_changes([], Previous())).keys() == figures.keys() - {"standing_success_rate"}


def test_the_page_names_new_failures_and_mended_assets(records: list[AssetRecord], previous: Previous) -> None:
    text = written(records, previous, "interrupted", run=make_run(outcome="interrupted"))
    assert text.startswith("# Interrupted: 2 of 5 ok, 2 new failures, 1 mended\n")
    assert "> **interrupted**" in text and "commit `0123456789ab` with changes" in text
    assert "2 of 5 ok (40.0 %)" in text and "2400 tokens" in text and "0.02 USD" in text
    assert "`drift` 2, `missing_mesh` 1" in text
    assert "| broke | Box | ok | `drift` | drift_large: cannot go on |" in text
    assert "| added | Box | not there | `missing_mesh` |" in text and "| always |" not in text
    assert "| mended | Box | `oscillation` | ok |  |" in text.split("## Mended: 1")[1]


def test_a_first_run_and_an_empty_one_have_a_page_too(records: list[AssetRecord]) -> None:
    empty = written([], Previous())
    assert empty.startswith("# no assets, 0 new failures\n") and "nan" not in empty
    assert written([make_record("a")], Previous({"a": "none"})).startswith("# 1 of 1 ok, 0 new failures\n")
    changes = find_changes((), Previous())
    assert "reasons: `out/report/index.html`." in run_page(make_run(), (), changes, report="out/report/index.html")


def test_a_name_or_a_reason_is_never_more_than_text() -> None:
    evil = "a|b\n# *x* <script> [l](u) `c` <!-- run now -->"
    failed = make_failure(evil, FailureMode.DRIFT, reason=f"{evil} " * 100)
    text = written([failed], Previous())
    (line,) = [line for line in text.splitlines() if "not there" in line]
    assert line.count("|") - line.count("\\|") == 6 and len(line) < 600
    assert "\n# *" not in text and "\n<!--" not in text and "<script>" not in text.replace("\\<script\\>", "")
    assert escape("box_wooden_2") == "box_wooden_2" and escape("_x_") == "\\_x\\_"


def test_ten_thousand_assets_make_a_short_page() -> None:
    failures = [FailureMode.DRIFT, FailureMode.JAM] * 1000
    records = [*make_run_records(100, failures), *([make_record("same")] * 7900)]
    started = time.process_time()
    text = written(records, Previous())
    assert time.process_time() - started < 3.0
    assert len(text) < 40_000 and f"… and {2000 - MAX_LISTED} more." in text


def test_what_was_before_is_read_from_the_catalog(tmp_path: Path, records: list[AssetRecord]) -> None:
    assert read_previous(tmp_path, make_run()) == Previous()
    write_run(tmp_path, make_run("a", -48), make_run_records(1, [FailureMode.DRIFT]))
    write_run(tmp_path, make_run("b", -24), records)
    write_run(tmp_path, make_run("c", -1, dataset="another"), [make_record("far")])
    other = Settings(model=ModelSettings(model="openai/other"))
    write_run(tmp_path, make_run("d", -1, settings=other), [make_record("slow", model="openai/other")])
    found = read_previous(tmp_path, make_run())
    assert found.modes["broke"] == "drift" and found.modes["bad0"] == "drift" and found.modes["far"] == "none"
    assert read_previous(tmp_path, make_run(settings=other)).modes == {"slow": "none"}


def test_a_catalog_that_cannot_be_read_is_a_problem_of_the_report_not_of_the_run(tmp_path: Path) -> None:
    (tmp_path / "catalog").mkdir()
    (tmp_path / "catalog" / "assets.parquet").write_bytes(b"no table")
    found = read_previous(tmp_path, make_run())
    assert found.problem is not None and "every failure counts as new" in found.problem


def test_the_headline_counts() -> None:
    records = summarize_all(make_run_records(2, [FailureMode.DRIFT]))
    assert headline(records, find_changes(records, Previous())) == "2 of 3 ok, 1 new failure"
    quiet = find_changes((), Previous({"0": "none", "1": "jam"}, gone=("2",)))
    assert headline((), quiet, left(OK, FailureMode.JAM)) == "1 of 2 ok, 0 new failures, 1 gone, 2 unchanged"


def test_unchanged_assets_count_with_their_failures(previous: Previous) -> None:
    unchanged = left(OK, OK, FailureMode.JAM, FailureMode.TIMEOUT)
    was = replace(previous, modes={item.asset_id: item.failure_mode.value for item in unchanged})
    records = summarize_all([make_failure("broke", FailureMode.JAM, "blocked")])
    text = run_page(make_run(), records, find_changes(records, was), (), unchanged)
    assert text.startswith("# 2 of 5 ok, 1 new failure, 4 unchanged\n") and "`jam` 2, `timeout` 1" in text


def test_a_removed_asset_counts_nowhere_but_among_the_gone(tmp_path: Path) -> None:
    write_run(tmp_path, make_run("a", -24), [*make_run_records(2, [FailureMode.DRIFT])])
    kept = read_previous(tmp_path, make_run(), {"1000", "new"})
    assert (dict(kept.modes), kept.gone) == ({"1000": "none"}, ("1001", "bad0"))
    records = summarize_all([make_record("new")])
    text = run_page(make_run(), records, find_changes(records, kept), (), left(OK))
    assert text.startswith("# 2 of 2 ok, 0 new failures, 2 gone, 1 unchanged\n")


def test_a_run_that_never_came_to_its_end_is_found_by_the_next_one(tmp_path: Path) -> None:
    assert write_run_marker(tmp_path, make_run("dead")) is None
    said = write_run_marker(tmp_path, make_run("next", 24))
    assert said is not None and "(dead, from 2026-03-01 02:00 UTC) ended without a report" in said
    remove_run_marker(tmp_path)
    assert write_run_marker(tmp_path, make_run("good", 48)) is None
    (tmp_path / MARK).write_text("{")
    assert "the run before ended without a report" in str(write_run_marker(tmp_path, make_run("torn", 72)))


def test_a_run_over_a_part_is_not_the_one_before_a_run_over_all(tmp_path: Path) -> None:
    write_run(tmp_path, make_run("whole", -3.0), [make_record("a"), make_record("b")])
    write_run(tmp_path, make_run("part", -2.0, selection=selection_of((), 1)), [make_record("a")])
    write_run(tmp_path, make_run("one", -1.0, selection=selection_of(("b", "a"), None)), [make_record("a")])
    write_run(tmp_path, make_run("now"), [make_record("a"), make_record("b")])
    assert (find_run(tmp_path, "latest"), find_run(tmp_path, "previous")) == ("now", "whole")
    assert selection_of((), None) is None and len(str(selection_of([f"{n}" for n in range(999)], 5))) < 250
