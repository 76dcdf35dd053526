"""This process as a client of a Prefect server: the nightly's deployment there, and a run of it at once."""

import logging
import time
import urllib.error
import urllib.request
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, wait
from contextlib import contextmanager
from datetime import UTC, datetime
from typing import cast
from uuid import UUID

from prefect.client.orchestration import SyncPrefectClient, get_client
from prefect.client.schemas.actions import GlobalConcurrencyLimitUpdate
from prefect.client.schemas.filters import (
    DeploymentFilter,
    DeploymentFilterId,
    FlowRunFilter,
    FlowRunFilterExpectedStartTime,
    FlowRunFilterState,
    FlowRunFilterStateType,
)
from prefect.client.schemas.objects import ConcurrencyLimitConfig, ConcurrencyLimitStrategy, FlowRun, StateType
from prefect.client.schemas.responses import DeploymentResponse
from prefect.client.schemas.sorting import FlowRunSort
from prefect.events.worker import EventsWorker
from prefect.exceptions import ObjectNotFound
from prefect.settings import PREFECT_API_URL, temporary_settings
from prefect.states import Crashed, Scheduled

from flows.server.server import FLOW
from schemas.errors import Asset2SimError

logger = logging.getLogger(__name__)

SCHEDULE_LIMIT_S = 60.0
"""Time that the server gets to schedule the first run, s: its scheduler works every 5 s."""
CRASHED_NIGHT_MESSAGE = "the night's process and the one that served it are gone: killed, or the machine went down"
"""Message on a night that the server still shows as running when the serving starts again."""
MAX_RUNS = 200
"""Most runs that one query to the server returns: its default limit."""
POLL_S = 1.0
"""Time between two looks at a run, s."""

ONE_AT_A_TIME = ConcurrencyLimitConfig(limit=1, collision_strategy=ConcurrencyLimitStrategy.CANCEL_NEW)
"""A night that finds the last one still at work is cancelled: queued, nights that take longer than a day pile up."""


def client() -> SyncPrefectClient:
    """A client of the server in use; a context manager."""
    return get_client(sync_client=True)


def clear_stale_runs(deployment_id: UUID) -> list[FlowRun]:
    """Mark the deployment's running runs as crashed, free their slots, and delete scheduled runs whose time is past.
    Returns the crashed runs.

    A server that is killed during a run does not free the run's slot, so every later night would be cancelled; and
    overdue nights would all start now. Call it only from the one process that serves the deployment; runs on one OUT
    lock each other out anyway.
    """
    with client() as server:
        lost = _runs(server, deployment_id, (StateType.RUNNING, StateType.PENDING, StateType.CANCELLING))
        for run in lost:
            server.set_flow_run_state(run.id, Crashed(message=CRASHED_NIGHT_MESSAGE), force=True)
        found = server.read_deployment(deployment_id).global_concurrency_limit
        if found is not None and found.active_slots:
            server.update_global_concurrency_limit(found.name, GlobalConcurrencyLimitUpdate(active_slots=0))
        for run in _runs(server, deployment_id, (StateType.SCHEDULED,)):
            if run.expected_start_time is not None and run.expected_start_time < datetime.now(UTC):
                server.delete_flow_run(run.id)
        return [server.read_flow_run(run.id) for run in lost]


def count_skipped_runs(deployment_id: UUID, since: datetime) -> int:
    """Number of the deployment's runs due after ``since`` that were cancelled because another one was at work."""
    with client() as server:
        found = _runs(server, deployment_id, (StateType.CANCELLED,), since=since)
    return sum(never_began(run) for run in found)


def never_began(run: FlowRun) -> bool:
    """Whether the run was cancelled before its first step, as happens while another run is at work."""
    return run.state is not None and run.state.is_cancelled() and not run.run_count


def next_run(deployment_id: UUID) -> datetime | None:
    """Time of the deployment's next scheduled run; None where the server schedules none within ``SCHEDULE_LIMIT_S``."""
    end = time.monotonic() + SCHEDULE_LIMIT_S
    with client() as server:
        while True:
            planned = _runs(server, deployment_id, (StateType.SCHEDULED,), limit=1)
            if planned:
                return planned[0].expected_start_time
            if time.monotonic() > end:
                return None
            time.sleep(POLL_S)


