"""Opening MLflow's store: the late import of MLflow, and the SQLite file under OUT. Importing it takes 2 s, and making
the file 1 s of processor time and up to 7 s on a busy disk, so an empty one of MLflow's version is kept and copied.
Both can be done in parallel with a run's work (``prepare_mlflow``) instead of after it."""

import importlib
import logging
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from asset2sim.storage.empty_databases import copy_empty, keep_empty
from asset2sim.storage.objects import cache_root

if TYPE_CHECKING:
    from mlflow import MlflowClient

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
