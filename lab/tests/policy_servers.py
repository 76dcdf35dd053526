"""Policy servers for tests, each a program that prints its port: one of ours that does what the instruction says, and,
for an interpreter that has the package ``openpi-client``, one of openpi's own packing and its client.

    python -m lab.tests.policy_servers obey SEEN.npz     # writes down the last question
    python -m lab.tests.policy_servers openpi SEEN.npz
    python -m lab.tests.policy_servers ask PORT          # openpi's client asks once and prints what it got
    python -m lab.tests.policy_servers groot SEEN.npz    # GR00T's protocol over ZeroMQ, as its PolicyServer speaks it
"""

import asyncio
import io
import json
import os
import ssl
import sys
import time
from typing import Any

import numpy as np

NAN, SHAPE, TEXT, HUGE, SLOW, DIE, CLOSE, NOTHING, GARBAGE, WORDS = (
    "nan", "shape", "text", "huge", "slow", "die", "close", "nothing", "garbage", "words",
)  # fmt: skip


def note(path: str, question: dict[str, Any]) -> None:
    """Write a question down, each value as it came."""
    arrays: dict[str, Any] = {key.replace("/", "|"): np.asarray(value) for key, value in question.items()}
    np.savez(f"{path}.part.npz", **arrays)
    os.replace(f"{path}.part.npz", path)


def openpi_actions(question: dict[str, Any]) -> Any:
    """Answers as openpi's DROID policies would, and raises where their input transform would: the state is the
    concatenation of positions and gripper, pictures are (height, width, 3)."""
    state = np.concatenate([question["observation/joint_position"], question["observation/gripper_position"]])
    assert state.shape == (8,)
    for key in ("observation/exterior_image_1_left", "observation/wrist_image_left"):
        picture = np.asarray(question[key])
        assert picture.shape == (224, 224, 3) and picture.dtype == np.uint8
    assert isinstance(question["prompt"], str)
    return np.tile(np.append(np.linspace(-2.0, 2.0, 7), 0.6), (15, 1)).astype(np.float32)


async def serve(handler: Any, certificate: str = "") -> None:
    """Serve on a free port, which is printed."""
    from websockets.asyncio.server import serve as listen

    tls = None
    if certificate:
        tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        tls.load_cert_chain(certificate)
    async with listen(handler, "127.0.0.1", 0, compression=None, max_size=None, ssl=tls) as server:
        print(next(iter(server.sockets)).getsockname()[1], flush=True)
        await server.serve_forever()


def obey(path: str, metadata: str = "{}", key: str = "", certificate: str = "") -> None:
    """A server of our own packing that does what the instruction says, or else answers rightly; it may say metadata
    (JSON), want an API key, and speak TLS with a PEM file."""
    from lab.probes.openpi_wire import pack, unpack

    good = np.zeros((10, 8))
    answers: dict[str, Any] = {
        NAN: pack({"actions": np.full((10, 8), np.nan)}), SHAPE: pack({"actions": np.zeros((10, 7))}),
        TEXT: "Traceback (most recent call last):\n  ...\nKeyError: 'prompt'", HUGE: bytes(40 << 20),
        NOTHING: pack({"state": good}), GARBAGE: b"\xc1\xff", WORDS: pack({"actions": "left"}),
    }  # fmt: skip
    closed: list[str] = []

    async def handler(connection: Any) -> None:
        if key and connection.request.headers.get("Authorization") != f"Api-Key {key}":
            await connection.close(1008, "no key")
            return
        await connection.send(pack(json.loads(metadata)))
        async for frame in connection:
            question = unpack(frame)
            note(path, question)
            prompt = str(question["prompt"])
            if prompt == DIE:
                os._exit(9)
            if prompt == SLOW:
                await asyncio.sleep(5.0)
            if prompt == CLOSE and not closed:
                closed.append(prompt)
                await connection.close()
                return
            await connection.send(answers.get(prompt, pack({"actions": good})))

    asyncio.run(serve(handler, certificate))


def openpi(path: str) -> None:
    """A server of openpi's own packing, as its ``websocket_policy_server.py`` is built."""
    from openpi_client import msgpack_numpy

    async def handler(connection: Any) -> None:
        packer = msgpack_numpy.Packer()
        await connection.send(packer.pack({"reset_pose": [0.0] * 7}))
        async for frame in connection:
            question = msgpack_numpy.unpackb(frame)
            began = time.monotonic()
            answer = {"actions": openpi_actions(question), "policy_timing": {"infer_ms": 1.0}}
            note(path, question)
            answer["server_timing"] = {"infer_ms": 1000.0 * (time.monotonic() - began)}
            await connection.send(packer.pack(answer))

    asyncio.run(serve(handler))


