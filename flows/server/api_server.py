"""A temporary Prefect API server, as a program of its own: ``python -P api_server.py LISTENING_FD few|all``.

Prefect can start one itself, but in the terminal's process group, where Ctrl-C kills it under the run that needs it,
and without a way to notice that the run is gone. This one is started in a session of its own, serves on a socket that
listens already, and ends when its standard input does.
"""

import gc
import socket
import sys
import threading


def serve(listener: socket.socket, schedules: bool) -> None:
    """Serve until standard input ends; ``schedules`` adds the services that start scheduled runs."""
    # Garbage collection takes a sixth of the 6 s of loading, and finds nothing: what is loaded stays.
    gc.disable()
    import uvicorn
    from prefect.server.api.server import create_app

    app = create_app(ephemeral=not schedules, final=True)
    gc.freeze()
    gc.enable()
    server = uvicorn.Server(uvicorn.Config(app, log_level="error", lifespan="on", timeout_graceful_shutdown=1))

    def watch() -> None:
        sys.stdin.buffer.read()
        server.should_exit = True

    threading.Thread(target=watch, daemon=True).start()
    server.run(sockets=[listener])


if __name__ == "__main__":
    serve(socket.socket(fileno=int(sys.argv[1])), schedules=sys.argv[2] == "all")
