"""The command ``asset2sim``: one command line to an exit code, 0 done, 1 failed, 2 the user's mistake, 130 interrupted.

What a command needs is imported when it runs: Prefect, Dask and the engines take seconds.
"""

import gc
import io
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from typing import TYPE_CHECKING

from pydantic_settings import get_subcommand

from asset2sim.engines.console import QuietFinder
from asset2sim.experiments.interrupt import lost_interrupts_repeated, sigterm_as_interrupt
from asset2sim.runs import options as asked
from asset2sim.runs.command_line import Options, missing_package
from flows import PIPELINE
from schemas.errors import DONE, UsageError, complain, exit_code_of
from schemas.extensions import commands, object_at

if TYPE_CHECKING:
    from asset2sim.runs.request import RefineRequest
    from asset2sim.runs.result import RunResult

Refine = Callable[["RefineRequest"], "RunResult"]
Nightly = Callable[["RefineRequest"], int]

YOUNG_OBJECTS = 20_000
"""New objects after which Python looks for garbage. At its 700 a sixth of a short run's 7 s went into looking through
what is being imported, which stays."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command line and return its exit code."""
    for stream in (sys.stdout, sys.stderr):
        # A terminal of another encoding shows an escape for a letter that it lacks.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    if QuietFinder not in sys.meta_path:
        sys.meta_path.insert(0, QuietFinder)
    gc.set_threshold(YOUNG_OBJECTS)
    with lost_interrupts_repeated():
        return run_command(sys.argv[1:] if arguments is None else arguments, refine=refine, nightly=serve)


def run_command(arguments: Sequence[str], *, refine: Refine, nightly: Nightly) -> int:
    """Run one command line; ``refine`` and ``nightly`` start the flows. Returns the exit code.

    What a person did wrong, and what went wrong in a way that we know, is one line on standard error. A broken program
    is an exception, with its traceback.
    """

    def run() -> int:
        try:
            return _dispatch(asked.parse(arguments), refine, nightly)
        except ModuleNotFoundError as error:
            raise missing_package(error) from error

    return exit_code_of("asset2sim", run)


def _dispatch(options: Options, refine: Refine, nightly: Nightly) -> int:
    # --help needs none of it.
    from asset2sim.runs.request import refine_request, settings_of

    match options:
        case asked.NightlyOptions():
            return _run_nightly(refine_request(options), nightly)
        case asked.RefineOptions():
            return _run_refine(refine_request(options), refine)
    command = next(item for item in asked.all_commands() if type(options) is object_at(item.options))
    if command in commands():
        from asset2sim.models.gateway.environment import quiet_environment

        quiet_environment()
    # Where a command has commands of its own, the chosen one has the options.
    inner = get_subcommand(options, is_required=False)
    settings = settings_of(inner if isinstance(inner, Options) else options)
    return object_at(command.run)(options, settings) or DONE


def check(request: "RefineRequest") -> "RefineRequest":
    """The request with its assets. Raises UsageError for one that cannot be met, before anything is imported."""
    from asset2sim.models.gateway.environment import quiet_environment
    from asset2sim.runs.check_request import check_request

    found = check_request(request.data, request.out, request.settings, request.subset, request.asset_ids, request.limit)
    quiet_environment()
    return request.model_copy(update={"found": found})


def _run_refine(request: "RefineRequest", refine: Refine) -> int:
    """Run the flow on a request, tell the hook, and print the summary. Returns the exit code."""
    request = check(request)
    if not request.dry_run and find_spec("prefect") is None:
        from flows.local import refine_listed

        return refine_listed(request)
    if request.dry_run:
        return _dry_run(request)
    from asset2sim.runs.result import alert, exit_code

    result = alert(_refined(request, refine), request.strict)
    from flows.show import print_summary

    print_summary(result)
    return exit_code(result, request.strict)


def _dry_run(request: "RefineRequest") -> int:
    from flows.dry_run import print_dry_run

    print_dry_run(request)
    return DONE


def _refined(request: "RefineRequest", refine: Refine) -> "RunResult":
    """The flow's result. The hook hears of a run that broke down; of a mistake, its user hears here and now."""
    try:
        return refine(request)
    except UsageError:
        raise
    except Exception as error:
        from asset2sim.runs.result import alert_error

        warning = alert_error(request.out, request.settings.run, error)
        if warning is not None:
            complain(warning)
        raise


def _run_nightly(request: "RefineRequest", nightly: Nightly) -> int:
    """Serve the flow on its schedule until interrupted, or with ``now`` run it at once. Returns the exit code."""
    from flows.schedule import chosen_schedule

    request = check(request)
    if request.dry_run:
        return _dry_run(request)
    if request.now:
        return nightly(request)
    chosen_schedule(request.cron)
    # A service manager stops what it runs by SIGTERM: that is the usual end of a nightly, as Ctrl-C is.
    with suppress(KeyboardInterrupt), sigterm_as_interrupt():
        nightly(request)
    return DONE


def refine(request: "RefineRequest") -> "RunResult":
    """Run the flow on a request, with a Prefect server of its own where none is set."""
    with ready(request) as flow:
        return flow(request)


@contextmanager
def ready(request: "RefineRequest") -> Iterator[Refine]:
    """The flow, to be called within the block, with a server and the libraries that the run will need loading."""
    from asset2sim.catalog.mlflow_log import load_mlflow
    from asset2sim.catalog.switch import find_catalog
    from asset2sim.experiments.isolation.children import warm_up
    from asset2sim.models.gateway.environment import preload_litellm
    from asset2sim.storage.objects import working_folder
    from flows.server.server import temporary_server

    first = find_catalog(working_folder(request.out)) is None
    with temporary_server() as address:
        # The server takes seconds to load: load beside it what the run will need. Where a run has been before there may
        # be little to refine, or nothing: then the engines and LiteLLM would be loaded in vain.
        if first:
            warm_up(PIPELINE)
            preload_litellm(request.settings.model)
        from flows.refine_dataset import refine_dataset
        from flows.server.client import use_server

        if not first:
            threading.Thread(target=load_mlflow).start()
        with use_server(address):
            yield lambda asked: refine_dataset(
                asked.data, asked.out, asked.settings, asked.subset, asked.asset_ids, asked.limit, found=asked.found
            )


def serve(request: "RefineRequest") -> int:
    """Serve the nightly until interrupted, or have one night at once. Returns the exit code."""
    from flows.serve_pages import run_programs
    from flows.server.night_secrets import remove_old_secrets, secrets_kept
    from flows.server.server import STOP_LIMIT_S, serving, temporary_server

    if request.now:
        return _night_now(request)
    with temporary_server(schedules=True) as address, serving(request.out, address):
        remove_old_secrets(request.out)
        try:
            with secrets_kept(request) as safe:
                # Any user of the machine may read a command line.
                program = [sys.executable, "-m", "flows.serve_nightly", safe.model_dump_json()]
                run_programs({"nightly": [*program, *filter(None, [address])]}, STOP_LIMIT_S, together=True)
        finally:
            remove_old_secrets(request.out)
    return DONE


def _night_now(request: "RefineRequest") -> int:
    from flows.server.server import find_serving, temporary_server

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
        from asset2sim.catalog.switch import find_catalog
        from asset2sim.experiments.isolation.children import warm_up
        from asset2sim.storage.objects import working_folder

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
