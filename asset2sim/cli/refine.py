"""``asset2sim refine``: check the request, run the flow, say how it went."""

import sys
from collections.abc import Callable
from contextlib import suppress

from asset2sim.cli.request import RefineRequest
from asset2sim.models.gateway.environment import quiet_environment
from asset2sim.runs.alert import alert, alert_error, exit_code
from asset2sim.runs.check_request import check_request
from asset2sim.runs.interrupt import sigterm_as_interrupt
from asset2sim.runs.result import RunResult
from schemas.errors import DONE, UsageError


def run_refine(request: RefineRequest, refine: Callable[[RefineRequest], RunResult]) -> int:
    """Run the flow on a request, tell the hook, and print the summary. Returns the exit code."""
    request = check(request)
    quiet_environment()
    result = alert(_refined(request, refine), request.strict)
    from asset2sim.cli.summary import print_summary

    print_summary(result)
    return exit_code(result, request.strict)


def run_nightly(request: RefineRequest, serve: Callable[[RefineRequest], int]) -> int:
    """Serve the flow on its schedule until interrupted, or with ``now`` run it at once. Returns the exit code."""
    check(request)
    quiet_environment()
    if request.now:
        return serve(request)
    # A service manager stops what it runs by SIGTERM: that is the usual end of a nightly, as Ctrl-C is.
    with suppress(KeyboardInterrupt), sigterm_as_interrupt():
        serve(request)
    return DONE


def check(request: RefineRequest) -> RefineRequest:
    """The request with the assets that it asks for. Raises ``UsageError`` for one that cannot be met, before anything
    is imported or written for it."""
    found = check_request(request.data, request.out, request.settings, request.subset, request.asset_ids, request.limit)
    return request.model_copy(update={"found": found})


def _refined(request: RefineRequest, refine: Callable[[RefineRequest], RunResult]) -> RunResult:
    """The flow's result. The hook hears of a run that broke down; of a mistake, its user hears here and now."""
    try:
        return refine(request)
    except UsageError:
        raise
    except Exception as error:
        warning = alert_error(request.out, request.settings.run, error)
        if warning is not None:
            sys.stderr.write(f"asset2sim: {warning}\n")
        raise
