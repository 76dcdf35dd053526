"""The command ``asset2sim``: hands the flows to the command line, and imports them only when one is asked for."""

import sys
import threading
from collections.abc import Sequence

from asset2sim.cli.main import run_command
from asset2sim.cli.request import RefineRequest
from asset2sim.run_result import RunResult


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command line and return its exit code."""
    return run_command(sys.argv[1:] if arguments is None else arguments, refine=refine, nightly=_nightly)


def refine(request: RefineRequest) -> RunResult:
    """Run the flow on a request, with a Prefect server of its own where none is set."""
    from asset2sim.isolation.server import warm_up
    from asset2sim.models.lite import load_litellm
    from tasks.prefect_server import temporary_server

    with temporary_server() as address:
        # The server takes seconds to load: load beside it what the run will need.
        warm_up()
        threading.Thread(target=load_litellm, daemon=True).start()
        from flows.refine_dataset import refine_dataset
        from tasks.prefect_client import use_server

        with use_server(address):
            return refine_dataset(
                request.data, request.out, request.settings, request.subset, request.asset_ids, request.limit
            )


def _nightly(request: RefineRequest) -> None:
    from asset2sim.programs import run_together
    from tasks.prefect_server import temporary_server

    with temporary_server(schedules=True) as address:
        server = [address] if address else []
        run_together({"nightly": [sys.executable, "-m", "flows.nightly", request.model_dump_json(), *server]})


if __name__ == "__main__":
    sys.exit(main())
