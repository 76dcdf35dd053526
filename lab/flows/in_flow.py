"""Work of the laboratory as a flow of Prefect's, on a server that lives as long as it."""

from collections.abc import Callable
from typing import TypeVar

from prefect import flow

from flows.server.client import use_server
from flows.server.server import temporary_server

Result = TypeVar("Result")


def in_flow(name: str, work: Callable[[], Result]) -> Result:
    """The work's result, done as a flow of this name."""
    with temporary_server() as address, use_server(address):
        return flow(name=name, persist_result=False, validate_parameters=False)(work)()
