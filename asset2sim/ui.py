"""The pages of Prefect and MLflow, as two programs that end together."""

import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from asset2sim.catalog.mlflow_log import tracking_uri
from schemas.errors import Asset2SimError

STOP_LIMIT_S = 10.0
"""Time that a server gets to end by itself, s."""
PREFECT_PORT = 4200
MLFLOW_PORT = 5000


class PageError(Asset2SimError):
    """A server of pages ended by itself."""


def commands(out: Path) -> dict[str, list[str]]:
    """Name → command line of each server; both listen for this machine alone."""
    programs = Path(sys.executable).parent
    return {
        "Prefect": [str(programs / "prefect"), "server", "start", "--host", "127.0.0.1", "--port", str(PREFECT_PORT)],
        "MLflow": [
            *(str(programs / "mlflow"), "server", "--backend-store-uri", tracking_uri(out)),
            *("--host", "127.0.0.1", "--port", str(MLFLOW_PORT)),
        ],
    }


def addresses() -> dict[str, str]:
    """Name → where its page is."""
    return {"Prefect": f"http://127.0.0.1:{PREFECT_PORT}", "MLflow": f"http://127.0.0.1:{MLFLOW_PORT}"}


def serve_pages(servers: dict[str, list[str]]) -> None:
    """Run servers until interrupted; raises ``PageError`` when one ends by itself. None survives this call."""
    # Sessions of their own: a server may start workers, and Ctrl-C must reach none of them twice.
    running = {name: subprocess.Popen(command, start_new_session=True) for name, command in servers.items()}
    try:
        while True:
            for name, process in running.items():
                try:
                    code = process.wait(timeout=0.5)
                except subprocess.TimeoutExpired:
                    continue
                raise PageError(f"{name}'s server ended with exit code {code}; what it said is above")
    finally:
        _stop(list(running.values()))


def _stop(processes: Sequence[subprocess.Popen[bytes]]) -> None:
    for process in processes:
        _signal(process, signal.SIGTERM)
    for process in processes:
        try:
            process.wait(timeout=STOP_LIMIT_S)
        except subprocess.TimeoutExpired:
            _signal(process, signal.SIGKILL)
            process.wait()


def _signal(process: subprocess.Popen[bytes], number: signal.Signals) -> None:
    try:
        os.killpg(process.pid, number)
    except ProcessLookupError:
        return
