"""A policy cloned from the expert's own recordings: a small network from two pictures and the joints to a chunk."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from asset2sim.physics.arrays import Array
from lab.probes.episode import run_episode
from lab.probes.experts import NOISE_RAD_S, NoWayError, scripted
from lab.probes.observation import ACTION_WIDTH, JOINTS, OPEN_LOOP, Chunk, Observation, Picture, Policy
from lab.probes.tasks import PAPER11, ProbeTask
from schemas.errors import UsageError

WIDTH, HEIGHT = 48, 27
"""Of a picture as the network sees it, pixels."""
FIRST_SEED = 1000
"""Seeds of demonstrations begin here: trials have smaller ones."""
STILL_RAD_S = 0.05
"""Fastest of an expert's actions, rad/s, below which it stands still."""
EPOCHS, BATCH, RATE = 150, 64, 1e-3
NETWORK, DEMONSTRATIONS = "cloned.pt", "demonstrations"
"""The network's file, and the folder of recordings beside it."""

Small = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Demonstrations:
    """Demonstrations of an expert: (n, 2, HEIGHT, WIDTH, 3) ``pictures`` from the left and at the wrist, (n, 8)
    ``joints``, rad, and the gripper, (n,) ``task``, the instruction's place among the tasks', and (n, OPEN_LOOP, 8)
    ``actions``, rad/s and the gripper."""

    pictures: Small
    joints: Array
    task: NDArray[np.int64]
    actions: Array


class Demonstrator:
    """An expert with a shaking hand, whose meant actions are kept: so a clone learns to come back to the way."""

    def __init__(self, expert: Policy, seed: int) -> None:
        self.expert, self.random = expert, np.random.default_rng([seed, 2])
        self.rows: list[tuple[Small, Array, int, Array]] = []

    def __call__(self, seen: Observation) -> Chunk:
        """The expert's actions, and noise."""
        chunk = self.expert(seen)
        self.rows.append((*inputs_of(seen), chunk.actions))
        actions = chunk.actions.copy()
        if np.abs(actions[:, :JOINTS]).max() > STILL_RAD_S:  # else an episode that is done would never come to rest
            actions[:, :JOINTS] += self.random.normal(0.0, NOISE_RAD_S, (len(actions), JOINTS))
        return Chunk(actions, chunk.kind)

    def demonstrations(self) -> Demonstrations:
        """All that it did."""
        pictures, joints, task, actions = zip(*self.rows, strict=True)
        return Demonstrations(np.array(pictures), np.array(joints), np.array(task), np.array(actions))


def inputs_of(seen: Observation) -> tuple[Small, Array, int]:
    """Inputs of the network: two small pictures, joints and gripper, and which instruction it is. Raises UsageError for
    one that it was not taught."""
    prompts = [task.instruction for task in PAPER11.values()]
    if seen.prompt not in prompts:
        raise UsageError(f"the clone was not taught '{seen.prompt}'; it knows: {', '.join(prompts)}")
    pictures = np.array([small(seen.exterior_left), small(seen.wrist)])
    return pictures, np.array([*seen.joints, seen.gripper]), prompts.index(seen.prompt)


def small(picture: Picture) -> Small:
    """(HEIGHT, WIDTH, 3) the picture, without the black borders that a square one of openpi's clients has."""
    height, width = picture.shape[:2]
    border = (height - round(width * HEIGHT / WIDTH)) // 2
    if border > 0:
        picture = picture[border : height - border]
    return np.asarray(Image.fromarray(picture).resize((WIDTH, HEIGHT), Image.Resampling.BOX))


def demonstrate(folder: Path, task: ProbeTask, seed: int, file: Path) -> bool:
    """Record an expert's episode into an NPZ file, unless it is there; whether the task was done. What was not done is
    kept empty, so that nobody learns from it."""
    if not file.is_file():
        demonstrator = None
        try:
            demonstrator = Demonstrator(scripted(folder, task, seed), seed)
            done = bool(run_episode(folder, task, seed, demonstrator, None)["success"])
        except NoWayError:
            done = False
        found = vars(demonstrator.demonstrations()) if done and demonstrator is not None else {}
        file.parent.mkdir(parents=True, exist_ok=True)
        np.savez_compressed(file, **found)
    with np.load(file) as kept:
        return bool(kept.files)


def load_demonstrations(files: Sequence[Path]) -> Demonstrations:
    """All recordings together. Raises UsageError where none has anything."""
    found = []
    for file in files:
        with np.load(file) as kept:
            if kept.files:
                found.append(Demonstrations(**{name: kept[name] for name in kept.files}))
    if not found:
        raise UsageError("no demonstration was done: there is nothing to learn from")
    names = Demonstrations.__dataclass_fields__
    return Demonstrations(**{name: np.concatenate([getattr(item, name) for item in found]) for name in names})


def torch_module() -> Any:
    """PyTorch. Raises UsageError where it is not installed."""
    try:
        torch = import_module("torch")
    except ImportError:
        raise UsageError("a cloned policy needs PyTorch: pip install './lab[learn]'") from None
    torch.set_num_threads(1)  # the network is small, and other processes use the other processors
    return torch


