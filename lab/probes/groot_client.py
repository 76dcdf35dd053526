"""A policy behind GR00T's server: ZeroMQ REQ/REP with msgpack, as Isaac-GR00T's ``PolicyClient`` speaks it.

Checked against the public code of Isaac-GR00T (``gr00t/policy/server_client.py``) and its example for DROID of N1.6,
whose checkpoint is served with ``--use-sim-policy-wrapper``; no checkpoint of theirs has answered this client.
"""

import io
import time
from types import TracebackType
from typing import Any, Self

import msgpack
import numpy as np
import zmq

from lab.probes.observation import JOINTS, Chunk, Observation, Picture, PolicyError, TrialEnding, checked_chunk, refused
from lab.probes.openpi_wire import CLOSED, Camera, resized
from lab.schemas.settings import ProbeSettings

HEIGHT_PX, WIDTH_PX = 180, 320
"""Size of a picture as it is sent."""
EXTERIOR, WRIST = "video.exterior_image_1_left", "video.wrist_image_left"
POSITIONS, GRIPPER = "state.joint_position", "state.gripper_position"
PROMPT = "annotation.language.language_instruction"
ACTION_POSITIONS, ACTION_GRIPPER = "action.joint_position", "action.gripper_position"
MODALITIES = {
    "video": (EXTERIOR, WRIST), "state": (POSITIONS, GRIPPER), "language": (PROMPT,),
    "action": (ACTION_POSITIONS, ACTION_GRIPPER),
}  # fmt: skip
"""Modality of GR00T → the keys of it that are sent, or of ``action`` read, with the modality's name before them but for
the instruction's."""
PING_S = 2.0
"""Time for one answer to a ping, s."""


def observation(seen: Observation, camera: Camera = "left") -> dict[str, object]:
    """Message to GR00T N1.6's DROID policy: uint8 pictures (1, 1, 180, 320, 3), float32 positions (1, 1, 7) in rad
    and gripper (1, 1, 1), 0 open … 1 closed, and a list of one instruction: batch, time, and the rest."""
    outside = seen.exterior_left if camera == "left" else seen.exterior_right

    def framed(picture: Picture) -> Picture:
        return resized(picture, HEIGHT_PX, WIDTH_PX)[None, None]

    return {
        EXTERIOR: framed(outside),
        WRIST: framed(seen.wrist),
        POSITIONS: np.asarray(seen.joints, dtype=np.float32)[None, None],
        GRIPPER: np.array([[[seen.gripper]]], dtype=np.float32),
        PROMPT: [seen.prompt],
    }


def nested(flat: dict[str, object]) -> dict[str, object]:
    """The same message as a policy without the wrapper for simulations takes it: a mapping a modality, and the
    instruction a list of a list."""
    found: dict[str, object] = {
        name: {key.removeprefix(f"{name}."): flat[key] for key in keys}
        for name, keys in MODALITIES.items() if name in ("video", "state")
    }  # fmt: skip
    return found | {"language": {PROMPT: [flat[PROMPT]]}}


def check_modalities(config: object) -> None:
    """Raise PolicyError, which names it, where a server's modality config asks for what it is not sent, or does not
    answer what is read. A server that has none is taken as it is."""
    for name, keys in MODALITIES.items():
        part = config.get(name) if isinstance(config, dict) else None
        said = part.get("as_json", part) if isinstance(part, dict) else {}
        asked, ours = set(said.get("modality_keys", ())), {key.removeprefix(f"{name}.") for key in keys}
        odd = (ours - asked if asked else set()) if name == "action" else asked - ours
        if odd:
            does = "does not answer" if name == "action" else "asks for what is not sent:"
            raise refused(f"the server's modality config {does} {name} {', '.join(sorted(map(str, odd)))}")
        if name in ("video", "state") and len(said.get("delta_indices", (0,))) > 1:
            moments = len(said["delta_indices"])
            raise refused(f"the server's modality config asks for {moments} moments of {name}; one is sent")