def _runs(
    server: SyncPrefectClient,
    deployment_id: UUID,
    states: Sequence[StateType],
    limit: int = MAX_RUNS,
    since: datetime | None = None,
) -> list[FlowRun]:
    """The deployment's runs in these states, due after ``since`` where that is given, in the order of their times."""
    due = FlowRunFilterExpectedStartTime(after_=since) if since else None
    state = FlowRunFilterState(type=FlowRunFilterStateType(any_=list(states)))
    return server.read_flow_runs(
        deployment_filter=DeploymentFilter(id=DeploymentFilterId(any_=[deployment_id])),
        flow_run_filter=FlowRunFilter(state=state, expected_start_time=due),
        sort=FlowRunSort.EXPECTED_START_TIME_ASC,
        limit=limit,
    )


def find_deployment(name: str) -> DeploymentResponse | None:
    """The nightly deployment of this name; None where the server has none."""
    with client() as server:
        try:
            return server.read_deployment_by_name(f"{FLOW}/{name}")
        except ObjectNotFound:
            return None


def run_and_wait(deployment_id: UUID, parameters: dict[str, object]) -> FlowRun:
    """Start a run of the deployment now, and wait for its end."""
    with client() as server:
        run = server.create_flow_run_from_deployment(deployment_id, parameters=parameters, state=Scheduled())
        while True:
            found = server.read_flow_run(run.id)
            if found.state is not None and found.state.is_final():
                return found
            time.sleep(POLL_S)


START_LIMIT_S = 300.0
"""Time in which a server must answer, s: 5 to 10 is usual, and on a machine with six times its cores' work 120 is not
enough; the first start of all makes its database too."""
SEND_LIMIT_S = 60.0
"""Time that Prefect's background services get to send what they hold, s: chosen, far more than one request is given."""
ASK_LIMIT_S = 20.0
"""Time that one request gets, s: what a starting server has taken in and forgotten is asked again."""


class PrefectServerError(Asset2SimError):
    """The Prefect server did not start."""


@contextmanager
def use_server(address: str | None) -> Iterator[None]:
    """Run flows against the server at ``address`` within the block; None leaves Prefect to the user's configuration.
    Waits until the server answers; raises ``PrefectServerError`` if it does not."""
    if address is None:
        yield
        return
    wait_for(address)
    with temporary_settings({PREFECT_API_URL: address}):
        try:
            yield
        finally:
            send_held()


def send_held(limit_s: float = SEND_LIMIT_S) -> None:
    """Have Prefect's background services send the logs and events that they hold, and end them: the server may go next.
    Those that are not done within the limit are cancelled, with a warning; by themselves (Prefect 3.8.8) they would
    wait for an answer without end, here and again as the process exits."""
    # All kinds of services are kept in one place, and forget their tasks as they are told to stop.
    services = EventsWorker._instances.values()  # type: ignore[misc]  # of a generic class
    tasks = [service._task for service in services if service._task is not None]
    _, left = cast("tuple[set[Future[bool]], set[Future[bool]]]", EventsWorker.drain_all(timeout=limit_s))
    if left:
        logger.warning("Prefect's server took no logs or events for %g s: its pages lack the last ones", limit_s)
        for task in tasks:
            task.get_loop().call_soon_threadsafe(task.cancel)
        wait(left, limit_s)


def wait_for(address: str) -> None:
    """Return once the server at ``address`` answers. Raises ``PrefectServerError``."""
    end = time.monotonic() + START_LIMIT_S
    problem = "no answer"
    while time.monotonic() < end:
        try:
            with urllib.request.urlopen(f"{address}/health", timeout=ASK_LIMIT_S):
                return
        except urllib.error.HTTPError as error:
            problem = f"it answered {error.code}"
        except OSError as error:
            problem = str(error)
            if isinstance(getattr(error, "reason", error), ConnectionError):
                break
        time.sleep(0.2)
    raise PrefectServerError(
        f"the Prefect server at {address} does not serve ({problem}); its log is api_server.log in PREFECT_HOME"
    )
