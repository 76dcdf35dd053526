"""The pages of Prefect and MLflow."""

import sys
from pathlib import Path

from asset2sim.catalog.mlflow_store import tracking_uri
from asset2sim.catalog.storage.cache import working_folder

PREFECT_PORT = 4200
MLFLOW_PORT = 5000


def commands(out: Path | str) -> dict[str, list[str]]:
    """Name → command line of each server; both listen on 127.0.0.1 only. MLflow shows the runs of this machine."""
    programs = Path(sys.executable).parent
    return {
        "Prefect": [str(programs / "prefect"), "server", "start", "--host", "127.0.0.1", "--port", str(PREFECT_PORT)],
        "MLflow": [
            *(str(programs / "mlflow"), "server", "--backend-store-uri", tracking_uri(working_folder(out))),
            *("--host", "127.0.0.1", "--port", str(MLFLOW_PORT)),
        ],
    }


def addresses() -> dict[str, str]:
    """Name → URL of its page."""
    return {"Prefect": f"http://127.0.0.1:{PREFECT_PORT}", "MLflow": f"http://127.0.0.1:{MLFLOW_PORT}"}
