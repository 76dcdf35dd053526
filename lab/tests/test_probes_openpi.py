"""openpi's protocol: bytes recorded of its package, what its DROID policies are sent, and what servers may do wrong."""

import hashlib
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from lab.probes.observation import Chunk, Observation, Policy, PolicyError, TrialEnding
from lab.probes.openpi_client import OpenPiPolicy
from lab.probes.openpi_wire import SPEED_RAD_S, answer_of, check_metadata, chunk_of, pack, resized, unpack
from lab.probes.policies import KEY, opened, policy_spec
from lab.probes.serving import served
from lab.schemas.settings import ProbeSettings
from lab.tests import policy_servers as does
from tests.assets import ROOT

QUICK = ProbeSettings(connect_s=10.0, reconnect_s=0.5, first_answer_s=20.0, answer_s=0.5)
QUESTION = (
    "84ba6f62736572766174696f6e2f6a6f696e745f706f736974696f6e84c40b5f5f6e6461727261795f5fc3c40464617461c41000000000"
    "0000e03f000000000000f0bfc4056474797065a33c6638c40573686170659102d9216f62736572766174696f6e2f6578746572696f725f"
    "696d6167655f315f6c65667484c40b5f5f6e6461727261795f5fc3c40464617461c406000102030405c4056474797065a37c7531c40573"
    "6861706593010203a670726f6d7074a2c3a9a16e83c40d5f5f6e7067656e657269635f5fc3c40464617461cb3fd0000000000000c40564"
    "74797065a33c6634"
)
ANSWER = (
    "82a7616374696f6e7384c40b5f5f6e6461727261795f5fc3c40464617461c4080000c03f00000000c4056474797065a33c6634c4057368"
    "617065920102ad7365727665725f74696d696e6781a8696e6665725f6d73cb4004000000000000"
)
"""Frames that openpi-client 0.1.2 packed (msgpack 1.2.4, numpy 1.26.4)."""
PICTURES = {(720, 1280): "16a7593e94ae1abb", (180, 320): "add2ace56da06881", (300, 200): "4eb238c9de056fd8",
            (224, 224): "a88b3a8ab51f1779", (225, 301): "2264819cf019de56"}  # fmt: skip
"""Size of a random picture → digest of what that package's ``resize_with_pad`` made of it."""


