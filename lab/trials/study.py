"""Trials of many refined objects, as a study: the table of trials."""

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from asset2sim.assets.authored import read_overlay
from asset2sim.catalog.read import latest_rows
from asset2sim.experiments.isolation.supervise import Work
from asset2sim.gym.arm.tasks import Task, tasks_of
from lab.runner import Done, RunWork, Study, done_row
from lab.schemas.settings import TrialSettings
from lab.schemas.tables import TRIALS
from lab.trials.trial import run_trial
from schemas.errors import UnknownChoiceError, UsageError
from schemas.table import Row

MOTIONS = "motions"
"""Folder of an output in which recordings and films are: ``motions/ASSET/TASK/``."""
LIMIT_S, MEMORY_MB = 300.0, 4096
"""Wall time and memory that one trial may take."""


@dataclass(frozen=True)
class TrialJob:
    """One trial to do: a task with an asset of an output."""

    out: Path
    folder: Path
    task: Task
    method: str
    model: str
    run_id: str | None
    filmed: bool
    gripper: str = "panda"

    @property
    def to(self) -> Path:
        """Where its recording goes."""
        return motion_folder(self.out, self.folder.name, self.task.name)

    @property
    def known(self) -> Row:
        """Columns of its row that are known before it is done."""
        return {
            "task": self.task.name, "asset_id": self.folder.name, "verb": self.task.verb.value, "method": self.method,
            "model": self.model, "run_id": self.run_id, "gripper": self.gripper,
        }  # fmt: skip


def motion_folder(out: Path, asset_id: str, task: str) -> Path:
    """The folder of a trial's recording and film."""
    return out / MOTIONS / asset_id / task.replace(" ", "-")


def jobs_of(out: Path, asset_ids: Collection[str], filmed: bool, gripper: str = "panda") -> list[TrialJob]:
    """The trials of an output's refined objects, all or these. Raises UsageError where there is no catalog or no
    refined object, UnknownChoiceError for an asset that is none of it."""
    (assets,) = latest_rows(out, "assets")
    known = {str(row["asset_id"]): row for row in assets.to_dict("records")}
    for asset_id in asset_ids:
        if asset_id not in known:
            raise UnknownChoiceError("asset", asset_id, sorted(known))
    found: list[TrialJob] = []
    for asset_id, row in known.items():
        folder = out / "assets" / asset_id
        if (asset_ids and asset_id not in asset_ids) or not (folder / "overlay.json").is_file():
            continue
        overlay = read_overlay(folder)
        who = str(row["method"]), str(row["model"]), str(row["run_id"])
        found.extend(TrialJob(out, folder, task, *who, filmed, gripper) for task in tasks_of(overlay))
    if not found:
        raise UsageError(f"{out} holds no refined object to do anything with")
    return found


def do_trial(job: TrialJob, run: RunWork) -> Done:
    """One trial, done in a child."""
    settings = TrialSettings.model_validate({"gripper": job.gripper})
    what = job.folder, job.task, job.to, job.filmed, settings
    return Done(done_row(run(Work(run_trial, what, LIMIT_S, MEMORY_MB))))


STUDY: Study[TrialJob] = Study(
    "record-motion", (TRIALS,), do_trial, lambda row: f"{row['method']} {row['task']} ({row['asset_id']})"
)
