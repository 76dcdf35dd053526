"""Refine a dataset every night, on the schedule that ``catalog.yaml`` holds: ``asset2sim nightly DATA --out OUT``.

As a program of its own, ``python -m flows.nightly REQUEST [SERVER]``, it is what that command starts and stops: once
interrupted, Prefect's serving leaves threads behind that keep its process from ending.
"""

import sys
from pathlib import Path

from prefect.schedules import Cron

from asset2sim.catalog.schedule import nightly_schedule
from asset2sim.cli.request import RefineRequest
from flows.refine_dataset import refine_dataset
from tasks.prefect_client import use_server

CATALOG_FILE = Path(__file__).resolve().parents[1] / "catalog.yaml"


def serve_nightly(request: RefineRequest) -> None:
    """Start the flow on schedule, with the request's parameters, until interrupted. Needs a Prefect server."""
    cron, timezone = nightly_schedule(CATALOG_FILE)
    refine_dataset.serve(
        name="nightly",
        schedule=Cron(cron, timezone=timezone),
        parameters={
            "data": str(request.data.resolve()),
            "out": str(request.out.resolve()),
            "settings": request.settings.model_dump(mode="json"),
            "subset": request.subset,
            "asset_ids": list(request.asset_ids),
            "limit": request.limit,
        },
    )


if __name__ == "__main__":
    with use_server(sys.argv[2] if len(sys.argv) > 2 else None):
        serve_nightly(RefineRequest.model_validate_json(sys.argv[1]))