class GrootPolicy:
    """A GR00T policy at ``host:port`` as a context manager that is called with what is seen; ``token`` is the server's.
    It is reset once. Its actions are absolute joint positions, and its gripper is opened or closed, as its example
    does. A server that refuses the first flat question is asked with nested ones. Raises PolicyError."""

    def __init__(
        self, host: str, port: int, camera: Camera = "left", settings: ProbeSettings | None = None, token: str = ""
    ) -> None:
        self.token, self.nested = token, False
        self.uri, self.camera, self.settings = f"tcp://{host}:{port}", camera, settings or ProbeSettings()
        self._context = zmq.Context()
        self._socket: Any = None
        self._asked = False

    def __enter__(self) -> Self:
        end = time.monotonic() + self.settings.connect_s
        while True:
            try:
                self._call("ping", None, min(PING_S, self.settings.connect_s), TrialEnding.UNREACHABLE)
                break
            except PolicyError as error:
                if error.ending is not TrialEnding.UNREACHABLE or time.monotonic() >= end:
                    self.__exit__(None, None, None)
                    raise
        try:
            check_modalities(self._call("get_modality_config", None, self.settings.answer_s, TrialEnding.TIMED_OUT))
            self._call("reset", {"options": None}, self.settings.answer_s, TrialEnding.TIMED_OUT)
        except PolicyError:
            self.__exit__(None, None, None)
            raise
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._close()
        self._context.term()

    def __call__(self, seen: Observation) -> Chunk:
        """The policy's answer. Raises PolicyError."""
        limit = self.settings.answer_s if self._asked else self.settings.first_answer_s
        flat = observation(seen, self.camera)
        data = {"observation": nested(flat) if self.nested else flat, "options": None}
        try:
            said = self._call("get_action", data, limit, TrialEnding.TIMED_OUT)
        except PolicyError as error:
            if self._asked or self.nested or error.ending is not TrialEnding.REFUSED:
                raise
            self.nested = True
            try:
                return self(seen)
            except PolicyError:
                self.nested = False
                raise error from None
        self._asked = True
        action = said[0] if isinstance(said, list) and said else said
        try:
            names = (name.removeprefix("action.") if self.nested else name for name in MODALITIES["action"])
            parts = [np.asarray(action[name])[0] for name in names]
            found = np.concatenate(parts, axis=1)
        except (KeyError, TypeError, ValueError, IndexError) as error:
            raise refused(
                f"{self.uri}: no {ACTION_POSITIONS} (1, n, {JOINTS}) and {ACTION_GRIPPER} (1, n, 1): {error!r}"
            ) from error
        actions = checked_chunk(found, "joint_position", self.settings.most_actions).actions
        actions[:, -1] = actions[:, -1] > CLOSED
        return Chunk(actions, "joint_position")

    def _call(self, endpoint: str, data: object, limit_s: float, late: TrialEnding) -> Any:
        """The answer of an endpoint. A socket that was not answered takes no other question: it is made anew."""
        if self._socket is None:
            self._socket = self._context.socket(zmq.REQ)
            self._socket.setsockopt(zmq.LINGER, 0)
            self._socket.setsockopt(zmq.MAXMSGSIZE, self.settings.most_bytes)
            self._socket.connect(self.uri)
        self._socket.setsockopt(zmq.RCVTIMEO, round(1000 * limit_s))
        self._socket.setsockopt(zmq.SNDTIMEO, round(1000 * limit_s))
        question: dict[str, object] = {"endpoint": endpoint} | ({} if data is None else {"data": data})
        question |= {"api_token": self.token} if self.token else {}
        try:
            self._socket.send(msgpack.packb(question, default=_packed))
            said = self._socket.recv()
        except zmq.Again as error:
            self._close()
            raise PolicyError(late, f"{self.uri} did not answer '{endpoint}' within {limit_s:g} s") from error
        try:
            answer = msgpack.unpackb(said, object_hook=_unpacked)
        except (ValueError, TypeError, KeyError, EOFError, msgpack.exceptions.UnpackException) as error:
            raise refused(f"{self.uri}: a frame of {len(said)} bytes is no msgpack of GR00T's: {error}") from error
        if isinstance(answer, dict) and "error" in answer:
            raise refused(f"{self.uri} answered an error: {answer['error']}")
        return answer

    def _close(self) -> None:
        if self._socket is not None:
            self._socket.close()
        self._socket = None


def _packed(value: object) -> object:
    if not isinstance(value, np.ndarray):
        return value
    file = io.BytesIO()
    np.save(file, value, allow_pickle=False)
    return {"__ndarray_class__": True, "as_npy": file.getvalue()}


def _unpacked(value: dict[Any, Any]) -> object:
    return np.load(io.BytesIO(value["as_npy"]), allow_pickle=False) if "__ndarray_class__" in value else value
