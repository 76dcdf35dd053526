"""openpi's wire: frames of msgpack with numpy arrays, and what its DROID policies are sent and answer in them.

Checked against the package openpi-client 0.1.2 (framing, byte for byte) and openpi's public example for DROID and its
``droid_policy.py`` (keys, shapes, ranges). The right camera does not go along: those policies see one outside camera.
"""

import math
from collections.abc import Mapping
from typing import Any, Literal

import msgpack
import numpy as np
from PIL import Image

from lab.probes.observation import CONTROL_HZ, JOINTS, ActionKind, Chunk, Observation, Picture, checked_chunk, refused

EXTERIOR, WRIST = "observation/exterior_image_1_left", "observation/wrist_image_left"
POSITIONS, GRIPPER, PROMPT = "observation/joint_position", "observation/gripper_position", "prompt"
ACTIONS = "actions"
SIDE_PX = 224
"""Height and width of a picture as it is sent."""
SPEED_RAD_S = 0.2 * CONTROL_HZ
"""What 1 means in a joint velocity of DROID: 0.2 rad in a step of 1/15 s (``max_joint_delta`` of its controller)."""
CLOSED = 0.5
"""The example closes the gripper where a policy says more than this, and opens it else."""
SPACE, CONTINUOUS = "action_space", "continuous_gripper"
"""Keys of a server's metadata that are obeyed: joint_velocity or joint_position, and whether the gripper may be half
open. openpi's own servers say neither; RoboArena's say the first."""
Camera = Literal["left", "right"]
SESSION, RESOLUTION = "needs_session_id", "image_resolution"
"""Keys of RoboArena's metadata that are heeded: an identifier goes along, and pictures have that height and width."""


def pack(message: Mapping[str, object]) -> bytes:
    """A frame. Raises ValueError for an array of objects, records or complex numbers."""
    found: bytes = msgpack.packb(message, default=_packed)
    return found


def unpack(frame: bytes) -> dict[str, Any]:
    """Content of a frame. Raises PolicyError for one that is no msgpack, no mapping, or holds an array that is none."""
    try:
        found = msgpack.unpackb(frame, object_hook=_unpacked)
    # msgpack's own errors are ValueErrors, but for a few.
    except (ValueError, TypeError, KeyError, msgpack.exceptions.UnpackException, RecursionError) as error:
        raise refused(f"a frame of {len(frame)} bytes is no msgpack of openpi's: {error}") from error
    if not isinstance(found, dict):
        raise refused(f"a frame holds {type(found).__name__} where a mapping is valid")
    return found


def _packed(value: object) -> object:
    if isinstance(value, np.ndarray | np.generic) and value.dtype.kind in "VOc":
        raise ValueError(f"arrays of {value.dtype} cannot be sent")
    if isinstance(value, np.ndarray):
        return {b"__ndarray__": True, b"data": value.tobytes(), b"dtype": value.dtype.str, b"shape": value.shape}
    if isinstance(value, np.generic):
        return {b"__npgeneric__": True, b"data": value.item(), b"dtype": value.dtype.str}
    return value


def _unpacked(value: dict[Any, Any]) -> object:
    if b"__ndarray__" not in value and b"__npgeneric__" not in value:
        return value
    dtype = np.dtype(value[b"dtype"])
    if dtype.kind not in "biuf":
        raise ValueError(f"an array of {dtype}")
    if b"__npgeneric__" in value:
        return dtype.type(value[b"data"])
    shape, data = tuple(int(size) for size in value[b"shape"]), value[b"data"]
    if min(shape, default=0) < 0 or math.prod(shape) * dtype.itemsize != len(data):
        raise ValueError(f"{len(data)} bytes for an array of shape {shape} of {dtype}")
    return np.frombuffer(data, dtype).reshape(shape)


def check_metadata(metadata: Mapping[str, Any]) -> None:
    """Raise PolicyError, which names the key, where a server's metadata asks for what it is not sent or answers what no
    servo here takes."""
    asked = {
        SPACE: (metadata.get(SPACE) in (None, "joint_velocity", "joint_position"), "joint_velocity or joint_position"),
        "needs_stereo_camera": (not metadata.get("needs_stereo_camera"), "one picture of each camera"),
        "n_external_cameras": (metadata.get("n_external_cameras") in (None, 0, 1), "one outside camera"),
    }
    for key, (fits, valid) in asked.items():
        if not fits:
            raise refused(f"the server's metadata says {key}: {metadata[key]!r}; there is {valid} here")
    size = metadata.get(RESOLUTION)
    sized = isinstance(size, list) and len(size) == 2 and all(isinstance(side, int) and side > 0 for side in size)
    if size is not None and not sized:
        raise refused(f"the server's metadata says {RESOLUTION}: {size!r}; a height and a width in pixels are valid")


