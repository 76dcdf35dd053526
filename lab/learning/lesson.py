"""Lesson of one training, and how long it may take."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

from asset2sim.gym.arm.tasks import Task
from lab.learning.progress import TrainingProgress
from lab.schemas.ppo_settings import PpoSettings
from schemas.learning_settings import LearningSettings

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
