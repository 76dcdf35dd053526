"""A run in MLflow: settings, figures, tables and chart. MLflow's trouble is a warning, never a lost run."""

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asset2sim.catalog.chart import failure_chart
from asset2sim.catalog.figures import run_figures
from asset2sim.catalog.run import RunRow, without_credentials
from asset2sim.catalog.summary import summary_markdown
from asset2sim.catalog.switch import find_catalog
from schemas.asset import AssetRecord
from schemas.settings import Settings

if TYPE_CHECKING:
    from mlflow import MlflowClient

EXPERIMENT = "asset2sim"
DATABASE = "mlflow.db"
ARTIFACTS = "mlartifacts"

_ENVIRONMENT = {
    "MLFLOW_DISABLE_TELEMETRY": "true",
    "DO_NOT_TRACK": "1",
    "MLFLOW_LOGGING_LEVEL": "WARNING",
    # A server that is not there should cost seconds: MLflow's own defaults wait for minutes.
    "MLFLOW_HTTP_REQUEST_TIMEOUT": "10",
    "MLFLOW_HTTP_REQUEST_MAX_RETRIES": "1",
}
_MAX_PARAM = 500
"""Characters of one parameter: what the oldest supported server takes."""
_MAX_PARAMS = 100
"""Parameters of one request: the most that MLflow takes."""


def tracking_uri(out: Path) -> str:
    """``MLFLOW_TRACKING_URI`` where it is set, else a SQLite file under OUT."""
    return os.environ.get("MLFLOW_TRACKING_URI") or f"sqlite:///{(out / DATABASE).resolve()}"


def log_run(out: Path, run: RunRow, records: Sequence[AssetRecord]) -> str | None:
    """Logs one run; call it after ``write_run``, whose tables it attaches.

    Returns None, or a one-line warning that says why MLflow does not hold the run: the catalog does in any case.
    """
    for name, value in _ENVIRONMENT.items():
        os.environ.setdefault(name, value)
    try:
        # Imported late: 2 to 3 s that only a run's last step pays.
        from mlflow import MlflowClient

        client = MlflowClient(tracking_uri=tracking_uri(out))
        _log(client, _experiment(client, out), out, run, records)
    except Exception as error:  # whatever a store or a server can raise
        lines = str(error).splitlines() or [type(error).__name__]
        return f"MLflow does not hold run {run.run_id}: {without_credentials(lines[0])[:300]}; the catalog is complete"
    return None


def run_params(settings: Settings) -> dict[str, str]:
    """Every setting under its dotted name, as text that MLflow takes."""
    return {
        name: without_credentials(str(value))[:_MAX_PARAM] for name, value in _flat(settings.model_dump(mode="json"))
    }


def _experiment(client: "MlflowClient", out: Path) -> str:
    found = client.get_experiment_by_name(EXPERIMENT)
    if found is not None:
        return str(found.experiment_id)
    own = not os.environ.get("MLFLOW_TRACKING_URI")
    return str(
        client.create_experiment(EXPERIMENT, artifact_location=(out / ARTIFACTS).resolve().as_uri() if own else None)
    )


def _log(client: "MlflowClient", experiment: str, out: Path, run: RunRow, records: Sequence[AssetRecord]) -> None:
    from mlflow.entities import Metric, Param, RunTag

    started, finished = (int(1000 * time.timestamp()) for time in (run.started_at, run.finished_at))
    figures = run_figures(records, run.settings.thresholds) | {"seconds": (finished - started) / 1000.0}
    params = run_params(run.settings) | {"dataset": run.dataset[:_MAX_PARAM], "subset": run.subset or "all"}
    tags = {"run_id": run.run_id, "outcome": run.outcome, "git_commit": run.git_commit or "none"} | {
        f"version.{package}": version for package, version in run.versions.items()
    }
    logged = client.create_run(experiment, start_time=started, run_name=run.run_id)
    identity, status = logged.info.run_id, "FAILED"
    try:
        everything = [Param(name, value) for name, value in params.items()]
        client.log_batch(
            identity,
            metrics=[Metric(name, value, finished, 0) for name, value in figures.items()],
            params=everything[:_MAX_PARAMS],
            tags=[RunTag(name, value) for name, value in tags.items()],
        )
        for first in range(_MAX_PARAMS, len(everything), _MAX_PARAMS):
            client.log_batch(identity, params=everything[first : first + _MAX_PARAMS])
        _log_artifacts(client, identity, out, run, records)
        status = "FINISHED" if run.outcome == "finished" else "KILLED"
    finally:
        client.set_terminated(identity, status=status, end_time=finished)


def _log_artifacts(
    client: "MlflowClient", identity: str, out: Path, run: RunRow, records: Sequence[AssetRecord]
) -> None:
    if catalog := find_catalog(out):
        client.log_artifacts(identity, str(catalog), "catalog")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        failure_chart(records, folder / "failure_modes.png", f"How {len(records)} assets ended: run {run.run_id}")
        (folder / "summary.md").write_text(summary_markdown(records, run.settings.thresholds), encoding="utf-8")
        client.log_artifacts(identity, name)


def _flat(value: Any, prefix: str = "") -> list[tuple[str, Any]]:
    if not isinstance(value, dict):
        return [(prefix, value)]
    return [item for name, inner in value.items() for item in _flat(inner, f"{prefix}.{name}" if prefix else name)]