def seen(prompt: str = "close the lid") -> Observation:
    rows = np.arange(720 * 1280 * 3, dtype=np.int64).reshape(720, 1280, 3)
    left, right, wrist = ((rows // 1000 + shift).astype(np.uint8) for shift in (0, 1, 2))
    return Observation(left, right, wrist, np.linspace(-1.0, 1.0, 7), 0.25, prompt)


@contextmanager
def program(*words: str, python: str = sys.executable) -> Iterator[int]:
    """A server program of this package's; its port."""
    with subprocess.Popen(
        [python, "-m", "lab.tests.policy_servers", *words], cwd=ROOT, stdout=subprocess.PIPE, text=True
    ) as process:
        try:
            assert process.stdout is not None
            yield int(process.stdout.readline())
        finally:
            process.kill()


@pytest.fixture(scope="module")
def port(tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    with program("obey", str(tmp_path_factory.mktemp("obey") / "seen.npz")) as found:
        yield found


def real_python() -> str:
    """An interpreter that has openpi-client: it needs another numpy than ours."""
    python = os.environ.get("OPENPI_PYTHON", "")
    if not python:
        pytest.skip("OPENPI_PYTHON names no interpreter that has the package openpi-client")
    return python


def test_frames_are_byte_for_byte_those_of_openpis_package() -> None:
    picture = np.arange(6, dtype=np.uint8).reshape(1, 2, 3)
    question = {"observation/joint_position": np.array([0.5, -1.0]), "observation/exterior_image_1_left": picture,
                "prompt": "é", "n": np.float32(0.25)}  # fmt: skip
    actions = np.array([[1.5, 0.0]], dtype=np.float32)
    assert pack(question).hex() == QUESTION
    assert pack({"actions": actions, "server_timing": {"infer_ms": 2.5}}).hex() == ANSWER
    read = unpack(bytes.fromhex(ANSWER))
    assert np.array_equal(read["actions"], actions) and read["actions"].dtype == np.float32
    assert unpack(bytes.fromhex(QUESTION))["n"] == np.float32(0.25)


def test_pictures_are_resized_pixel_for_pixel_as_openpis_package_does() -> None:
    draw = np.random.default_rng(0)
    draw.integers(0, 256, (9, 16, 3), dtype=np.uint8)
    for (height, width), digest in PICTURES.items():
        picture = draw.integers(0, 256, (height, width, 3), dtype=np.uint8)
        assert hashlib.sha256(resized(picture, 224, 224).tobytes()).hexdigest()[:16] == digest


@pytest.mark.parametrize(
    "frame",
    [b"", b"\xc1", b"\x93\x01\x02\x03", pack({"a": np.zeros(3)})[:-3],
     pack({"a": {b"__ndarray__": True, b"data": b"1", b"dtype": "<f8", b"shape": [2]}}),
     pack({"a": {b"__ndarray__": True, b"data": b"1", b"dtype": "|O", b"shape": [1]}}),
     pack({"a": {b"__ndarray__": True}}), b"\x81" * 5000],
)  # fmt: skip
def test_what_is_no_frame_is_refused(frame: bytes) -> None:
    with pytest.raises(PolicyError) as error:
        unpack(frame)
    assert error.value.ending is TrialEnding.REFUSED


def test_velocities_are_droids_and_the_gripper_is_open_or_closed() -> None:
    said = {"actions": np.array([[2.0, -0.5, 0, 0, 0, 0, 0, 0.51], [0, 0, 0, 0, 0, 0, 0, 0.5]])}
    chunk = chunk_of(said, "joint_velocity", 10, continuous=False)
    assert chunk.actions[0].tolist() == [3.0, -1.5, 0, 0, 0, 0, 0, 1.0] and chunk.actions[1, -1] == 0.0
    places = chunk_of(said, "joint_position", 10, continuous=True).actions
    assert places[0].tolist() == [2.0, -0.5, 0, 0, 0, 0, 0, 0.51]
    moving = Chunk(np.full((3, 8), 0.9), "joint_velocity")
    assert np.allclose(chunk_of(answer_of(moving), moving.kind, 10, True).actions, 0.9) and SPEED_RAD_S == 3.0


@pytest.mark.system
def test_a_policy_in_another_process_is_sent_what_openpis_droid_policies_expect(tmp_path: Path) -> None:
    path = tmp_path / "seen.npz"
    with program("obey", str(path)) as port, OpenPiPolicy("127.0.0.1", port, camera="right") as policy:
        chunk = policy(seen())
        with np.load(path) as found:
            sent = {key.replace("|", "/"): found[key] for key in found.files}
    assert chunk.kind == "joint_velocity" and chunk.actions.shape == (10, 8)
    assert {key: (str(value.dtype), value.shape) for key, value in sent.items()} == {
        "observation/exterior_image_1_left": ("uint8", (224, 224, 3)),
        "observation/wrist_image_left": ("uint8", (224, 224, 3)),
        "observation/joint_position": ("float64", (7,)),
        "observation/gripper_position": ("float64", (1,)),
        "prompt": ("<U13", ()),
    }
    assert does.openpi_actions({key: value if value.shape else value.item() for key, value in sent.items()}).any()
    assert np.array_equal(sent["observation/exterior_image_1_left"], resized(seen().exterior_right, 224, 224))
    assert not sent["observation/wrist_image_left"][:49].any(), "16:9 has borders"
    assert sent["observation/joint_position"][-1] == 1.0 and sent["observation/gripper_position"][0] == 0.25


@pytest.mark.system
@pytest.mark.parametrize(
    ("prompt", "ending", "why"),
    [(does.NAN, TrialEnding.REFUSED, "80 of the 80 numbers"), (does.SHAPE, TrialEnding.REFUSED, r"shape \(10, 7\)"),
     (does.TEXT, TrialEnding.REFUSED, "KeyError: 'prompt'"),
     (does.HUGE, TrialEnding.REFUSED, "more than 16777216 bytes"),
     (does.NOTHING, TrialEnding.REFUSED, "no 'actions'; it has state"),
     (does.GARBAGE, TrialEnding.REFUSED, "no msgpack"),
     (does.WORDS, TrialEnding.REFUSED, "no array of numbers but str"),
     (does.SLOW, TrialEnding.TIMED_OUT, "within 0.5 s")],
)  # fmt: skip
def test_wrong_answers_are_said(port: int, prompt: str, ending: TrialEnding, why: str) -> None:
    with OpenPiPolicy("127.0.0.1", port, settings=QUICK) as policy:
        assert len(policy(seen()).actions) == 10
        with pytest.raises(PolicyError, match=why) as error:
            policy(seen(prompt))
        assert error.value.ending is ending
        assert len(policy(seen()).actions) == 10, "a late or wrong answer is not taken for the next one"


@pytest.mark.system
def test_a_broken_connection_is_made_anew_and_a_dead_policy_said(tmp_path: Path) -> None:
    with program("obey", str(tmp_path / "seen.npz")) as port, OpenPiPolicy("127.0.0.1", port, settings=QUICK) as policy:
        assert len(policy(seen(does.CLOSE)).actions) == 10
        with pytest.raises(PolicyError, match="ConnectionRefused") as error:
            policy(seen(does.DIE))
        assert error.value.ending is TrialEnding.DIED


@pytest.mark.parametrize(
    ("metadata", "said"),
    [({"needs_stereo_camera": True}, "needs_stereo_camera: True; there is one picture of each camera"),
     ({"n_external_cameras": 2}, "n_external_cameras: 2; there is one outside camera"),
     ({"action_space": "cartesian_velocity"}, "action_space: 'cartesian_velocity'; there is joint_velocity or"),
     ({"image_resolution": "large"}, "image_resolution: 'large'; a height and a width")],
)  # fmt: skip
def test_metadata_that_asks_for_what_is_not_sent_is_refused_by_name(metadata: dict[str, object], said: str) -> None:
    with pytest.raises(PolicyError, match=said) as error:
        check_metadata(metadata)
    assert error.value.ending is TrialEnding.REFUSED
    check_metadata({"n_external_cameras": 1, "needs_wrist_camera": True, "action_space": "joint_position"})


@pytest.mark.system
def test_a_server_over_tls_with_a_key_gets_the_pictures_and_the_session_that_it_asks_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pem, path = tmp_path / "server.pem", tmp_path / "seen.npz"
    words = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=localhost"]
    words += ["-addext", "subjectAltName=DNS:localhost", "-keyout", str(pem), "-out", str(tmp_path / "certificate.pem")]
    if shutil.which("openssl") is None:
        pytest.skip("openssl, which makes a certificate, is not installed here")
    subprocess.run(words, check=True, capture_output=True)
    pem.write_text(pem.read_text() + (tmp_path / "certificate.pem").read_text(), encoding="utf-8")
    metadata = '{"needs_session_id": true, "image_resolution": [180, 320], "action_space": "joint_position"}'
    with program("obey", str(path), metadata, "secret", str(pem)) as port:
        monkeypatch.setenv("SSL_CERT_FILE", str(tmp_path / "certificate.pem"))
        spec = policy_spec(f"wss://localhost:{port}", None, "joint_velocity", "left")
        quick = QUICK.model_copy(update={"connect_s": 1.0})
        with pytest.raises(PolicyError, match="no policy at wss"), opened(spec, lambda: follow, quick):
            pass
        monkeypatch.setenv(KEY, "secret")
        with opened(spec, lambda: follow, QUICK) as policy:
            assert policy(seen()).kind == "joint_position"
    with np.load(path) as found:
        assert found["observation|wrist_image_left"].shape == (180, 320, 3) and len(str(found["session_id"])) == 36
    assert policy_spec("wss://host", None, "joint_velocity", "left").port == 443


@pytest.mark.system
def test_nobody_there_is_said_after_the_time_for_connecting() -> None:
    began = time.monotonic()
    settings = QUICK.model_copy(update={"connect_s": 0.5})
    with pytest.raises(PolicyError) as error, OpenPiPolicy("127.0.0.1", 1, settings=settings):
        pass
    assert error.value.ending is TrialEnding.UNREACHABLE and 0.2 < time.monotonic() - began < 10.0


def follow(what: Observation) -> Chunk:
    """A policy that answers with what it saw."""
    if what.prompt == "break":
        raise RuntimeError("it broke")
    return Chunk(np.tile(np.append(what.joints, what.gripper), (9, 1)), "joint_position")


@pytest.mark.system
def test_our_policies_are_served_over_the_same_websocket_by_a_process_of_their_own() -> None:
    with served(lambda: follow, "joint_position") as port, OpenPiPolicy("127.0.0.1", port) as policy:
        chunk = policy(seen())
        assert chunk.kind == "joint_position", "the server says so"
        assert np.allclose(chunk.actions[0], [*np.linspace(-1.0, 1.0, 7), 0.25]) and len(chunk.actions) == 9
        with pytest.raises(PolicyError, match="RuntimeError: it broke"):
            policy(seen("break"))
    with pytest.raises(ValueError, match="no way"), served(lambda: fail("no way")):
        pass


def fail(why: str) -> Policy:
    raise ValueError(why)


@pytest.mark.system
def test_openpis_own_packing_answers_our_client(tmp_path: Path) -> None:
    path = tmp_path / "seen.npz"
    with program("openpi", str(path), python=real_python()) as port, OpenPiPolicy("127.0.0.1", port) as policy:
        chunk = policy(seen())
    assert policy.metadata == {"reset_pose": [0.0] * 7}
    assert chunk.actions.shape == (15, 8), "π0.5's; π0-FAST's are 10"
    assert np.allclose(chunk.actions[0], [-3.0, -3.0, -2.0, 0.0, 2.0, 3.0, 3.0, 1.0]), "clipped to DROID's ±1"
    with np.load(path) as found:
        assert found["observation|joint_position"].dtype == np.float64


@pytest.mark.system
def test_our_server_answers_openpis_own_client() -> None:
    python = real_python()
    with served(lambda: follow, "joint_position") as port:
        words = [python, "-m", "lab.tests.policy_servers", "ask", str(port)]
        said = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert "(9, 8) float64 [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.25]" in said