def observation(
    seen: Observation, camera: Camera = "left", size: tuple[int, int] = (SIDE_PX, SIDE_PX)
) -> dict[str, object]:
    """Message to a DROID policy of openpi: uint8 pictures of that ``size``, float64 positions (7,) in rad and gripper
    (1,), 0 open … 1 closed, and the instruction. ``camera`` is the outside one that it sees."""
    outside = seen.exterior_left if camera == "left" else seen.exterior_right
    return {
        EXTERIOR: resized(outside, *size),
        WRIST: resized(seen.wrist, *size),
        POSITIONS: np.asarray(seen.joints, dtype=np.float64),
        GRIPPER: np.array([seen.gripper], dtype=np.float64),
        PROMPT: seen.prompt,
    }


def seen_of(said: Mapping[str, Any]) -> Observation:
    """Observation that a policy of ours has of an observation; the right camera is black. Raises PolicyError, which
    names the key,
    for one that openpi's DROID policies would not take."""
    for key, kind, shape in (
        (EXTERIOR, "u1", (None, None, 3)), (WRIST, "u1", (None, None, 3)), (POSITIONS, "f", (JOINTS,)),
        (GRIPPER, "f", (1,)),
    ):  # fmt: skip
        value = said.get(key)
        if not _fits(value, kind, shape):
            there = f"{value.dtype} of shape {value.shape}" if isinstance(value, np.ndarray) else type(value).__name__
            raise refused(f"{key}: {there}; numbers of kind {kind} and shape {shape} are valid")
    if not isinstance(said.get(PROMPT), str):
        raise refused(f"{PROMPT}: text is valid, not {type(said.get(PROMPT)).__name__}")
    left = said[EXTERIOR]
    return Observation(left, np.zeros_like(left), said[WRIST], said[POSITIONS], float(said[GRIPPER][0]), said[PROMPT])


def _fits(value: object, kind: str, shape: tuple[int | None, ...]) -> bool:
    if not isinstance(value, np.ndarray) or value.ndim != len(shape) or not value.dtype.str[1:].startswith(kind):
        return False
    return all(size in (None, found) for size, found in zip(shape, value.shape, strict=True))


def chunk_of(answer: Mapping[str, Any], kind: ActionKind, most: int, continuous: bool) -> Chunk:
    """The actions of an answer. Velocities are clipped to DROID's ±1 and become rad/s; the gripper is opened or closed,
    unless ``continuous``. Raises PolicyError."""
    if ACTIONS not in answer:
        raise refused(f"the answer has no '{ACTIONS}'; it has {', '.join(sorted(map(str, answer))) or 'nothing'}")
    found = checked_chunk(answer[ACTIONS], kind, most).actions
    if kind == "joint_velocity":
        found[:, :JOINTS] = np.clip(found[:, :JOINTS], -1.0, 1.0) * SPEED_RAD_S
    if not continuous:
        found[:, -1] = found[:, -1] > CLOSED
    return Chunk(found, kind)


def answer_of(chunk: Chunk) -> dict[str, object]:
    """An answer with these actions, as ``chunk_of`` reads it."""
    actions = np.array(chunk.actions, dtype=np.float64)
    if chunk.kind == "joint_velocity":
        actions[:, :JOINTS] /= SPEED_RAD_S
    return {ACTIONS: actions}


def resized(picture: Picture, height: int, width: int) -> Picture:
    """The picture, (height, width, 3), as large as fits without distortion, with black borders: pixel for pixel as
    ``resize_with_pad`` of openpi's client makes it."""
    if picture.shape[:2] == (height, width):
        return picture
    ratio = max(picture.shape[1] / width, picture.shape[0] / height)
    size = int(picture.shape[1] / ratio), int(picture.shape[0] / ratio)
    small = np.asarray(Image.fromarray(picture).resize(size, resample=Image.Resampling.BILINEAR))
    whole = np.zeros((height, width, 3), dtype=np.uint8)
    top, left = int((height - size[1]) / 2), int((width - size[0]) / 2)
    whole[top : top + size[1], left : left + size[0]] = small
    return whole
