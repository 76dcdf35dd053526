"""Lesson of one training, how long it may take, and how far it is: a file that is replaced in one step."""

import hashlib
import os
import shutil
from dataclasses import dataclass
from pathlib import Path

from pydantic import Field

from asset2sim.gym.arm.tasks import Task
from lab.schemas.settings import PpoSettings
from schemas.base import Frozen
from schemas.learning_settings import LearningSettings

PROGRESS = "progress.json"


class Point(Frozen):
    """A checkpoint: after so many actions and seconds of training, the mean S, the share of successes and the mean sum
    of rewards of its rollouts; ``fps`` actions a second since the one before, and the policy's numbers then."""

    steps: int
    seconds: float
    s: float
    success: float
    reward: float
    fps: float
    numbers: dict[str, float] = Field(default_factory=dict)


class TrainingProgress(Frozen):
    """How far a training is. ``key`` says of what; ``ended`` why it ended, empty while it may go on; ``device`` where
    its last checkpoint was reached."""

    key: str
    points: tuple[Point, ...] = ()
    ended: str = ""
    device: str = ""

    @property
    def steps(self) -> int:
        """Actions done."""
        return self.points[-1].steps if self.points else 0

    @property
    def seconds(self) -> float:
        """Wall time of training, s, checkpoints' rollouts included."""
        return self.points[-1].seconds if self.points else 0.0

    @property
    def best(self) -> Point | None:
        """The checkpoint with the most successes that no guard refuses, then the highest S, the first of several."""
        return max(self.points, key=lambda point: (point.success, point.s), default=None)

    def held(self, count: int) -> bool:
        """Whether every rollout of the last ``count`` checkpoints was a success."""
        last = self.points[-count:]
        return len(last) == count and all(point.success == 1.0 for point in last)


def read_progress(to: Path, key: str) -> TrainingProgress:
    """How far a training is; at the beginning where its file is missing, or of something else: then all that is kept of
    that is removed."""
    file = to / PROGRESS
    if not file.is_file():
        return TrainingProgress(key=key)
    try:
        found = TrainingProgress.model_validate_json(file.read_text(encoding="utf-8"))
    except ValueError:
        found = TrainingProgress(key="")
    if found.key == key:
        return found
    shutil.rmtree(to, ignore_errors=True)
    return TrainingProgress(key=key)


def write_progress(to: Path, progress: TrainingProgress) -> None:
    """Replace the file, and remove checkpoints that are neither the best nor the last."""
    part = to / f".{PROGRESS}.part"
    part.write_text(progress.model_dump_json(indent=1), encoding="utf-8")
    os.replace(part, to / PROGRESS)
    kept = {checkpoint(to, point).name for point in (progress.best, progress.points[-1]) if point is not None}
    for folder in to.glob("step-*"):
        if folder.name not in kept:
            shutil.rmtree(folder)


def checkpoint(to: Path, point: Point) -> Path:
    """The folder of a checkpoint's policy."""
    return to / f"step-{point.steps:09d}"


DECIDING = ("overlay.json", "mobility.urdf")
"""Files of an asset that decide what is learnt: meshes come with the URDF."""


@dataclass(frozen=True)
class Lesson:
    """One task with one refined object and a seed: ``budget`` actions and ``minutes`` of wall time at most. What is
    kept of it is in ``to``."""

    folder: Path
    task: Task
    seed: int
    to: Path
    learning: LearningSettings
    ppo: PpoSettings
    budget: int
    minutes: float
    filmed: bool

    @property
    def key(self) -> str:
        """Key of the training: another asset, task, seed or setting makes another one, another budget does not."""
        found = hashlib.sha256()
        for file in (self.folder / name for name in DECIDING):
            found.update(file.read_bytes() if file.is_file() else b"")
        found.update(repr((self.task, self.seed, self.learning.model_dump_json(), self.ppo.model_dump_json())).encode())
        return found.hexdigest()

    def finished(self, progress: TrainingProgress) -> bool:
        """Whether there is nothing left to train: S has been held, or the budget or the time is used up."""
        used = progress.steps >= self.budget or progress.seconds >= 60.0 * self.minutes
        return used or progress.held(self.ppo.held)
