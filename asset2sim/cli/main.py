"""From a command line to an exit code: 0 done, 1 the run failed, 2 the user's mistake, 130 interrupted."""

from collections.abc import Callable, Sequence

from asset2sim.cli.parser import parse, refine_request
from asset2sim.cli.request import RefineRequest
from asset2sim.runs.result import RunResult
from schemas.errors import DONE, FAILED, exit_code_of

RunRefine = Callable[[RefineRequest], RunResult]
ServeNightly = Callable[[RefineRequest], int]


def run_command(arguments: Sequence[str], *, refine: RunRefine, nightly: ServeNightly) -> int:
    """Run one command line; ``refine`` and ``nightly`` start the flows. Returns the exit code.

    What a person did wrong, and what went wrong in a way that we know, is one line on standard error. A broken program
    is an exception, with its traceback.
    """
    return exit_code_of("asset2sim", lambda: _dispatch(arguments, refine, nightly))


def _dispatch(arguments: Sequence[str], refine: RunRefine, nightly: ServeNightly) -> int:
    options = parse(arguments)
    match options.command:
        case "refine":
            from asset2sim.cli.refine import run_refine

            return run_refine(refine_request(options), refine)
        case "nightly":
            from asset2sim.cli.refine import run_nightly

            return run_nightly(refine_request(options), nightly)
        case "failures":
            from asset2sim.cli.catalog import print_failures

            print_failures(options.out, options.by, options.since, options.compare)
        case "query":
            from asset2sim.cli.catalog import print_query

            print_query(options.out, options.sql, csv=options.csv)
        case "show":
            from asset2sim.cli.catalog import print_asset

            print_asset(options.out, options.asset_id)
        case "ui":
            from asset2sim.cli.pages import print_and_serve

            print_and_serve(options.out)
        case "doctor":
            from asset2sim.cli.doctor import print_doctor
            from asset2sim.cli.parser import model_settings

            return DONE if print_doctor(options.out, model_settings(options)) else FAILED
    return DONE
