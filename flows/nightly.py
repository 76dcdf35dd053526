"""Refine a dataset every night, on the schedule that ``catalog.yaml`` holds."""

import sys
from pathlib import Path

from prefect.schedules import Cron

from asset2sim.catalog.schedule import nightly_schedule
from asset2sim.cli.request import RefineRequest
from flows.refine_dataset import refine_dataset

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
    from flows.command import main

    sys.exit(main(["nightly", *sys.argv[1:]]))
