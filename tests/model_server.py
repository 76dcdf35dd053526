"""A model server on this machine for tests: HTTP, OpenAI's chat protocol, answers from a script."""

import json
import socket
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Literal

from asset2sim.models.gateway import abilities, budget
from asset2sim.models.gateway.budget import Amount
from asset2sim.models.gateway.rate_limits import transaction


@dataclass(frozen=True)
class Reply:
    """One scripted answer. ``content`` is what the model says, or the error's message where ``status`` is not 200."""

    content: str | None = ""
    status: int = 200
    headers: dict[str, str] = field(default_factory=dict)
    hang: bool = False
    finish_reason: str = "stop"
    prompt_tokens: int = 11
    completion_tokens: int = 7
    tool_calls: tuple[tuple[str, str], ...] = ()
    """Tools that the model wants called: name, and arguments as the text that it wrote."""
    delay_s: float = 0.0
    """Time that the model thinks, s."""
    drip: Literal["", "body", "headers"] = ""
    """What is sent byte by byte, a hundredth of a second apart, without ever coming to an end."""
    drop: bool = False
    """Whether the connection is lost in the middle of the answer."""
    raw: bytes | None = None
    """The body, in place of one that the protocol would have."""


Script = Callable[[dict[str, Any]], Reply]
"""Answers a request by its body."""


@dataclass
class ModelServer:
    """The server's address and its requests so far: bodies, headers, keys, times, the most that were open at once."""

    api_base: str
    requests: list[dict[str, Any]] = field(default_factory=list)
    authorizations: list[str | None] = field(default_factory=list)
    headers: list[dict[str, str]] = field(default_factory=list)
    times: list[float] = field(default_factory=list)
    at_once: int = 0


@contextmanager
def serve(replies: Sequence[Reply] | Script, port: int = 0) -> Iterator[ModelServer]:
    """Serve the replies in order, the last one for ever, or what a script says to each request.

    A hanging or dripping reply lasts until the server is closed. ``port`` 0 is any free one; scripts are called by one
    thread at a time.
    """
    closing = threading.Event()
    http = ThreadingHTTPServer(("127.0.0.1", port), BaseHTTPRequestHandler)
    server = ModelServer(api_base=f"http://127.0.0.1:{http.server_address[1]}/v1")
    http.RequestHandlerClass = _handler(server, replies, closing)
    http.daemon_threads = True
    thread = threading.Thread(target=http.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
    thread.start()
    try:
        yield server
    finally:
        closing.set()
        http.shutdown()
        http.server_close()
        thread.join(5.0)


def _handler(
    server: ModelServer, replies: Sequence[Reply] | Script, closing: threading.Event
) -> type[BaseHTTPRequestHandler]:
    lock = threading.Lock()
    working = 0

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_POST(self) -> None:
            nonlocal working
            body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            with lock:
                number = len(server.requests)
                reply = replies(body) if callable(replies) else replies[min(number, len(replies) - 1)]
                server.requests.append(body)
                server.headers.append({**self.headers, "request line": self.requestline})
                server.authorizations.append(self.headers.get("Authorization"))
                server.times.append(time.monotonic())
                working += 1
                server.at_once = max(server.at_once, working)
            try:
                closing.wait(None if reply.hang else reply.delay_s)
                with lock:
                    working -= 1
                self._reply(reply, str(body["model"]))
            except OSError:
                self.close_connection = True  # the client has closed the connection

        def _reply(self, reply: Reply, model: str) -> None:
            if reply.drip:
                _drip(self.connection, reply.drip, closing)
            elif not reply.hang:
                self._send(reply, _payload(reply, model))
            self.close_connection = bool(reply.drip) or reply.hang or reply.drop

        def _send(self, reply: Reply, payload: bytes) -> None:
            self.send_response(reply.status)
            for name, value in {"Content-Type": "application/json", **reply.headers}.items():
                self.send_header(name, value)
            self.send_header("Content-Length", str(len(payload)))
            self.end_headers()
            self.wfile.write(payload[: len(payload) // 2] if reply.drop else payload)

        def log_message(self, *arguments: object) -> None:
            """Keep the test's output clean."""

    return Handler


def _drip(connection: socket.socket, what: str, closing: threading.Event) -> None:
    start = b"HTTP/1.1 200 OK\r\n"
    connection.sendall(start if what == "headers" else start + b"Content-Length: 1000000\r\n\r\n")
    while not closing.wait(0.01):
        connection.sendall(b"X" if what == "headers" else b" ")


def _payload(reply: Reply, model: str) -> bytes:
    if reply.raw is not None:
        return reply.raw
    return json.dumps(_success(reply, model) if reply.status == 200 else _failure(reply)).encode()


def _success(reply: Reply, model: str) -> dict[str, Any]:
    message: dict[str, Any] = {"role": "assistant", "content": reply.content}
    if reply.tool_calls:
        message["tool_calls"] = [
            {"id": f"call_{index}", "type": "function", "function": {"name": name, "arguments": arguments}}
            for index, (name, arguments) in enumerate(reply.tool_calls)
        ]
    return {
        "id": "scripted-1",
        "object": "chat.completion",
        "created": 0,
        "model": model,
        "choices": [{"index": 0, "message": message, "finish_reason": reply.finish_reason}],
        "usage": {
            "prompt_tokens": reply.prompt_tokens,
            "completion_tokens": reply.completion_tokens,
            "total_tokens": reply.prompt_tokens + reply.completion_tokens,
        },
    }


def _failure(reply: Reply) -> dict[str, Any]:
    return {"error": {"message": reply.content, "type": "scripted", "code": None}}


def forget_refusals() -> None:
    """Forget what servers refused, as a new process does."""
    abilities._refused.clear()


def spent_so_far(spender: budget.Budget, scope: str = budget.RUN_SCOPE) -> Amount:
    """The amount recorded for a scope of the run, without calls in flight."""
    with transaction(spender.file) as ledger:
        return budget._spent(ledger, spender.run_id, scope)
