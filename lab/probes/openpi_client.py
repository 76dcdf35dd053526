"""A policy behind openpi's websocket: asked over one connection an episode, which is made anew where it breaks."""

import time
import uuid
from types import TracebackType
from typing import Any, Self

from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.frames import CloseCode
from websockets.sync.client import ClientConnection, connect

from lab.probes.observation import ActionKind, Chunk, Observation, PolicyError, TrialEnding, refused
from lab.probes.openpi_wire import (
    CONTINUOUS,
    RESOLUTION,
    SESSION,
    SIDE_PX,
    SPACE,
    Camera,
    check_metadata,
    chunk_of,
    observation,
    pack,
    unpack,
)
from lab.schemas.settings import ProbeSettings

BACKOFF_S, LONGEST_BACKOFF_S = 0.1, 2.0
"""Wait before the second attempt at a connection, doubled up to the longest."""
TIMES = 2
"""How often a question is put at most: once more over a new connection where the first one breaks."""


class OpenPiPolicy:
    """A policy at ``host:port`` as a context manager that is called with what is seen, ``secure`` over TLS; ``key`` is
    its server's API key. ``kind`` is what its actions are, unless its server says so. Raises PolicyError: no server
    there, gone, too late, metadata that asks for what is not sent, or an answer that is none."""

    def __init__(
        self,
        host: str,
        port: int,
        kind: ActionKind = "joint_velocity",
        camera: Camera = "left",
        settings: ProbeSettings | None = None,
        *,
        secure: bool = False,
        key: str = "",
    ) -> None:
        self.uri, self.kind, self.camera = f"{'wss' if secure else 'ws'}://{host}:{port}", kind, camera
        self.headers, self.session = {"Authorization": f"Api-Key {key}"} if key else None, str(uuid.uuid4())
        self.settings = settings or ProbeSettings()
        self.metadata: dict[str, Any] = {}
        self._connection: ClientConnection | None = None
        self._asked = False

    def __enter__(self) -> Self:
        self._open(self.settings.connect_s, TrialEnding.UNREACHABLE)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._close()

    def __call__(self, seen: Observation) -> Chunk:
        """The policy's answer. Raises PolicyError."""
        height, width = self.metadata.get(RESOLUTION) or (SIDE_PX, SIDE_PX)
        session = {"session_id": self.session} if self.metadata.get(SESSION) else {}
        answer = unpack(self._answer(pack(observation(seen, self.camera, (height, width)) | session)))
        return chunk_of(answer, self.kind, self.settings.most_actions, bool(self.metadata.get(CONTINUOUS)))

    def _answer(self, frame: bytes) -> bytes:
        """The frame that answers one. The policies keep nothing between questions, so one may be put again."""
        lost = ""
        for _ in range(TIMES):
            if self._connection is None:
                self._open(self.settings.reconnect_s, TrialEnding.DIED)
            assert self._connection is not None
            limit = self.settings.answer_s if self._asked else self.settings.first_answer_s
            try:
                self._connection.send(frame)
                said = self._connection.recv(timeout=limit)
            except (TimeoutError, ConnectionClosed, OSError) as error:
                closing = self._connection.protocol.close_sent
                self._close()  # a late answer must not be taken for the next one
                if closing is not None and closing.code == CloseCode.MESSAGE_TOO_BIG:
                    raise refused(f"{self.uri} answered more than {self.settings.most_bytes} bytes") from error
                if isinstance(error, TimeoutError):
                    raise PolicyError(TrialEnding.TIMED_OUT, f"{self.uri} did not answer within {limit:g} s") from error
                lost = str(error)
                continue
            self._asked = True
            if isinstance(said, str):
                self._close()
                raise refused(f"{self.uri} answered an error: {said.strip().splitlines()[-1] if said.strip() else ''}")
            return said
        raise PolicyError(
            TrialEnding.DIED, f"{self.uri} closed the connection {TIMES} times on the same question: {lost}"
        )

    def _open(self, limit_s: float, ending: TrialEnding) -> None:
        """Connect and hear the metadata, trying again with growing waits until ``limit_s`` is over."""
        end, wait = time.monotonic() + limit_s, BACKOFF_S
        while True:
            left = max(end - time.monotonic(), BACKOFF_S)
            try:
                # No pings: openpi's server computes in the loop that would answer them. No proxy: robots are near.
                self._connection = connect(
                    self.uri, compression=None, max_size=self.settings.most_bytes, open_timeout=left,
                    ping_interval=None, proxy=None, close_timeout=1.0, additional_headers=self.headers,
                )  # fmt: skip
                said = self._connection.recv(timeout=left)
                break
            except (OSError, EOFError, InvalidHandshake, ConnectionClosed) as error:  # TimeoutError is an OSError
                self._close()
                if time.monotonic() + wait >= end:
                    what = f"{type(error).__name__}: {error}"
                    raise PolicyError(ending, f"no policy at {self.uri} within {limit_s:g} s ({what})") from error
                time.sleep(wait)
                wait = min(2.0 * wait, LONGEST_BACKOFF_S)
        if isinstance(said, str):
            self._close()
            raise refused(f"{self.uri} began with text; openpi's servers begin with their metadata")
        self.metadata, self._asked = unpack(said), False
        try:
            check_metadata(self.metadata)
        except PolicyError:
            self._close()
            raise
        self.kind = self.metadata.get(SPACE) or self.kind

    def _close(self) -> None:
        if self._connection is not None:
            self._connection.close()
        self._connection = None
