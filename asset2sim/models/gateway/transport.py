"""HTTP transport for LiteLLM's clients that limits the size and the duration of a response. Imports httpx, which
LiteLLM brings, so it is itself imported late."""

import time
from collections.abc import Iterator

import httpx

from schemas.errors import UnreadableAnswerError

MAX_ANSWER_BYTES = 4_000_000
"""Longest body of a provider's response that is read, bytes: four times the longest answer that is looked at."""
SHORTER = "lower max_completion_tokens, or choose another model"
MAX_CONNECTIONS = 200
"""Connections that are open at the same time: more than any machine's workers ask for."""


class BoundedTransport(httpx.BaseTransport):
    """Sends a request through a client of its own, which knows the system's proxies, and reads the response whole.
    Bodies are requested uncompressed, so that the counted size is the size in memory. Reading ends at the request's
    read time limit: httpx restarts that for every piece, so that a slow server would never reach it."""

    def __init__(self, client: httpx.Client) -> None:
        self._client = client

    def handle_request(self, request: httpx.Request) -> httpx.Response:
        """The response, its body read. Raises ``UnreadableAnswerError`` and ``httpx.ReadTimeout``."""
        limit_s = request.extensions.get("timeout", {}).get("read")
        deadline = None if limit_s is None else time.monotonic() + limit_s
        request.headers["Accept-Encoding"] = "identity"
        response = self._client.send(request, stream=True)
        try:
            _refuse_unreadable(response)
            body = b"".join(_pieces(response, deadline))
        finally:
            response.close()
        stale = (b"transfer-encoding", b"content-length")
        headers = [item for item in response.headers.raw if item[0].lower() not in stale]
        return httpx.Response(response.status_code, headers=headers, content=body, extensions=response.extensions)


def _refuse_unreadable(response: httpx.Response) -> None:
    stated = response.headers.get("Content-Length", "")
    if stated.isdigit() and int(stated) > MAX_ANSWER_BYTES:
        raise UnreadableAnswerError(
            f"the answer has {int(stated)} bytes; the most that is read is {MAX_ANSWER_BYTES}; {SHORTER}"
        )
    encoding = response.headers.get("Content-Encoding", "identity")
    if encoding.lower() != "identity":
        raise UnreadableAnswerError(
            f"the answer is compressed ({encoding[:20]}), which was not asked for and is not read; choose another model"
        )


def _pieces(response: httpx.Response, deadline: float | None) -> Iterator[bytes]:
    size = 0
    for piece in response.iter_raw():
        size += len(piece)
        if size > MAX_ANSWER_BYTES:
            raise UnreadableAnswerError(
                f"the answer has more than the {MAX_ANSWER_BYTES} bytes that are read; {SHORTER}"
            )
        if deadline is not None and time.monotonic() > deadline:
            raise httpx.ReadTimeout("the answer was still coming when its time was up", request=response.request)
        yield piece


class UnclosableClient(httpx.Client):
    """A client that all threads share until the process ends; closing it does nothing."""

    def close(self) -> None:
        """Does nothing: other threads still use the client."""
