"""Lesson of one training, and how long it may take."""

from dataclasses import dataclass
from pathlib import Path

from asset2sim.gym.arm.tasks import Task
from lab.learning.progress import TrainingProgress, key_of
from lab.schemas.ppo_settings import PpoSettings
from schemas.learning_settings import LearningSettings


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
        """Key of the training."""
        return key_of(self.folder, self.task, self.seed, self.learning, self.ppo)

    def finished(self, progress: TrainingProgress) -> bool:
        """Whether there is nothing left to train: S has been held, or the budget or the time is used up."""
        used = progress.steps >= self.budget or progress.seconds >= 60.0 * self.minutes
        return used or progress.held(self.ppo.held)
