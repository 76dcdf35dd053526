"""A run in MLflow, the figures that it logs, and the chart."""

import json
import threading
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from mlflow import MlflowClient
from mlflow.entities import Run

from asset2sim.catalog import mlflow_log
from asset2sim.catalog.changes import Previous, find_changes
from asset2sim.catalog.mlflow_log import EXPERIMENT, PART, log_run, prepare_mlflow, remove_old_artifacts, run_params
from asset2sim.catalog.parts import open_parts
from asset2sim.catalog.run import RunRow, start_run
from asset2sim.catalog.run_figures import run_figures
from asset2sim.catalog.summarize import summarize_all
from asset2sim.catalog.write import write_parts
from schemas.asset import AssetRecord
from schemas.settings import ModelSettings, Settings, Thresholds
from schemas.tables import TABLES
from schemas.vocabulary import FailureMode
from tests.factories import make_failure, make_measurement, make_motion, make_record, make_run_records

LIMITS = Thresholds()


@pytest.fixture
def records() -> list[AssetRecord]:
    """Φ of 0.5, 0 and 1.5 mm, one drifting and one oscillating, and one that was never measured."""
    oscillating = make_measurement(penetration_m=0.0, joints=(make_motion("hinge", 0.5, 9),))
    drifting = make_measurement(penetration_m=0.0015, drift_m=0.01)
    return [
        make_record("1"),
        make_record("2", measurement=oscillating),
        make_record("3", measurement=drifting),
        make_failure("4", FailureMode.MISSING_MESH),
    ]


def logged_with_parts(out: Path, run: RunRow, records: list[AssetRecord], previous: Previous) -> str | None:
    """Publish and log a run as the flow does."""
    with open_parts(out, run) as parts:
        refined = tuple(parts.add(record) for record in records)
        write_parts(out, run, parts, refined)
        return log_run(out, run, refined, find_changes(refined, previous), (), parts)


def test_figures(records: list[AssetRecord]) -> None:
    figures = run_figures(summarize_all(records), LIMITS)
    expected = {
        "assets": 4, "ok": 3, "success_rate": 0.75, "queries_per_asset": 0.75, "tokens_per_asset": 900.0,
        "failures_missing_mesh": 1, "failures_drift": 0, "measured": 3, "penetration_mm_mean": 2 / 3,
        "penetration_mm_median": 0.5, "penetration_mm_max": 1.5, "penetration_mm_mean_nonzero": 1.0,
        "penetrating_assets": 2, "drift_pass_share": 2 / 3, "oscillation_pass_share": 2 / 3,
        "penetration_pass_share": 1.0,
        "seconds_extract_mean": (3 * 0.1 + 0.05) / 4, "seconds_extract_median": 0.1,
    }  # fmt: skip
    assert {name: figures[name] for name in expected} == pytest.approx(expected)


def runs_in(folder: Path) -> tuple[MlflowClient, list[Run]]:
    """The client of a folder's MLflow, and the runs of our experiment in it."""
    client = MlflowClient(tracking_uri=f"sqlite:///{folder / 'mlflow.db'}")
    experiment = client.get_experiment_by_name(EXPERIMENT)
    assert experiment is not None
    return client, list(client.search_runs([experiment.experiment_id]))


def test_figures_of_nothing_are_left_out() -> None:
    assert run_figures([], LIMITS)["assets"] == 0
    assert "success_rate" not in run_figures([], LIMITS)
    assert "penetration_mm_mean" not in run_figures(summarize_all([make_failure("1", FailureMode.TIMEOUT)]), LIMITS)


def test_a_run_is_in_mlflow_with_settings_figures_tables_and_chart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, records: list[AssetRecord]
) -> None:
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    run = start_run(Settings(), "data/raw", "paper9")
    assert logged_with_parts(tmp_path, run, records, Previous({"4": "none", "9": "none"})) is None
    client, (logged,) = runs_in(tmp_path)
    table = json.loads(Path(client.download_artifacts(logged.info.run_id, "failed.json")).read_text())
    (row,) = table["data"]
    assert dict(zip(table["columns"], row, strict=True)).items() >= {"asset_id": "4", "was": "none"}.items()
    assert logged.info.run_name == run.run_id and logged.info.status == "FINISHED"
    assert logged.data.metrics["success_rate"] == 0.75 and logged.data.metrics["failures_missing_mesh"] == 1
    assert (logged.data.metrics["new_failures"], logged.data.metrics["standing_success_rate"]) == (1, 0.8)
    assert logged.data.params["search.target_phi_m"] == "0.0001" and logged.data.params["subset"] == "paper9"
    artifacts = {
        file.path for folder in (None, "changed") for file in client.list_artifacts(logged.info.run_id, folder)
    }
    # Nothing is expected of these assets, and a table without rows is not logged.
    tables = {f"changed/{item.file}" for item in TABLES.values() if item.per_asset and item.name != "expectations"}
    assert artifacts == tables | {"changed", "failed.json", "summary.json"}
    assert (tmp_path / "mlartifacts").is_dir()


