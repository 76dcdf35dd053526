"""The check that a scripted arm makes: what it moved, what stands against it, and that it decides nothing."""

import json
import os
import signal
from pathlib import Path

import pytest

pytest.importorskip("mujoco", reason="MuJoCo is not installed here")
import lab.trials.reach_stage
from asset2sim.catalog.rows import asset_row
from lab.schemas.reached import Reached
from lab.trials.reach_stage import measure_reach
from schemas.asset import AssetRef
from schemas.settings import Settings, Thresholds
from schemas.vocabulary import Severity, Stage, Status
from tasks.pipeline import refine_asset
from tasks.progress import AssetJob, StageResult
from tests.assets import NO_VIEWS, prior, sample
from tests.refined_things import block, drawer
from tests.test_catalog_write import make_run

pytestmark = pytest.mark.system
ASKED = Settings(checks=("reachable",))


def tried(folder: Path | None) -> StageResult:
    return measure_reach(AssetJob(AssetRef(asset_id="thing", path="thing"), Path("out"), ASKED, prior), folder)


def test_a_drawer_is_shut_and_nothing_is_amiss(tmp_path: Path) -> None:
    found = tried(drawer(tmp_path / "thing"))
    assert found.findings == ()
    assert (found.further["reachable_task"], found.further["reachable_reason"]) == ("close slide", None)
    assert found.further["reachable"] == pytest.approx(1.0, abs=0.1)


def test_nothing_is_tried_where_nothing_was_written() -> None:
    assert tried(None) == StageResult()


def test_a_drawer_that_is_stuck_is_a_warning_with_how_far_it_went(tmp_path: Path) -> None:
    folder = drawer(tmp_path / "thing")
    overlay = json.loads((folder / "overlay.json").read_text(encoding="utf-8"))
    overlay["joints"][0]["friction"] = 500.0
    (folder / "overlay.json").write_text(json.dumps(overlay), encoding="utf-8")
    found = tried(folder)
    share = found.further["reachable"]
    assert isinstance(share, float) and share < 0.3
    (finding,) = found.findings
    assert (finding.code, finding.severity, finding.joint) == ("not_reachable", Severity.WARNING, "slide")
    assert finding.limit == Thresholds().reach_share and "of its way" in finding.message


def test_what_has_no_joint_is_not_tried_and_says_so(tmp_path: Path) -> None:
    found = tried(block(tmp_path / "thing", 0.05, 0.2))
    assert found.further == Reached(reason="it has no joint with a range to move").columns
    assert [finding.severity for finding in found.findings] == [Severity.INFO]


def test_an_arm_that_kills_its_process_costs_the_asset_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lab.trials.reach_stage, "reach", lambda *_: os.kill(os.getpid(), signal.SIGKILL))
    found = tried(tmp_path)
    assert found.further["reachable"] is None and "SIGKILL" in str(found.further["reachable_reason"])


def test_a_refined_object_has_its_columns_and_is_as_ok_as_without(tmp_path: Path) -> None:
    settings = NO_VIEWS.model_copy(update={"checks": ASKED.checks})
    record = refine_asset(sample("laptop_silver"), tmp_path, settings, prior)
    assert record.status is Status.OK and set(record.further) == {"reachable", "reachable_task", "reachable_reason"}
    row = asset_row(make_run("r"), record)
    assert {name: row[name] for name in record.further} == record.further
    assert str(row["reachable_task"]).startswith("close ")
    warned = [item for item in record.findings if item.code == "not_reachable"]
    assert bool(warned) == bool(row["reachable_reason"]) and all(item.stage is Stage.MEASURE for item in warned)


def test_nothing_is_tried_unless_asked_for(tmp_path: Path) -> None:
    record = refine_asset(sample("box_wooden"), tmp_path, NO_VIEWS, prior)
    assert record.status is Status.OK and record.further == {}
    assert asset_row(make_run("r"), record)["reachable"] is None
