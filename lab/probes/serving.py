"""Policies of our own behind openpi's websocket, in a process of their own: what asks them cannot tell them from
openpi's."""

import logging
import multiprocessing
import os
import pickle
import signal
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.frames import CloseCode
from websockets.sync.server import ServerConnection
from websockets.sync.server import serve as listen

from asset2sim.assets.child_process import end_with_parent
from lab.probes.observation import ActionKind, Policy, PolicyError, TrialEnding
from lab.probes.openpi_wire import CONTINUOUS, SPACE, answer_of, pack, seen_of, unpack
from schemas.errors import Asset2SimError

HOST = "127.0.0.1"
MOST_BYTES = 64 * 1024 * 1024
"""Largest question that is read."""
BEGIN_S = 300.0
"""Time for a policy to be made before it is served, s: an expert plans its way then."""
log = logging.getLogger(__name__)


class ServingError(Asset2SimError):
    """The process that makes a policy of our own died, or took too long."""


def serve(
    policy: Policy, port: int, told: Callable[[int], None], space: ActionKind | None = None, host: str = HOST
) -> None:
    """Answer whoever connects, until the process ends; ``told`` hears the port, which is a free one for 0. One question
    is answered at a time. ``space`` is said in the metadata. Raises OSError for a port that is taken."""
    turn = threading.Lock()

    def talk(connection: ServerConnection) -> None:
        metadata: dict[str, Any] = {CONTINUOUS: True} | ({} if space is None else {SPACE: space})
        connection.send(pack(metadata))
        with suppress(ConnectionClosed):
            for frame in connection:
                began = time.monotonic()
                try:
                    if isinstance(frame, str):
                        raise PolicyError(TrialEnding.REFUSED, "text; a question is a binary frame")
                    with turn:
                        chunk = policy(seen_of(unpack(frame)))
                    if space not in (None, chunk.kind):
                        raise ValueError(f"the policy answered {chunk.kind}, and said {space} in its metadata")
                    answer = answer_of(chunk)
                except Exception:  # whatever a policy raises is told to who asked, as openpi's server does
                    connection.send(traceback.format_exc())
                    connection.close(CloseCode.INTERNAL_ERROR, "the traceback was the frame before")
                    return
                answer["server_timing"] = {"infer_ms": 1000.0 * (time.monotonic() - began)}
                connection.send(pack(answer))

    with listen(talk, host, port, compression=None, max_size=MOST_BYTES, ping_interval=None) as server:
        told(server.socket.getsockname()[1])
        server.serve_forever()


@contextmanager
def served(make: Callable[[], Policy], space: ActionKind | None = None) -> Iterator[int]:
    """Serve the policy that ``make`` makes in a forked process while the block runs; gives its port. To be used where
    this process has one thread. Raises what ``make`` raises, and ServingError."""
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe()
    process = context.Process(target=_serve_made, args=(make, space, theirs, os.getpid()))
    process.start()
    theirs.close()
    try:
        if not ours.poll(BEGIN_S):
            raise ServingError(f"the policy was not made within {BEGIN_S:g} s")
        try:
            said = ours.recv()
        except EOFError as error:
            process.join()
            raise ServingError(f"the process that makes the policy ended with {process.exitcode}") from error
        if isinstance(said, Exception):
            raise said
        yield int(said)
    finally:
        process.kill()
        process.join()
        process.close()
        ours.close()


def _serve_made(make: Callable[[], Policy], space: ActionKind | None, pipe: Connection, parent: int) -> None:
    end_with_parent(parent)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        policy = make()
    except Exception as error:  # raised anew where the policy was asked for
        traceback.print_exc()
        try:
            pipe.send(error)
        except (pickle.PicklingError, AttributeError, TypeError):
            pipe.send(RuntimeError(f"{type(error).__name__}: {error}"))
        return
    serve(policy, 0, pipe.send, space)
