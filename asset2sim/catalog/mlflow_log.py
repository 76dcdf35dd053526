"""Logging a run to MLflow: settings, figures, failures and report. An error of MLflow is only a warning.

Importing MLflow takes 2 s, and making its SQLite file under OUT 1 s of processor time and up to 7 s on a busy disk, so
an empty one of its version is kept and copied, and ``prepare_mlflow`` does both beside a run's work.
"""

import importlib
import json
import logging
import os
import tempfile
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asset2sim.catalog.changes import AssetChange, Changes, change_figures
from asset2sim.catalog.history import newest_runs
from asset2sim.catalog.parts import Parts, merged_tables, write_merged
from asset2sim.catalog.run import UNRECORDED_SETTINGS, RunRow, without_credentials
from asset2sim.catalog.run_figures import all_asset_figures, run_figures
from asset2sim.catalog.switch import find_catalog
from asset2sim.storage.empty_databases import copy_empty, keep_empty
from asset2sim.storage.objects import cache_root
from schemas.asset import AssetSummary, Unchanged
from schemas.settings import Settings
from schemas.tables import TABLES

if TYPE_CHECKING:
    from mlflow import MlflowClient
    from mlflow.entities import Run

DATABASE = "mlflow.db"
PART = ".mlflow.db.part"
"""Name of the unfinished file: a file named ``DATABASE`` is complete, even after a killed run."""

_ENVIRONMENT = {
    "MLFLOW_DISABLE_TELEMETRY": "true",
    "DO_NOT_TRACK": "1",
    "MLFLOW_LOGGING_LEVEL": "WARNING",
    # A server that is not there should cost seconds: MLflow's own defaults wait for minutes.
    "MLFLOW_HTTP_REQUEST_TIMEOUT": "10",
    "MLFLOW_HTTP_REQUEST_MAX_RETRIES": "1",
}

logger = logging.getLogger(__name__)
_lock = threading.Lock()
"""Held while the file is made and while a run is logged, so that two threads never make the file at once."""


def tracking_uri(out: Path) -> str:
    """``MLFLOW_TRACKING_URI`` where it is set, else a SQLite file under OUT."""
    return os.environ.get("MLFLOW_TRACKING_URI") or _uri(out / DATABASE)


def load_mlflow() -> None:
    """Import the modules of MLflow that logging needs. Safe from any thread; a failed import shows up when logging."""
    for name, value in _ENVIRONMENT.items():
        os.environ.setdefault(name, value)
    try:
        for name in ("mlflow.tracking", "mlflow.store.tracking.sqlalchemy_store"):
            importlib.import_module(name)
    except Exception as error:  # whatever an import can raise: log_run turns it into a warning
        logger.debug("cannot import MLflow: %s", error)


def prepare_mlflow(out: Path) -> None:
    """Import MLflow and make OUT's file where there is none; the caller's run holds ``lock_output(out)``."""
    load_mlflow()
    with _lock:
        try:
            _make_file(out)
        except Exception as error:  # log_run tries again, and says what is wrong
            logger.debug("cannot make %s: %s", out / DATABASE, error)


@contextmanager
def open_mlflow(out: Path) -> Iterator["MlflowClient"]:
    """A client of the store of OUT's runs. Raises whatever MLflow does."""
    load_mlflow()
    from mlflow import MlflowClient

    with _lock:
        _make_file(out)
        yield MlflowClient(tracking_uri=tracking_uri(out))


def _make_file(out: Path) -> None:
    file, part = out / DATABASE, out / PART
    if os.environ.get("MLFLOW_TRACKING_URI") or file.exists():
        return
    from mlflow import MlflowClient
    from mlflow.version import VERSION

    for left in out.glob(f"{PART}*"):
        left.unlink()
    kept = cache_root() / "empty" / f"mlflow-{VERSION}.db"
    if copy_empty(kept, file):
        return
    # MLflow makes its tables when it is first asked.
    MlflowClient(tracking_uri=_uri(part)).search_experiments(max_results=1)
    # Its default experiment names the folder in which this program was started; MLflow makes one where there is none.
    keep_empty(part, kept, "DELETE FROM experiments")
    os.replace(part, file)


