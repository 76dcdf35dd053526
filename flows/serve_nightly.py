"""Serve the nightly flow on its schedule, or have one night at once. As a program of its
own, ``python -m flows.serve_nightly REQUEST [SERVER]``, it is what ``asset2sim nightly`` starts and stops: once
interrupted, Prefect's serving leaves threads behind that keep its process from ending."""

import asyncio
import os
import shlex
import signal
import sys
import threading
import time
from contextlib import suppress
from uuid import UUID

from prefect.client.schemas.objects import State
from prefect.exceptions import TerminationSignal
from prefect.runner import Runner
from prefect.schedules import Cron
from prefect.states import Crashed
from prefect.types.entrypoint import EntrypointType

from asset2sim.catalog.text import output
from asset2sim.runs.request import RefineRequest
from flows.nightly import code_of_state, nightly, run_crash_hook
from flows.run_report import print_served
from flows.schedule import chosen_schedule
from flows.server.client import (
    CRASHED_NIGHT_MESSAGE,
    ONE_AT_A_TIME,
    clear_stale_runs,
    find_deployment,
    never_began,
    next_run,
    run_and_wait,
    use_server,
)
from flows.server.night_secrets import secrets_kept
from flows.server.server import FLOW, STOP_LIMIT_S, deployment_name
from schemas.errors import UsageError, complain


def parameters(request: RefineRequest) -> dict[str, object]:
    """The flow's parameters, as Prefect keeps them: JSON without secrets, and paths that mean the same from everywhere.
    With a settings file they hold what the options state: each night reads the file as it is then."""
    told = request.model_dump(mode="json")
    return {
        "data": str(request.data.absolute()),
        "out": str(request.out.absolute()),
        "settings": told["settings" if request.settings_file is None else "stated"],
        "settings_file": told["settings_file"],
        "subset": request.subset,
        "asset_ids": list(request.asset_ids),
        "limit": request.limit,
        "strict": request.strict,
        "secrets": request.secrets,
    }


def serve_nightly(request: RefineRequest, address: str | None = None) -> None:
    """Start the flow on schedule, with the request's parameters, until interrupted. Needs a Prefect server."""
    cron, timezone = chosen_schedule(request.cron)
    name = deployment_name(request.out)
    runner = Runner(name=name, pause_on_shutdown=True)
    schedule, told, kind = Cron(cron, timezone=timezone), parameters(request), EntrypointType.MODULE_PATH
    added = runner.add_flow(
        nightly, name, schedule=schedule, parameters=told, concurrency_limit=ONE_AT_A_TIME, entrypoint_type=kind
    )
    deployment_id = UUID(str(added))
    for lost in clear_stale_runs(deployment_id):
        # Its own secrets went with the process that served it.
        lost = lost.model_copy(update={"parameters": {**lost.parameters, "secrets": request.secrets}})
        run_crash_hook(nightly, lost, lost.state or Crashed(message=CRASHED_NIGHT_MESSAGE))
    ours = f"asset2sim nightly {shlex.quote(str(request.data))} --out {shlex.quote(str(request.out))} --now"
    prefects = f"{f'PREFECT_API_URL={address} ' if address else ''}prefect deployment run {FLOW}/{name}"
    print_served(request, f"'{cron}' ({timezone})", next_run(deployment_id), [ours, prefects])
    with suppress(KeyboardInterrupt, TerminationSignal, asyncio.CancelledError):
        asyncio.run(_serve_until_stopped(runner))


async def _serve_until_stopped(runner: Runner) -> None:
    """Serve, and on SIGTERM leave as on Ctrl-C: the schedule pauses, so that no unserved runs pile up. The
    runner's own way to take SIGTERM (3.8.8) ends the process before any of that."""
    task = asyncio.ensure_future(runner.start())
    # The runner installs its own handler in its first step.
    await asyncio.sleep(0)
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, task.cancel)
    await task


def end_with_parent() -> None:
    """Stop this process and its running night once the command that started it has ended, for any reason."""
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os.killpg(0, signal.SIGTERM)
        time.sleep(STOP_LIMIT_S)
        os.killpg(0, signal.SIGKILL)

    threading.Thread(target=watch, daemon=True).start()


def run_deployed_night(request: RefineRequest) -> int | None:
    """Run the deployment of the request's output folder once, and wait for it. Returns the exit code. None where the
    server knows no such deployment, or it is not served."""
    name = deployment_name(request.out)
    found = find_deployment(name)
    if found is None or found.status != "READY":
        return None
    output().print(f"{FLOW}/{name} runs now; Ctrl-C stops the waiting, not the night", soft_wrap=True)
    with secrets_kept(request) as safe:
        run = run_and_wait(UUID(str(found.id)), parameters(safe))
    if never_began(run):
        raise UsageError(f"another night of {FLOW}/{name} is at work; wait until it ends, this one was left out")
    state = run.state or Crashed(message="it has no state")
    code = code_of_state(state)
    if code:
        complain(f"the night ended {state.name}: {state.message or 'without a word'}")
    else:
        output().print(state.message or "", soft_wrap=True)
    return code


def run_night_here(request: RefineRequest) -> int:
    """Run the flow once in this process. Returns the exit code."""
    arguments = (request.data, request.out, request.settings, request.subset, request.asset_ids, request.limit)
    state: State = nightly(*arguments, strict=request.strict, return_state=True)
    return code_of_state(state)


if __name__ == "__main__":
    end_with_parent()
    server = sys.argv[2] if len(sys.argv) > 2 else None
    with use_server(server):
        serve_nightly(RefineRequest.model_validate_json(sys.argv[1]), server)