def network() -> Any:
    """The untrained network: an encoder a picture, and layers from their features, joints and task to the actions."""
    nn = torch_module().nn

    def encoder() -> Any:
        layers: list[Any] = []
        for inside, outside in ((3, 16), (16, 32), (32, 32)):
            layers += [nn.Conv2d(inside, outside, 3, stride=2, padding=1), nn.ReLU()]
        return nn.Sequential(*layers, nn.Flatten(), nn.Linear(32 * 4 * 6, 64), nn.ReLU())

    known = 2 * 64 + ACTION_WIDTH + len(PAPER11)
    head = nn.Sequential(
        nn.Linear(known, 256), nn.ReLU(), nn.Linear(256, 256), nn.ReLU(), nn.Linear(256, OPEN_LOOP * ACTION_WIDTH)
    )
    return nn.ModuleDict({"left": encoder(), "wrist": encoder(), "head": head})


def forward(net: Any, pictures: Any, joints: Any, task: Any) -> Any:
    """(n, OPEN_LOOP, 8) scaled actions, of tensors of pictures from 0 to 1, joints and tasks."""
    torch = torch_module()
    left, wrist = (net[name](pictures[:, index]) for index, name in enumerate(("left", "wrist")))
    known = torch.nn.functional.one_hot(task, len(PAPER11)).float()
    return net["head"](torch.cat([left, wrist, joints, known], dim=1)).reshape(-1, OPEN_LOOP, ACTION_WIDTH)


def train(data: Demonstrations, to: Path, epochs: int = EPOCHS) -> float:
    """Train a network and write it to a file; the mean error of its last epoch, of scaled actions. Raises UsageError
    where PyTorch is not installed."""
    torch = torch_module()
    torch.manual_seed(0)
    net = network()
    scales = {
        "joints_mean": data.joints.mean(axis=0), "joints_std": data.joints.std(axis=0) + 1e-3,
        "actions_std": np.array([*(data.actions[..., :JOINTS].std(axis=(0, 1)) + 1e-3), 1.0]),
    }  # fmt: skip
    pictures = torch.from_numpy(data.pictures).permute(0, 1, 4, 2, 3)
    joints = torch.tensor((data.joints - scales["joints_mean"]) / scales["joints_std"], dtype=torch.float32)
    task, actions = torch.from_numpy(data.task), torch.tensor(data.actions / scales["actions_std"], dtype=torch.float32)
    steps = max(1, len(task) // BATCH)
    optimizer = torch.optim.AdamW(net.parameters(), lr=RATE, weight_decay=1e-3)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, 3.0 * RATE, total_steps=steps * epochs)
    error = 0.0
    for _ in range(epochs):
        order, error = torch.randperm(len(task)), 0.0
        for chosen in order.tensor_split(steps):
            light = 1.0 + 0.1 * torch.randn(len(chosen), 1, 1, 1, 1)
            shown = (pictures[chosen].float() / 255.0 * light).clamp(0.0, 1.0)
            felt = joints[chosen] + 0.02 * torch.randn(len(chosen), ACTION_WIDTH)
            loss = torch.nn.functional.smooth_l1_loss(forward(net, shown, felt, task[chosen]), actions[chosen])
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            schedule.step()
            error += float(loss.detach()) / steps
    to.parent.mkdir(parents=True, exist_ok=True)
    torch.save({"network": net.state_dict(), "scales": {k: torch.from_numpy(v) for k, v in scales.items()}}, to)
    return error


class Cloned:
    """A trained network as a policy. Raises UsageError for a file that is none of ``train``'s."""

    def __init__(self, file: Path) -> None:
        self.torch = torch_module()
        if not file.is_file():
            raise UsageError(f"{file} is not there: clone the expert first, which writes {NETWORK}")
        try:
            kept = self.torch.load(file, weights_only=True)
            self.net = network()
            self.net.load_state_dict(kept["network"])
            self.scales = {name: value.numpy() for name, value in kept["scales"].items()}
        except Exception as error:  # of whatever kind: PyTorch raises what its formats' readers raise
            raise UsageError(f"{file} is no cloned policy of this version: {str(error).splitlines()[0]}") from error
        self.net.eval()

    def __call__(self, seen: Observation) -> Chunk:
        """The expert's answer as the network predicts it."""
        pictures, joints, task = inputs_of(seen)
        scaled = ((joints - self.scales["joints_mean"]) / self.scales["joints_std"]).astype(np.float32)
        shown = self.torch.from_numpy(pictures[None].transpose(0, 1, 4, 2, 3).astype(np.float32) / 255.0)
        with self.torch.inference_mode():
            found = forward(self.net, shown, self.torch.from_numpy(scaled[None]), self.torch.tensor([task]))
        actions = found[0].double().numpy() * self.scales["actions_std"]
        actions[:, -1] = np.clip(actions[:, -1], 0.0, 1.0)
        return Chunk(actions, "joint_velocity")


def clone(folders: Mapping[str, Path], to: Path, count: int, told: Callable[[str], None]) -> Path:
    """Record ``count`` demonstrations of each task with the refined objects in ``folders``, asset → folder, train, and
    write the network into the folder ``to``; its file. Recordings that are there are kept. Raises UsageError."""
    torch_module()
    files = []
    for task, seed in product(PAPER11.values(), range(FIRST_SEED, FIRST_SEED + count)):
        if task.asset_id in folders:
            files.append(to / DEMONSTRATIONS / f"{task.name.replace(' ', '-')}-{seed}.npz")
            done = demonstrate(folders[task.asset_id], task, seed, files[-1])
            told(f"{task.name}, start {seed}: {'done' if done else 'not done, left out'}")
    told(f"trained: mean error {train(load_demonstrations(files), to / NETWORK):.4f} of scaled actions")
    return to / NETWORK