def _uri(file: Path) -> str:
    return f"sqlite:///{file.resolve()}"


EXPERIMENT = "asset2sim"
ARTIFACTS = "mlartifacts"

_MAX_PARAM = 500
"""Characters of one parameter: what the oldest supported server takes."""
_MAX_PARAMS = 100
"""Parameters of one request: the most that MLflow takes."""
MAX_FAILED = 500
"""Failed assets of a run that its table has: the catalog holds all."""
MAX_CHANGED = 500
"""Assets up to which the rows that a run wrote are attached, of every table; beyond, of ``assets`` alone ..."""
MAX_CHANGED_BYTES = 2 * 1024 * 1024
"""... and no more than this in all: the catalog holds them, and a nightly runs 365 times a year."""
CHANGED, SUMMARY, FAILED = "changed", "summary.json", "failed.json"
"""Artifacts: the rows that a run wrote, the run in figures, and its failed assets, a table on MLflow's pages."""
_ABOUT = {"run_id", "started_at", "finished_at", "outcome", "dataset", "subset"}
REMOVED = "artifacts_removed"
"""Tag of a run whose artifacts were removed, and when."""


def log_run(
    out: Path,
    run: RunRow,
    records: Sequence[AssetSummary],
    changes: Changes,
    unchanged: Sequence[Unchanged] = (),
    parts: Parts | None = None,
    index: Path | None = None,
) -> str | None:
    """Logs one run; call it after ``write_run``. It attaches ``index``, the report's, without the pages of objects:
    those are in OUT, and nights are many.

    Its cost does not grow with the dataset: figures of the same names every night in one batch, a bounded table of
    failed assets, and of the tables what the run changed (``parts``) while that is little. Counts,
    success rate and failure modes are of all the run's assets, calls, cost and seconds of those that it refined.
    Returns None, or a one-line warning that says why MLflow does not hold the run: the catalog does in any case.
    """
    figures = run_figures(records, run.settings.thresholds) | all_asset_figures(records, unchanged)
    figures |= change_figures(changes) | {"seconds": (run.finished_at - run.started_at).total_seconds()}
    try:
        with open_mlflow(out) as client, tempfile.TemporaryDirectory() as folder:
            _write_artifacts(Path(folder), run, figures, changes, parts if records else None, len(records))
            _log(client, out, run, figures, folder, index)
    except Exception as error:  # whatever a store or a server can raise
        return f"MLflow does not hold run {run.run_id}: {_told(error)}; the catalog is complete"
    return None


def _told(error: Exception) -> str:
    lines = str(error).splitlines() or [type(error).__name__]
    return without_credentials(lines[0])[:300]


def run_params(settings: Settings) -> dict[str, str]:
    """Every setting under its dotted name, as text that MLflow takes."""
    return {
        name: without_credentials(str(value))[:_MAX_PARAM]
        for name, value in _flat(settings.model_dump(mode="json", exclude=UNRECORDED_SETTINGS))
    }


def experiment_of(client: "MlflowClient", out: Path, name: str) -> str:
    """The id of OUT's experiment of this name, which is made where there is none. Raises whatever MLflow does."""
    found = client.get_experiment_by_name(name)
    if found is not None:
        return str(found.experiment_id)
    place = None if os.environ.get("MLFLOW_TRACKING_URI") else (out / ARTIFACTS).resolve().as_uri()
    return str(client.create_experiment(name, artifact_location=place))


def _log(
    client: "MlflowClient", out: Path, run: RunRow, figures: Mapping[str, float], folder: str, index: Path | None
) -> None:
    """Log a run with its figures, what is in ``folder``, and the report's ``index``."""
    from mlflow.entities import Metric, Param, RunTag

    started, finished = (int(1000 * time.timestamp()) for time in (run.started_at, run.finished_at))
    params = run_params(run.settings) | {"dataset": run.dataset[:_MAX_PARAM], "subset": run.subset or "all"}
    tags = {
        "run_id": run.run_id,
        "outcome": run.outcome,
        "git_commit": run.git_commit or "none",
        "catalog": str(find_catalog(out)),
    } | {f"version.{package}": version for package, version in run.versions.items()}
    logged = client.create_run(experiment_of(client, out, EXPERIMENT), start_time=started, run_name=run.run_id)
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
        client.log_artifacts(identity, folder)
        if index is not None:
            client.log_artifact(identity, str(index), index.parent.name)
        status = "FINISHED" if run.outcome == "finished" else "KILLED"
    finally:
        client.set_terminated(identity, status=status, end_time=finished)


