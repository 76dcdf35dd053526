"""Serving the viewer's page: on this machine alone unless told otherwise, and with no request to any other."""

import io
import socket
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asset2sim.engines.registry import require
from schemas.errors import UsageError
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine

if TYPE_CHECKING:
    import viser

    from asset2sim.viewer.viewer import Viewer

HOW_TO_INSTALL = "pip install -c constraints.txt -e '.[view]'"


@contextmanager
def open_viewer(
    out: Path | str, asset_id: str | None, *, engine: Engine, host: str, port: int, settings: EngineSettings
) -> Iterator["Viewer"]:
    """The viewer of OUT, serving and simulating until the context ends. Raises UsageError where viser or the engine is
    not installed, for an address that cannot be served on, an OUT without a catalog and an unknown asset."""
    with open_server(engine, host, port, "asset2sim") as server:
        from asset2sim.viewer.viewer import Viewer

        with Viewer(out, server, asset_id, engine, settings) as viewer:
            yield viewer


@contextmanager
def open_server(engine: Engine, host: str, port: int, title: str) -> Iterator["viser.ViserServer"]:
    """A server of pages with this title, until the context ends. Raises UsageError where viser or the engine is not
    installed, and for an address that cannot be served on."""
    if find_spec("viser") is None:
        raise UsageError(f"the viewer needs viser, which is not installed; {HOW_TO_INSTALL}")
    require(engine)
    check_address(host, port)
    import viser

    # It prints where it listens, and so does the command.
    with redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host=host, port=port, label=title, verbose=False)
    # Any page that connects may ask for it: a tunnel through viser's public server.
    server.request_share_url = no_share  # type: ignore[method-assign]
    try:
        yield server
    finally:
        with redirect_stdout(io.StringIO()):
            server.stop()


def no_share(*_: Any, **__: Any) -> None:
    """No address: the viewer is served from this machine alone."""


def check_address(host: str, port: int, use: str = "", option: str = "--port") -> None:
    """Raise UsageError, naming its ``use``, for an address that is taken; viser would take the next port."""
    try:
        socket.create_server((host, port)).close()
    except OSError as error:
        why = f"cannot be used{use} ({error.strerror or error})"
        raise UsageError(f"port {port} of {host} {why}; choose another with {option} or --host") from error
