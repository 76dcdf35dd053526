"""A temporary Prefect API server, as a program of its own: ``python -P api_server.py LISTENING_FD few|all [EMPTY]``;
EMPTY is the folder in which empty databases are kept.

Prefect can start one itself, but in the terminal's process group, where Ctrl-C kills it under the run that needs it,
and without a way to notice that the run is gone. This one is started in a session of its own, serves on a socket that
listens already, and ends when its standard input does.
"""

import gc
import socket
import sys
import threading
from pathlib import Path


def serve(listener: socket.socket, schedules: bool, empty: Path | None = None) -> None:
    """Serve until standard input ends; ``schedules`` adds the services that start scheduled runs."""
    # Garbage collection takes a sixth of the 6 s of loading, and finds nothing: what is loaded stays.
    gc.disable()
    import uvicorn
    from prefect.server.api.server import create_app

    if empty is not None:
        begin_database(empty)
    app = create_app(ephemeral=not schedules, final=True)
    gc.freeze()
    gc.enable()
    server = uvicorn.Server(uvicorn.Config(app, log_level="error", lifespan="on", timeout_graceful_shutdown=1))

    def watch() -> None:
        sys.stdin.buffer.read()
        server.should_exit = True

    threading.Thread(target=watch, daemon=True).start()
    server.run(sockets=[listener])


def begin_database(empty: Path) -> None:
    """Where Prefect's own database is still to be made, copy an empty one of this version, or make it and keep one."""
    import asyncio

    import prefect
    from prefect.server.database import provide_database_interface
    from prefect.settings import PREFECT_API_DATABASE_CONNECTION_URL, PREFECT_HOME

    from asset2sim.storage.empty_databases import copy_empty, keep_empty

    file, kept = PREFECT_HOME.value() / "prefect.db", empty / f"prefect-{prefect.__version__}.db"
    # A user may have named another database, in the environment or in Prefect's files.
    if str(PREFECT_API_DATABASE_CONNECTION_URL.value()) != f"sqlite+aiosqlite:///{file}" or file.exists():
        return
    if not copy_empty(kept, file):
        database = provide_database_interface()
        asyncio.run(database.create_db())
        # Another run's server may have begun to write into it.
        keep_empty(file, kept, *(f'DELETE FROM "{name}"' for name in database.Base.metadata.tables))


if __name__ == "__main__":
    serve(socket.socket(fileno=int(sys.argv[1])), sys.argv[2] == "all", *map(Path, sys.argv[3:]))
