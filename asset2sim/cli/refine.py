"""``asset2sim refine``: check the request, run the flow, say how it went."""

from collections.abc import Callable
from contextlib import suppress

from asset2sim.check_request import check_request
from asset2sim.cli.request import RefineRequest
from asset2sim.models.environment import quiet_environment
from asset2sim.run_result import INTERRUPTED, RunResult
from schemas.asset import AssetRecord, Unchanged
from schemas.vocabulary import Status

DONE, FAILED, STOPPED = 0, 1, 130


def run_refine(request: RefineRequest, refine: Callable[[RefineRequest], RunResult]) -> int:
    """Run the flow on a request and print the summary. Returns the exit code."""
    check(request)
    quiet_environment()
    result = refine(request)
    from asset2sim.cli.summary import print_summary

    print_summary(result)
    return exit_code(result, request.strict)


def run_nightly(request: RefineRequest, serve: Callable[[RefineRequest], None]) -> int:
    """Serve the flow on its schedule until interrupted."""
    check(request)
    quiet_environment()
    with suppress(KeyboardInterrupt):
        serve(request)
    return DONE


def check(request: RefineRequest) -> None:
    """Raise ``UsageError`` for a request that cannot be met, before anything is imported or written for it."""
    check_request(request.data, request.out, request.settings, request.subset, request.asset_ids, request.limit)


def exit_code(result: RunResult, strict: bool) -> int:
    """0; 130 for an interrupted run; 1 for one that stopped otherwise, and under ``strict`` if an asset failed."""
    if result.stopped is not None:
        return STOPPED if result.stopped == INTERRUPTED else FAILED
    every: list[AssetRecord | Unchanged] = [*result.records, *result.unchanged]
    return FAILED if strict and any(item.status is Status.FAILED for item in every) else DONE