def failed_table(failed: Sequence[AssetChange]) -> dict[str, list[Any]]:
    """Columns and rows of failed assets, new failures first; ``was`` is the failure mode of the run before."""
    columns = ["asset_id", "category", "failure_mode", "was", "reason"]
    rows = [
        [record.ref.asset_id, record.category, record.failure_mode.value, item.was or "not there", record.reason]
        for item in failed
        for record in (item.record,)
    ]
    return {"columns": columns, "data": rows}


def _write_artifacts(
    folder: Path, run: RunRow, figures: Mapping[str, float], changes: Changes, parts: Parts | None, refined: int
) -> None:
    """Write a run's figures, its failed assets, and the rows of the ``refined`` assets in ``parts``."""
    about = run.model_dump(mode="json", include=_ABOUT)
    (folder / SUMMARY).write_text(json.dumps(about | {"figures": dict(figures)}, indent=1), encoding="utf-8")
    if failed := [*changes.new_failures, *changes.still_failing]:
        (folder / FAILED).write_text(json.dumps(failed_table(failed[:MAX_FAILED])), encoding="utf-8")
    if parts is not None:
        _write_changed(parts, folder / CHANGED, [*TABLES] if refined <= MAX_CHANGED else ["assets"])


def _write_changed(parts: Parts, folder: Path, names: Sequence[str]) -> None:
    """Write the rows that a run wrote, a file a table, as far as there is room for them."""
    folder.mkdir()
    left = MAX_CHANGED_BYTES
    for name in names:
        if sources := parts.tables(name):
            path = folder / TABLES[name].file
            write_merged(merged_tables(sources, TABLES[name].key), TABLES[name], path)
            left -= path.stat().st_size
            if left < 0:
                path.unlink()
                return


def remove_old_artifacts(out: Path, run: RunRow, days: int) -> str | None:
    """Remove MLflow's artifacts of OUT's runs that began over ``days`` days before this one; figures stay. The newest
    run over each dataset and subset with its method and model keeps its own. Returns a line that says what was removed,
    or why it could not be; None for nothing."""
    limit, newest = run.started_at - timedelta(days=days), newest_runs(out) | {run.run_id}
    count = 0
    try:
        with open_mlflow(out) as client:
            from mlflow.store.artifact.artifact_repository_registry import get_artifact_repository

            for old in _runs_before(client, experiment_of(client, out, EXPERIMENT), limit):
                tags = old.data.tags
                if tags.get("catalog") != str(find_catalog(out)) or REMOVED in tags or tags["run_id"] in newest:
                    continue
                get_artifact_repository(old.info.artifact_uri).delete_artifacts()
                client.set_tag(old.info.run_id, REMOVED, f"{run.started_at:%Y-%m-%d}, in run {run.run_id}")
                count += 1
    except Exception as error:  # whatever a store or a server can raise
        return f"MLflow: cannot remove artifacts of old runs: {_told(error)}"
    return f"MLflow: removed the artifacts of {count} runs from before {limit:%Y-%m-%d}" if count else None


def _runs_before(client: "MlflowClient", experiment: str, limit: datetime) -> Iterator["Run"]:
    """Runs that began before a time, without the children that older versions made of failed assets."""
    token = None
    while True:
        asked = f"attributes.start_time < {int(1000 * limit.timestamp())} AND tags.catalog LIKE '%'"
        page = client.search_runs([experiment], asked, max_results=500, page_token=token)
        yield from page
        if not (token := page.token):
            return


def _flat(value: Any, prefix: str = "") -> list[tuple[str, Any]]:
    if not isinstance(value, dict):
        return [(prefix, value)]
    return [item for name, inner in value.items() for item in _flat(inner, f"{prefix}.{name}" if prefix else name)]