def test_a_server_that_is_not_there_costs_a_warning_and_seconds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, records: list[AssetRecord]
) -> None:
    monkeypatch.setenv("MLFLOW_TRACKING_URI", "http://me:secret@127.0.0.1:9")
    started, refined = time.monotonic(), summarize_all(records)
    warning = log_run(tmp_path, start_run(Settings(), "data/raw"), refined, find_changes(refined, Previous()))
    assert time.monotonic() - started < 100.0, "MLflow itself would try for minutes"
    assert warning is not None and "MLflow does not hold run" in warning
    assert "\n" not in warning and "secret" not in warning


def test_what_a_night_costs_in_mlflow_does_not_grow_with_the_dataset(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    monkeypatch.setattr(mlflow_log, "MAX_FAILED", 2)
    monkeypatch.setattr(mlflow_log, "MAX_CHANGED_BYTES", 10)
    records = make_run_records(3, [FailureMode.DRIFT] * 4)
    run = start_run(Settings(), "data/raw")
    was = {"bad0": "drift", "bad1": "drift", "bad2": "drift"}
    assert logged_with_parts(tmp_path, run, records, Previous(was)) is None
    client, (parent,) = runs_in(tmp_path)
    table = json.loads(Path(client.download_artifacts(parent.info.run_id, "failed.json")).read_text())
    assert [row[0] for row in table["data"]] == ["bad3", "bad0"]  # what is new comes first
    assert parent.data.metrics["failed"] == 4 and parent.data.tags["catalog"] == str(tmp_path / "catalog")
    artifacts = {file.path for file in client.list_artifacts(parent.info.run_id)}
    assert artifacts == {"failed.json", "summary.json", "changed"}
    assert not client.list_artifacts(parent.info.run_id, "changed"), "rows for which there is no room"


def test_the_file_is_made_beside_the_work_and_no_run_is_lost(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    for left in (PART, f"{PART}-journal"):  # what a killed run left
        (tmp_path / left).write_bytes(b"half")
    run = start_run(Settings(), "data/raw")
    beside = [threading.Thread(target=prepare_mlflow, args=(tmp_path,)) for _ in range(2)]
    for thread in beside:
        thread.start()
    assert log_run(tmp_path, run, [], find_changes([], Previous())) is None
    for thread in beside:
        thread.join()
    client, (logged,) = runs_in(tmp_path)
    assert logged.info.run_name == run.run_id and not list(tmp_path.glob(f"{PART}*"))
    assert [file.path for file in client.list_artifacts(logged.info.run_id)] == ["summary.json"]


def test_params_are_flat_bounded_and_hold_no_password() -> None:
    params = run_params(Settings(model=ModelSettings(model="x" * 9000, api_base="http://me:secret@host")))
    assert len(params["model.model"]) == 500 and params["model.api_base"] == "http://host"
    assert params["thresholds.drift_m"] == "0.001" and all(isinstance(value, str) for value in params.values())


def test_artifacts_of_old_runs_are_removed_and_their_figures_and_the_newest_stay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    records = make_run_records(1, [FailureMode.DRIFT])
    runs = {}
    for name, days, dataset in (
        ("elsewhere", 90, "other"),
        ("old", 80, "data"),
        ("late", 20, "data"),
        ("now", 0, "data"),
    ):
        started = datetime(2026, 3, 1, tzinfo=UTC) - timedelta(days=days)
        run = start_run(Settings(), dataset).model_copy(
            update={"run_id": name, "started_at": started, "finished_at": started}
        )
        assert logged_with_parts(tmp_path, run, records, Previous()) is None
        runs[name] = run
    said = remove_old_artifacts(tmp_path, runs["now"], 30)
    assert said == "MLflow: removed the artifacts of 1 runs from before 2026-01-30"
    client, found = runs_in(tmp_path)
    logged = {item.info.run_name: item for item in found}
    left = {name: bool(client.list_artifacts(logged[name].info.run_id)) for name in runs}
    assert left == {"elsewhere": True, "old": False, "late": True, "now": True}
    assert logged["old"].data.metrics["assets"] == 2 and "now" in logged["old"].data.tags["artifacts_removed"]
    assert remove_old_artifacts(tmp_path, runs["now"], 30) is None
