"""GR00T's protocol over ZeroMQ, against a server that is written after its public one."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("zmq", reason="pyzmq is not installed here")
from lab.probes.groot_client import GrootPolicy, check_modalities
from lab.probes.observation import PolicyError, TrialEnding
from lab.probes.openpi_wire import resized
from lab.probes.policies import KEY, PolicySpec, opened
from lab.schemas.settings import ProbeSettings
from lab.tests import policy_servers as does
from lab.tests.test_probes_openpi import follow, program, seen

pytestmark = pytest.mark.system
QUICK = ProbeSettings(connect_s=10.0, first_answer_s=20.0, answer_s=0.5)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("groot") / "seen.npz"


@pytest.fixture(scope="module")
def port(path: Path) -> Iterator[int]:
    with program("groot", str(path)) as found:
        yield found


def test_it_is_sent_what_its_droid_policy_expects(port: int, path: Path) -> None:
    with opened(PolicySpec("GR00T-N1.6-DROID", "gr00t", "127.0.0.1", port), lambda: follow, QUICK) as policy:
        chunk = policy(seen())
    assert chunk.kind == "joint_position" and chunk.actions.shape == (16, 8)
    assert chunk.actions[0].tolist() == [0.5] * 7 + [1.0]
    with np.load(path) as found:
        assert {key: (str(found[key].dtype), found[key].shape) for key in found.files} == {
            "video.exterior_image_1_left": ("uint8", (1, 1, 180, 320, 3)),
            "video.wrist_image_left": ("uint8", (1, 1, 180, 320, 3)),
            "state.joint_position": ("float32", (1, 1, 7)),
            "state.gripper_position": ("float32", (1, 1, 1)),
            "annotation.language.language_instruction": ("<U13", (1,)),
        }
        assert np.array_equal(found["video.wrist_image_left"][0, 0], resized(seen().wrist, 180, 320))


def test_wrong_and_late_answers_are_said_and_the_next_question_is_answered(port: int) -> None:
    wrong = {
        does.SHAPE: (TrialEnding.REFUSED, r"shape \(16, 7\)"), does.TEXT: (TrialEnding.REFUSED, "the wrong embodiment"),
        does.GARBAGE: (TrialEnding.REFUSED, "no msgpack"), does.SLOW: (TrialEnding.TIMED_OUT, "within 0.5 s"),
    }  # fmt: skip
    with GrootPolicy("127.0.0.1", port, settings=QUICK) as policy:
        policy(seen())
        for prompt, (ending, why) in wrong.items():
            with pytest.raises(PolicyError, match=why) as error:
                policy(seen(prompt))
            assert error.value.ending is ending
    with GrootPolicy("127.0.0.1", port, settings=QUICK) as policy:
        assert len(policy(seen()).actions) == 16


def test_nobody_there_is_said() -> None:
    settings = QUICK.model_copy(update={"connect_s": 0.5})
    with pytest.raises(PolicyError) as error, GrootPolicy("127.0.0.1", 1, settings=settings):
        pass
    assert error.value.ending is TrialEnding.UNREACHABLE


def test_a_token_and_nested_questions_are_given_where_a_server_wants_them(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with program("groot", str(path), "secret", "nested") as port:
        spec = PolicySpec("GR00T-N1.6-DROID", "gr00t", "127.0.0.1", port)
        with pytest.raises(PolicyError, match="Unauthorized"), opened(spec, lambda: follow, QUICK):
            pass
        monkeypatch.setenv(KEY, "secret")
        with opened(spec, lambda: follow, QUICK) as policy:
            assert policy(seen()).actions[0].tolist() == policy(seen()).actions[0].tolist() == [0.25] * 7 + [0.0]


def test_a_modality_config_that_asks_for_more_is_refused_by_name(path: Path) -> None:
    with program("groot", str(path), "", "history") as port:
        with pytest.raises(PolicyError, match="asks for 2 moments of video; one is sent") as error:
            GrootPolicy("127.0.0.1", port, settings=QUICK).__enter__()
        assert error.value.ending is TrialEnding.REFUSED
    for config, said in (
        ({"video": {"modality_keys": ["ego_view"]}}, "asks for what is not sent: video ego_view"),
        ({"action": {"modality_keys": ["eef_pose", "gripper_position"]}}, "does not answer action joint_position"),
    ):
        with pytest.raises(PolicyError, match=said):
            check_modalities(config)
    check_modalities({})
