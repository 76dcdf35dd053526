"""A run in MLflow for each training, its curves a point a checkpoint. An error of MLflow is only a warning."""

import logging
import time
from collections.abc import Mapping
from pathlib import Path

from asset2sim.catalog.mlflow_log import experiment_of
from asset2sim.catalog.mlflow_store import open_mlflow
from lab.learning.progress import Point
from schemas.table import Row

EXPERIMENT = "asset2sim-learning"
IDENTITY = "mlflow_run"
"""File beside a training's checkpoints that names its run, so that it goes on in it."""

log = logging.getLogger(__name__)


def begin_run(out: Path, to: Path, name: str, params: Mapping[str, object]) -> str | None:
    """The id of the run in OUT's store of the training in ``to``, a new one where it has none; None where MLflow
    refuses."""
    try:
        with open_mlflow(out) as client:
            from mlflow.entities import Param

            file = to / IDENTITY
            if file.is_file():
                known = file.read_text(encoding="utf-8")
                client.update_run(known, status="RUNNING")
                return known
            made = str(client.create_run(experiment_of(client, out, EXPERIMENT), run_name=name).info.run_id)
            client.log_batch(made, params=[Param(key, str(value)[:500]) for key, value in params.items()])
            to.mkdir(parents=True, exist_ok=True)
            file.write_text(made, encoding="utf-8")
            return made
    except Exception as error:  # whatever a store or a server can raise
        warn(name, error)
        return None


def log_point(out: Path, run: str | None, point: Point) -> None:
    """Add a checkpoint to a run's curves."""
    figures = {"s": point.s, "success": point.success, "reward": point.reward, "fps": point.fps}
    figures |= {name.replace("/", "_"): value for name, value in point.numbers.items()}
    figures["seconds"] = point.seconds
    log_figures(out, run, figures, point.steps)


def log_figures(out: Path, run: str | None, figures: Mapping[str, float], step: int) -> None:
    """Add figures of one step to a run."""
    if run is None:
        return
    try:
        with open_mlflow(out) as client:
            from mlflow.entities import Metric

            now = int(1000 * time.time())
            client.log_batch(run, metrics=[Metric(name, value, now, step) for name, value in figures.items()])
    except Exception as error:  # as above
        warn(run, error)


def end_run(out: Path, run: str | None, row: Row) -> None:
    """Close a training's run with what its row says."""
    if run is None:
        return
    found = {f"final_{name}": float(str(row[name])) for name in ("s", "success") if row.get(name) is not None}
    steps = row.get("steps")
    log_figures(out, run, found, steps if isinstance(steps, int) else 0)
    try:
        with open_mlflow(out) as client:
            client.set_tag(run, "outcome", str(row["outcome"]))
            client.set_tag(run, "reason", str(row["reason"])[:500])
            client.set_terminated(run, status="FAILED" if row["outcome"] == "failed" else "FINISHED")
    except Exception as error:  # as above
        warn(run, error)


def warn(name: str, error: Exception) -> None:
    """Say that MLflow does not hold something; the tables do."""
    lines = str(error).splitlines() or [type(error).__name__]
    log.warning("MLflow does not hold %s: %s; the tables are complete", name, lines[0][:300])
