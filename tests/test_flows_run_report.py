"""The report for people at a run's end: made, left out, or a warning, and never the end of a run."""

import sys
from dataclasses import replace
from pathlib import Path

import pytest

from asset2sim.catalog.run import RunRow, finish_run, start_run
from asset2sim.catalog.write import write_run
from asset2sim.report import site
from asset2sim.runs.request import parse_request
from asset2sim.runs.result import INTERRUPTED
from asset2sim.runs.spread.refine_all import RunRecords
from flows import run_report
from flows.serve_pages import commands
from schemas.asset import AssetSummary
from schemas.settings import RunSettings, Settings, ViewSettings
from tests.factories import make_record

NOTHING: RunRecords[AssetSummary] = RunRecords((), None)


def run(out: Path, *, report: bool = True) -> RunRow:
    settings = Settings(views=ViewSettings(write=False), run=RunSettings(report=report))
    done = finish_run(start_run(settings, "dataset"))
    write_run(out, done, [make_record("a")])
    return done


def test_a_run_leaves_a_report_and_ui_serves_it_to_this_machine_alone(tmp_path: Path) -> None:
    index, warning = run_report._publish_site(tmp_path, run(tmp_path), NOTHING, None)
    assert index == tmp_path / "report/index.html" and index.is_file() and warning is None
    served = commands(tmp_path, report_port=4321)["report"]
    assert served[0] == sys.executable and served[-1] == "4321"
    assert served[served.index("--bind") + 1] == "127.0.0.1"
    assert served[served.index("--directory") + 1] == str(tmp_path / "report")


def test_a_run_that_is_to_have_none_or_was_interrupted_has_none(tmp_path: Path) -> None:
    stopped = replace(NOTHING, stopped=INTERRUPTED)
    assert run_report._publish_site(tmp_path, run(tmp_path, report=False), NOTHING, None) == (None, None)
    assert run_report._publish_site(tmp_path, run(tmp_path), stopped, None) == (None, None)
    assert not (tmp_path / "report").exists()
    words = ["refine", "data", "--out", "out"]
    assert parse_request(words).settings.run.report and not parse_request([*words, "--no-report"]).settings.run.report


def test_a_report_that_fails_is_a_warning(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise KeyError("no such column\nand more")

    monkeypatch.setattr(site, "read_snapshot", broken)
    index, warning = run_report._publish_site(tmp_path, run(tmp_path), NOTHING, None)
    assert index is None and warning is not None and "no such column" in warning and "asset2sim report" in warning
