"""Serve the nightly flow on the schedule that ``catalog.yaml`` holds, or have one night at once.

As a program of its own, ``python -m flows.serve_nightly REQUEST [SERVER]``, it is what ``asset2sim nightly`` starts and
stops: once interrupted, Prefect's serving leaves threads behind that keep its process from ending.
"""

import asyncio
import os
import shlex
import signal
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path
from uuid import UUID

from prefect.exceptions import TerminationSignal
from prefect.runner import Runner
from prefect.schedules import Cron
from prefect.states import Crashed
from prefect.types.entrypoint import EntrypointType

from asset2sim.catalog.schedule import nightly_schedule
from asset2sim.cli.night import print_served
from asset2sim.cli.request import RefineRequest
from flows.nightly import nightly, tell_of_crash
from schemas.location import absolute
from tasks.deployment import LOST, ONE_AT_A_TIME, next_run, start_afresh
from tasks.prefect_client import use_server
from tasks.serving import FLOW, STOP_LIMIT_S, deployment_name

CATALOG_FILE = Path(__file__).resolve().parents[1] / "catalog.yaml"


def parameters(request: RefineRequest) -> dict[str, object]:
    """The flow's parameters, as Prefect keeps them: JSON, and paths that mean the same from everywhere."""
    return {
        "data": str(absolute(request.data)),
        "out": str(absolute(request.out)),
        "settings": request.settings.model_dump(mode="json"),
        "subset": request.subset,
        "asset_ids": list(request.asset_ids),
        "limit": request.limit,
        "strict": request.strict,
    }


def serve_nightly(request: RefineRequest, address: str | None = None) -> None:
    """Start the flow on schedule, with the request's parameters, until interrupted. Needs a Prefect server."""
    cron, timezone = nightly_schedule(CATALOG_FILE)
    name = deployment_name(request.out)
    runner = Runner(name=name, pause_on_shutdown=True)
    added = runner.add_flow(
        nightly,
        name=name,
        schedule=Cron(cron, timezone=timezone),
        parameters=parameters(request),
        concurrency_limit=ONE_AT_A_TIME,
        entrypoint_type=EntrypointType.MODULE_PATH,
    )
    deployment_id = UUID(str(added))
    for lost in start_afresh(deployment_id):
        tell_of_crash(nightly, lost, lost.state or Crashed(message=LOST))
    data, out = str(request.data), str(request.out)
    ours = f"asset2sim nightly {shlex.quote(data)} --out {shlex.quote(out)} --now"
    prefects = f"{f'PREFECT_API_URL={address} ' if address else ''}prefect deployment run {FLOW}/{name}"
    print_served(data, out, cron, timezone, next_run(deployment_id), [ours, prefects])
    with suppress(KeyboardInterrupt, TerminationSignal, asyncio.CancelledError):
        asyncio.run(_serve_until_stopped(runner))


async def _serve_until_stopped(runner: Runner) -> None:
    """Serve, and on SIGTERM leave as on Ctrl-C: the schedule pauses, so that no runs pile up that nobody starts.

    The runner's own way to take SIGTERM (3.8.8) ends the process before any of that.
    """
    task = asyncio.ensure_future(runner.start())
    # It installs its handler in its first step.
    await asyncio.sleep(0)
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, task.cancel)
    await task


def end_with_parent() -> None:
    """Stop this process, and the night it may be at, when the command that started it is gone, however it went."""
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os.killpg(0, signal.SIGTERM)
        time.sleep(STOP_LIMIT_S)
        os.killpg(0, signal.SIGKILL)

    threading.Thread(target=watch, daemon=True).start()


if __name__ == "__main__":
    end_with_parent()
    server = sys.argv[2] if len(sys.argv) > 2 else None
    with use_server(server):
        serve_nightly(RefineRequest.model_validate_json(sys.argv[1]), server)
