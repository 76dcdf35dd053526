"""The command ``asset2sim``: hands the flows to the command line, and imports them only when one is asked for."""

import sys
import threading
from collections.abc import Sequence

from asset2sim.cli.main import run_command
from asset2sim.cli.request import RefineRequest
from asset2sim.run_result import RunResult
from schemas.errors import UsageError


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


def _nightly(request: RefineRequest) -> int:
    """Serve the nightly until interrupted, or have one night at once. Returns the exit code."""
    from asset2sim.programs import run_together
    from tasks.prefect_server import temporary_server
    from tasks.serving import STOP_LIMIT_S, serving

    if request.now:
        return _night_now(request)
    with temporary_server(schedules=True) as address, serving(request.out, address):
        server = [address] if address else []
        program = [sys.executable, "-m", "flows.serve_nightly", request.model_dump_json(), *server]
        run_together({"nightly": program}, STOP_LIMIT_S)
    return 0


def _night_now(request: RefineRequest) -> int:
    from tasks.prefect_server import temporary_server
    from tasks.serving import find_serving

    found = find_serving(request.out)
    if found is not None:
        from flows.night_now import night_elsewhere
        from tasks.prefect_client import use_server

        with use_server(found.address):
            code = night_elsewhere(request)
        if code is None:
            raise UsageError(f"the nightly (process {found.process}) is just starting; try again in a few seconds")
        return code
    with temporary_server() as address:
        from asset2sim.isolation.server import warm_up

        warm_up()
        from flows.night_now import night_elsewhere, night_here
        from tasks.prefect_client import use_server

        with use_server(address):
            # A server of the user's may know of a nightly that another machine serves.
            code = night_elsewhere(request) if address is None else None
            return night_here(request) if code is None else code


if __name__ == "__main__":
    sys.exit(main())
