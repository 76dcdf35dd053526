"""The nightly's deployment on a Prefect server: when it runs next, and a run of it at once."""

import time
from datetime import UTC, datetime
from uuid import UUID

from prefect.client.orchestration import SyncPrefectClient, get_client
from prefect.client.schemas.actions import GlobalConcurrencyLimitUpdate
from prefect.client.schemas.filters import (
    DeploymentFilter,
    DeploymentFilterId,
    FlowRunFilter,
    FlowRunFilterState,
    FlowRunFilterStateType,
)
from prefect.client.schemas.objects import ConcurrencyLimitConfig, ConcurrencyLimitStrategy, FlowRun, State, StateType
from prefect.client.schemas.responses import DeploymentResponse
from prefect.client.schemas.sorting import FlowRunSort
from prefect.exceptions import ObjectNotFound
from prefect.states import Scheduled

from tasks.serving import FLOW

PLAN_LIMIT_S = 60.0
"""Time that the server's scheduler gets to plan the first run, s: it looks every 5 s."""
POLL_S = 1.0
"""Time between two looks at a run, s."""

ONE_AT_A_TIME = ConcurrencyLimitConfig(limit=1, collision_strategy=ConcurrencyLimitStrategy.CANCEL_NEW)
"""A night that finds the last one still at work is cancelled: queued, nights that take longer than a day pile up."""


def client() -> SyncPrefectClient:
    """A client of the server in use; a context manager."""
    return get_client(sync_client=True)


def start_afresh(deployment_id: UUID) -> None:
    """Count no run of the deployment as going on, and drop the planned ones whose time is past.

    A server that goes down during a run, killed for instance, forgets to give the run's slot back, and every later
    night would be cancelled. Nights that nobody was there to start would all start now. Only for whoever alone serves
    the deployment; runs on one OUT lock each other out anyway.
    """
    with client() as server:
        found = server.read_deployment(deployment_id).global_concurrency_limit
        if found is not None and found.active_slots:
            server.update_global_concurrency_limit(found.name, GlobalConcurrencyLimitUpdate(active_slots=0))
        for run in _planned(server, deployment_id, limit=200):
            if run.expected_start_time is not None and run.expected_start_time < datetime.now(UTC):
                server.delete_flow_run(run.id)


def next_run(deployment_id: UUID, limit_s: float = PLAN_LIMIT_S) -> datetime | None:
    """When the server will start the deployment next, as it has planned; None where it plans nothing in time."""
    end = time.monotonic() + limit_s
    with client() as server:
        while True:
            planned = _planned(server, deployment_id, limit=1)
            if planned:
                return planned[0].expected_start_time
            if time.monotonic() > end:
                return None
            time.sleep(POLL_S)


def _planned(server: SyncPrefectClient, deployment_id: UUID, limit: int) -> list[FlowRun]:
    """The deployment's runs that have not begun, the next one first."""
    return server.read_flow_runs(
        deployment_filter=DeploymentFilter(id=DeploymentFilterId(any_=[deployment_id])),
        flow_run_filter=FlowRunFilter(
            state=FlowRunFilterState(type=FlowRunFilterStateType(any_=[StateType.SCHEDULED]))
        ),
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


def run_and_follow(deployment_id: UUID, parameters: dict[str, object]) -> State:
    """Start a run of the deployment now, and wait for the state in which it ends."""
    with client() as server:
        run = server.create_flow_run_from_deployment(deployment_id, parameters=parameters, state=Scheduled())
        while True:
            state = server.read_flow_run(run.id).state
            if state is not None and state.is_final():
                return state
            time.sleep(POLL_S)