def ask(port: str) -> None:
    """openpi's own client asks the server at a port once, as the example for DROID does, and prints the answer."""
    from openpi_client import image_tools, websocket_client_policy

    client = websocket_client_policy.WebsocketClientPolicy("127.0.0.1", int(port))
    picture = np.full((720, 1280, 3), 200, dtype=np.uint8)
    question = {
        "observation/exterior_image_1_left": image_tools.resize_with_pad(picture, 224, 224),
        "observation/wrist_image_left": image_tools.resize_with_pad(picture, 224, 224),
        "observation/joint_position": np.arange(7) / 10.0, "observation/gripper_position": np.array([0.25]),
        "prompt": "close the lid",
    }  # fmt: skip
    actions = client.infer(question)["actions"]
    print(client.get_server_metadata(), actions.shape, actions.dtype, actions[0].tolist())


def groot(path: str, token: str = "", style: str = "flat") -> None:
    """A server as Isaac-GR00T's ``PolicyServer``: REP, msgpack, arrays as .npy; wrong where the instruction says so. It
    may want a token, nested questions, or (``history``) more than one moment."""
    import msgpack
    import zmq

    def read(value: dict[Any, Any]) -> Any:
        return np.load(io.BytesIO(value["as_npy"]), allow_pickle=False) if "__ndarray_class__" in value else value

    def write(value: Any) -> Any:
        file = io.BytesIO()
        np.save(file, value, allow_pickle=False)
        return {"__ndarray_class__": True, "as_npy": file.getvalue()}

    socket = zmq.Context().socket(zmq.REP)
    print(socket.bind_to_random_port("tcp://127.0.0.1"), flush=True)
    while True:
        request = msgpack.unpackb(socket.recv(), object_hook=read)
        if token and request.get("api_token") != token:
            socket.send(msgpack.packb({"error": "Unauthorized: Invalid API token"}))
            continue
        if request["endpoint"] != "get_action":
            video = {"delta_indices": [-1, 0] if style == "history" else [0],
                     "modality_keys": ["exterior_image_1_left", "wrist_image_left"]}  # fmt: skip
            others = {
                "ping": {"status": "ok", "message": "Server is running"}, "reset": {},
                "get_modality_config": {"video": {"__ModalityConfig_class__": True, "as_json": video}},
            }  # fmt: skip
            assert request["endpoint"] != "reset" or request["data"] == {"options": None}
            socket.send(msgpack.packb(others[request["endpoint"]]))
            continue
        assert set(request["data"]) == {"observation", "options"}
        question = request["data"]["observation"]
        if (style == "nested") != ("video" in question):
            socket.send(msgpack.packb({"error": "Observation must contain a 'video' key"}))
            continue
        if style == "nested":
            (language,) = question["language"].values()
            assert [len(each) for each in language] == [1] and set(question) == {"video", "state", "language"}
            shapes = {key: value.shape for name in ("video", "state") for key, value in question[name].items()}
            assert shapes == {"exterior_image_1_left": (1, 1, 180, 320, 3), "wrist_image_left": (1, 1, 180, 320, 3),
                              "joint_position": (1, 1, 7), "gripper_position": (1, 1, 1)}  # fmt: skip
            nested = {"joint_position": np.full((1, 16, 7), 0.25, np.float32),
                      "gripper_position": np.zeros((1, 16, 1), np.float32)}  # fmt: skip
            socket.send(msgpack.packb([nested, {}], default=write))
            continue
        note(path, question)
        prompt = question["annotation.language.language_instruction"][0]
        if prompt == SLOW:
            time.sleep(2.0)
        shape = (1, 16, 6) if prompt == SHAPE else (1, 16, 7)
        actions = {"action.joint_position": np.full(shape, 0.5, np.float32),
                   "action.gripper_position": np.full((1, 16, 1), 0.6, np.float32)}  # fmt: skip
        answer: Any = {"error": "the wrong embodiment"} if prompt == TEXT else [actions, {}]
        socket.send(b"\xc1" if prompt == GARBAGE else msgpack.packb(answer, default=write))


if __name__ == "__main__":
    programs: dict[str, Any] = {"groot": groot, "obey": obey, "openpi": openpi, "ask": ask}
    programs[sys.argv[1]](*sys.argv[2:])
