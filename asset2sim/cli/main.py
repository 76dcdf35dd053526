"""From a command line to an exit code: 0 done, 1 the run failed, 2 the user's mistake, 130 interrupted."""

import sys
from collections.abc import Callable, Sequence

from asset2sim.cli.parser import parse, refine_request
from asset2sim.cli.request import RefineRequest
from asset2sim.runs.result import RunResult
from schemas.errors import Asset2SimError, UsageError

DONE, FAILED, MISTAKE, INTERRUPTED = 0, 1, 2, 130

RunRefine = Callable[[RefineRequest], RunResult]
ServeNightly = Callable[[RefineRequest], int]


def run_command(arguments: Sequence[str], *, refine: RunRefine, nightly: ServeNightly) -> int:
    """Run one command line; ``refine`` and ``nightly`` start the flows. Returns the exit code.

    What a person did wrong, and what went wrong in a way that we know, is one line on standard error. A broken program
    is an exception, with its traceback.
    """
    try:
        return _dispatch(arguments, refine, nightly)
    except UsageError as error:
        return _complain(str(error), MISTAKE)
    except Asset2SimError as error:
        return _complain(str(error), FAILED)
    except KeyboardInterrupt:
        return _complain("interrupted", INTERRUPTED)


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


def _complain(message: str, code: int) -> int:
    sys.stdout.flush()
    sys.stderr.write(f"asset2sim: {message}\n")
    return code
