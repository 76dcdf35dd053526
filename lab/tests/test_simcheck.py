import json
import os
import shutil
import stat
from pathlib import Path

import pytest

from asset2sim.catalog.run import start_run
from asset2sim.catalog.write import write_run
from lab.simcheck import checker as program
from lab.simcheck.findings import ObjectReport, SimcheckFinding, read_report, summarize
from schemas.asset import Unchanged
from schemas.errors import UnknownChoiceError, UsageError
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine, FailureMode, Severity
from tests.assets import NO_VIEWS, ROOT, prior, sample
from tests.factories import make_failure, make_record
from tests.processes import wait_until


def finding(severity: str, message: str = "so it is", **more: object) -> dict[str, object]:
    return {"severity": severity, "message": message, "target": "lid", **more}


def report_text(*results: tuple[str, str, list[dict[str, object]]]) -> str:
    """The checker's JSON, with results given as (check, engine, findings)."""
    return json.dumps({"results": [{"id": i, "engine": engine, "findings": found} for i, engine, found in results]})


def complaint(severity: Severity, check: str, engine: str = "") -> SimcheckFinding:
    return SimcheckFinding(severity=severity, check=check, engine=engine, target="", message=f"{check} is wrong")


def of(asset_id: str, *complaints: SimcheckFinding, problem: str = "") -> ObjectReport:
    return ObjectReport(asset_id=asset_id, seconds=2.0, complaints=complaints, problem=problem)


def test_errors_and_warnings_are_read_and_notes_are_not() -> None:
    text = report_text(
        ("engine.drop", "pybullet", [finding("error", "it flies")]),
        ("engine.load", "mujoco", [finding("info")]),
        ("joints.limits", "", [finding("warning"), finding("warning")]),
    )
    report = read_report("7", text, 3.0)
    assert [(item.severity, item.check, item.engine) for item in report.complaints] == [
        ("error", "engine.drop", "pybullet"), ("warning", "joints.limits", ""), ("warning", "joints.limits", "")
    ]  # fmt: skip
    assert report.complaints[0].message == "it flies" and report.complaints[0].target == "lid"
    assert (report.seconds, report.problem) == (3.0, "")
    assert not report.without_error and not report.without_warning


def test_a_list_of_one_report_is_read_like_the_report() -> None:
    text = report_text(("a", "", [finding("warning")]))
    assert read_report("7", f"[{text}]", 1.0) == read_report("7", text, 1.0)


def test_an_engine_that_the_checker_stopped_is_no_pass() -> None:
    cut = finding("warning", "mujoco did not finish within 240 s", data={"incomplete": True})
    report = read_report("7", report_text(("engine.load", "mujoco", [cut])), 240.0)
    assert "did not finish" in report.problem and not report.without_error


@pytest.mark.parametrize("text", ["", "null", "[]", "{}", '{"results": [{}]}', '{"results": 3}'])
def test_a_report_that_is_none_is_a_problem_and_no_pass(text: str) -> None:
    report = read_report("7", text, 1.0)
    assert "cannot be read" in report.problem
    assert not report.without_error and not report.without_warning


def test_objects_are_counted_once_and_causes_grouped_worst_first() -> None:
    warning, error = Severity.WARNING, Severity.ERROR
    reports = [
        of("1"),
        of("2", complaint(warning, "sweep", "mujoco"), complaint(warning, "sweep", "mujoco")),
        of("3", complaint(warning, "sweep", "mujoco"), complaint(error, "drop", "pybullet")),
        of("4", complaint(warning, "sweep", "pybullet")),
        of("5", problem="it did not finish within 600 s"),
    ]
    found = summarize(reports)
    assert (found.objects, found.without_error, found.without_warning) == (5, 3, 1)
    assert found.unfinished == ("5",) and not found.passed and found.seconds == 10.0
    assert [(c.severity, c.check, c.engine, c.objects, c.findings, c.examples) for c in found.causes] == [
        ("error", "drop", "pybullet", 1, 1, ("3",)),
        ("warning", "sweep", "mujoco", 2, 3, ("2", "3")),
        ("warning", "sweep", "pybullet", 1, 1, ("4",)),
    ]


def test_warnings_alone_pass_and_nothing_at_all_passes_too() -> None:
    assert summarize([of("1"), of("2", complaint(Severity.WARNING, "sweep"))]).passed
    assert not summarize([of("1"), of("2", problem="?")]).passed


def written(out: Path, *names: str) -> Path:
    for name in names:
        (out / "assets" / name).mkdir(parents=True)
        (out / "assets" / name / "mobility.urdf").write_text("<robot/>")
    return out


