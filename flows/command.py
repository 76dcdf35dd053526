"""The command ``asset2sim``: hands the flows to the command line, and imports them only when one is asked for."""

import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from asset2sim.cli.main import run_command
from asset2sim.cli.request import RefineRequest
from asset2sim.runs.result import RunResult
from flows import PIPELINE
from schemas.errors import UsageError


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command line and return its exit code."""
    return run_command(sys.argv[1:] if arguments is None else arguments, refine=refine, nightly=_nightly)


def refine(request: RefineRequest) -> RunResult:
    """Run the flow on a request, with a Prefect server of its own where none is set."""
    with ready(request) as flow:
        return flow(request)


@contextmanager
def ready(request: RefineRequest) -> Iterator[Callable[[RefineRequest], RunResult]]:
    """The flow, to be called within the block, with a server and the libraries that the run will need loading."""
    from asset2sim.catalog.mlflow_store import load_mlflow
    from asset2sim.catalog.storage.cache import working_folder
    from asset2sim.catalog.switch import find_catalog
    from asset2sim.models.gateway.lite import load_litellm
    from asset2sim.runs.isolation.children import warm_up
    from flows.server.server import temporary_server

    first = find_catalog(working_folder(request.out)) is None
    with temporary_server() as address:
        # The server takes seconds to load: load beside it what the run will need. Where a run has been before there may
        # be little to refine, or nothing: then the engines and LiteLLM would be loaded in vain.
        if first:
            warm_up(PIPELINE)
            threading.Thread(target=load_litellm, daemon=True).start()
        from flows.refine_dataset import refine_dataset
        from flows.server.client import use_server

        if not first:
            threading.Thread(target=load_mlflow, daemon=True).start()
        with use_server(address):
            yield lambda asked: refine_dataset(
                asked.data, asked.out, asked.settings, asked.subset, asked.asset_ids, asked.limit, found=asked.found
            )


def _nightly(request: RefineRequest) -> int:
    """Serve the nightly until interrupted, or have one night at once. Returns the exit code."""
    from asset2sim.programs import run_together
    from flows.server.server import temporary_server
    from flows.server.serving import STOP_LIMIT_S, serving

    if request.now:
        return _night_now(request)
    with temporary_server(schedules=True) as address, serving(request.out, address):
        server = [address] if address else []
        program = [sys.executable, "-m", "flows.serve_nightly", request.model_dump_json(), *server]
        run_together({"nightly": program}, STOP_LIMIT_S)
    return 0


def _night_now(request: RefineRequest) -> int:
    from flows.server.server import temporary_server
    from flows.server.serving import find_serving

    found = find_serving(request.out)
    if found is not None:
        from flows.serve_nightly import run_deployed_night
        from flows.server.client import use_server

        with use_server(found.address):
            code = run_deployed_night(request)
        if code is None:
            raise UsageError(f"the nightly (process {found.process}) is just starting; try again in a few seconds")
        return code
    with temporary_server() as address:
        from asset2sim.catalog.storage.cache import working_folder
        from asset2sim.catalog.switch import find_catalog
        from asset2sim.runs.isolation.children import warm_up

        if find_catalog(working_folder(request.out)) is None:
            warm_up(PIPELINE)
        from flows.serve_nightly import run_deployed_night, run_night_here
        from flows.server.client import use_server

        with use_server(address):
            # A server of the user's may know of a nightly that another machine serves.
            code = run_deployed_night(request) if address is None else None
            return run_night_here(request) if code is None else code


if __name__ == "__main__":
    sys.exit(main())
