"""A model server on this machine for tests: HTTP, OpenAI's chat protocol, answers from a script."""

import json
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any


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


@dataclass
class ModelServer:
    """Where the server listens, and what it was asked so far."""

    api_base: str
    requests: list[dict[str, Any]] = field(default_factory=list)
    authorizations: list[str | None] = field(default_factory=list)


@contextmanager
def serve(replies: Sequence[Reply]) -> Iterator[ModelServer]:
    """Serve the replies in order, the last one for ever. A hanging reply lasts until the server is closed."""
    closing = threading.Event()
    lock = threading.Lock()

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_POST(self) -> None:
            body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            with lock:
                reply = replies[min(len(server.requests), len(replies) - 1)]
                server.requests.append(body)
                server.authorizations.append(self.headers.get("Authorization"))
            if reply.hang:
                closing.wait(30.0)
                self.close_connection = True
                return
            payload = json.dumps(_success(reply, body["model"]) if reply.status == 200 else _failure(reply)).encode()
            self.send_response(reply.status)
            for name, value in {"Content-Type": "application/json", **reply.headers}.items():
                self.send_header(name, value)
            self.send_header("Content-Length", str(len(payload)))
            self.end_headers()
            self.wfile.write(payload)

        def log_message(self, *arguments: object) -> None:
            """Keep the test's output clean."""

    http = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    http.daemon_threads = True
    server = ModelServer(api_base=f"http://127.0.0.1:{http.server_address[1]}/v1")
    thread = threading.Thread(target=http.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
    thread.start()
    try:
        yield server
    finally:
        closing.set()
        http.shutdown()
        http.server_close()
        thread.join(5.0)


def _success(reply: Reply, model: str) -> dict[str, Any]:
    message = {"role": "assistant", "content": reply.content}
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