def stub(folder: Path, body: str) -> Path:
    """A checker that answers as told: the JSON's path is ``$json``, the URDF's ``$urdf``."""
    head = '#!/bin/sh\nwhile [ $# -gt 1 ]; do [ "$1" = --json ] && json=$2; shift; done\nurdf=$1\n'
    path = folder / "simcheck"
    path.write_text(head + body)
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def test_ids_choose_and_unknown_ones_are_refused(tmp_path: Path) -> None:
    out = written(tmp_path, "1", "2", ".3.new")
    assert list(program.refined_objects(out)) == ["1", "2"]
    assert list(program.refined_objects(out, ["2"])) == ["2"]
    with pytest.raises(UnknownChoiceError, match="'9'"):
        program.refined_objects(out, ["9"])
    with pytest.raises(UsageError, match="no refined object"):
        program.refined_objects(tmp_path / "empty")


def test_an_unchanged_asset_that_failed_without_a_folder_counts(tmp_path: Path) -> None:
    failed = make_failure("failed", FailureMode.UNREADABLE_ASSET)
    unchanged = Unchanged(asset_id="failed", status=failed.status, failure_mode=failed.failure_mode)
    write_run(tmp_path, start_run(NO_VIEWS, "data"), [failed, make_record("kept")])
    write_run(tmp_path, start_run(NO_VIEWS, "data"), [make_record("kept")], [unchanged])
    assert list(program.refined_objects(tmp_path)) == ["failed", "kept"]


@pytest.mark.skipif(os.name == "nt", reason="the stub is a shell script")
class TestRunning:
    def test_a_checker_that_hangs_is_stopped_with_all_that_it_started(self, tmp_path: Path) -> None:
        pid = tmp_path / "pid"
        simcheck = stub(tmp_path, f"sleep 300 & echo $! > '{pid}'; wait\n")
        urdf = written(tmp_path, "1") / "assets" / "1" / "mobility.urdf"
        report = program.check_object(simcheck, "1", urdf, 2.0)
        assert report.problem == "it did not finish within 2 s"
        assert 1.9 < report.seconds < 200.0
        child = Path(f"/proc/{pid.read_text().strip()}/stat")

        def gone() -> bool:
            # A killed process may still be seen for a moment, and is a zombie until somebody reaps it.
            try:
                return child.read_text().rsplit(")", 1)[1].split()[0] == "Z"
            except OSError:
                return True

        assert wait_until(gone, 5.0)

    def test_a_checker_that_crashes_says_what_it_said(self, tmp_path: Path) -> None:
        urdf = written(tmp_path, "1") / "assets" / "1" / "mobility.urdf"
        report = program.check_object(stub(tmp_path, "echo out of cheese; exit 3\n"), "1", urdf)
        assert "exit code 3" in report.problem and "out of cheese" in report.problem

    def test_an_object_without_a_urdf_counts_and_does_not_pass(self, tmp_path: Path) -> None:
        report = program.check_object(stub(tmp_path, "exit 1\n"), "1", tmp_path / "mobility.urdf")
        assert "not refined" in report.problem

    def test_the_program_writes_all_findings_and_its_status_says_whether_there_is_an_error(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
    ) -> None:
        out = written(tmp_path / "out", "1", "2")
        clean, bad = report_text(), report_text(("engine.drop", "mujoco", [finding("error", "[it] flies")]))
        body = f"case $urdf in */1/*) echo '{clean}';; *) echo '{bad}';; esac > \"$json\"\n"
        monkeypatch.setenv("SIMCHECK", str(stub(tmp_path, body)))
        assert program.main([str(out), "--jobs", "2"]) == 1
        said = capsys.readouterr().out
        assert "without an error   1 of 2 (50.0 %)" in said and "engine.drop" in said and "[it]" in said
        found = program.Findings.model_validate_json((out / "judge.json").read_text())
        assert [report.asset_id for report in found.objects] == ["1", "2"]
        assert found.objects[1].complaints[0].message == "[it] flies"
        assert program.main([str(out), "--ids", "1"]) == 0
        assert program.main([str(out), "--ids", "9"]) == 2
        monkeypatch.setenv("SIMCHECK", str(tmp_path / "none"))
        assert program.main([str(out)]) == 2


@pytest.mark.system
def test_simcheck_itself_finds_no_error_in_a_refined_sample(tmp_path: Path) -> None:
    from tasks.pipeline import refine_asset

    try:
        simcheck = program.find_simcheck(ROOT)
    except UsageError:
        pytest.skip("simcheck is not installed: make judge")
    quick = NO_VIEWS.model_copy(update={"engine": EngineSettings(verify=(Engine.PYBULLET,), interact=False)})
    refine_asset(sample("box_wooden"), tmp_path, quick, prior)
    report = program.check_object(simcheck, "box_wooden", tmp_path / "assets" / "box_wooden" / "mobility.urdf")
    assert report.problem == "" and report.without_error, report.complaints
    assert shutil.which(str(simcheck)) is not None
