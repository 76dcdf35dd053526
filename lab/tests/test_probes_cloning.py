"""A policy cloned from the expert's recordings: what it sees, what it learns, and what it refuses."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="MuJoCo is not installed here")
from lab.probes import cloning
from lab.probes.cloning import (
    HEIGHT,
    NETWORK,
    WIDTH,
    Cloned,
    Demonstrations,
    Demonstrator,
    inputs_of,
    load_demonstrations,
    small,
    train,
)
from lab.probes.observation import OPEN_LOOP, Chunk, Observation
from lab.probes.tasks import PAPER11
from schemas.errors import UsageError

PROMPTS = [task.instruction for task in PAPER11.values()]


def seen(left: np.ndarray, prompt: str = PROMPTS[0]) -> Observation:
    return Observation(left, left, left, np.arange(7.0), 0.5, prompt)


def test_a_picture_is_the_same_to_it_with_and_without_the_borders_of_openpis_clients() -> None:
    wide = np.random.default_rng(0).integers(0, 255, (126, 224, 3), dtype=np.uint8)
    square = np.zeros((224, 224, 3), dtype=np.uint8)
    square[49:175] = wide
    assert small(wide).shape == (HEIGHT, WIDTH, 3) and (small(wide) == small(square)).all()


def test_it_knows_the_tasks_instructions_and_refuses_others() -> None:
    pictures, joints, task = inputs_of(seen(np.zeros((180, 320, 3), dtype=np.uint8), PROMPTS[4]))
    assert pictures.shape == (2, HEIGHT, WIDTH, 3) and joints.tolist() == [*range(7), 0.5] and task == 4
    with pytest.raises(UsageError, match="not taught 'dance'; it knows: Press down on the stapler"):
        inputs_of(seen(np.zeros((180, 320, 3), dtype=np.uint8), "dance"))


def test_what_the_expert_meant_is_kept_and_not_what_its_shaking_hand_did() -> None:
    meant = Chunk(np.full((OPEN_LOOP, 8), 0.5), "joint_velocity")
    demonstrator = Demonstrator(lambda _: meant, 3)
    did = demonstrator(seen(np.zeros((180, 320, 3), dtype=np.uint8)))
    assert (did.actions[:, :7] != 0.5).all() and (did.actions[:, 7] == 0.5).all()
    kept = demonstrator.demonstrations()
    assert kept.actions.shape == (1, OPEN_LOOP, 8) and (kept.actions == 0.5).all()
    still = Chunk(np.zeros((OPEN_LOOP, 8)), "joint_velocity")
    assert (Demonstrator(lambda _: still, 3)(seen(np.zeros((180, 320, 3), dtype=np.uint8))).actions == 0.0).all()


def test_nobody_learns_from_what_was_not_done(tmp_path: Path) -> None:
    np.savez(tmp_path / "failed.npz")
    with pytest.raises(UsageError, match="no demonstration was done"):
        load_demonstrations([tmp_path / "failed.npz"])


def test_without_pytorch_the_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(cloning, "import_module", lambda name: (_ for _ in ()).throw(ImportError(name)))
    with pytest.raises(UsageError, match=r"\./lab\[learn\]"):
        Cloned(tmp_path / NETWORK)


@pytest.mark.system
def test_it_learns_what_depends_on_a_picture_on_the_joints_and_on_the_instruction(tmp_path: Path) -> None:
    pytest.importorskip("torch", reason="PyTorch is not installed here")
    random, count = np.random.default_rng(0), 512
    left, bend, task = (random.integers(0, 2, count) for _ in range(3))
    pictures = np.zeros((count, 2, HEIGHT, WIDTH, 3), dtype=np.uint8)
    pictures[left == 1, 0, 10:14, 20:24] = 255
    joints, actions = np.zeros((count, 8)), np.zeros((count, OPEN_LOOP, 8))
    joints[:, 3] = bend
    actions[:, :, 0], actions[:, :, 1], actions[:, :, 7] = left[:, None], bend[:, None], task[:, None]
    file = tmp_path / NETWORK
    assert train(Demonstrations(pictures, joints, task, actions), file, epochs=12) < 0.02
    policy = Cloned(file)
    for spot, bent, told in ((1, 0, 0), (0, 1, 1), (1, 1, 1)):
        picture = np.zeros((HEIGHT, WIDTH, 3), dtype=np.uint8)
        picture[10:14, 20:24] = 255 * spot
        dark = np.zeros_like(picture)
        asked = Observation(picture, dark, dark, np.eye(7)[3] * bent, 0.0, PROMPTS[told])
        chunk = policy(asked)
        assert chunk.actions.shape == (OPEN_LOOP, 8) and chunk.kind == "joint_velocity"
        assert chunk.actions[:, [0, 1, 7]].mean(axis=0) == pytest.approx([spot, bent, told], abs=0.2)


@pytest.mark.system
def test_a_file_that_is_no_clone_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("torch", reason="PyTorch is not installed here")
    with pytest.raises(UsageError, match="is not there: clone the expert first"):
        Cloned(tmp_path / NETWORK)
    (tmp_path / NETWORK).write_bytes(b"no network")
    with pytest.raises(UsageError, match=f"{NETWORK} is no cloned policy"):
        Cloned(tmp_path / NETWORK)
