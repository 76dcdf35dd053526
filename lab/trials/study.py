"""Trials of many refined objects: each in a killable child, spread over Dask's workers; the table of trials."""

import logging
import tempfile
import uuid
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import pandas as pd
from distributed import Client, as_completed

from asset2sim.catalog.own_files import OwnFile, read_own_files
from asset2sim.catalog.read import latest_rows
from asset2sim.experiments.cluster import open_client
from asset2sim.experiments.interrupt import sigterm_as_interrupt
from asset2sim.experiments.isolation import Ending, accept_children, run_isolated, stop_children
from asset2sim.gym.arm.tasks import Task, tasks_of
from lab.schemas.tables_trials import TRIALS
from lab.schemas.trial_settings import TrialSettings
from lab.trials.trial import run_trial
from schemas.errors import UnknownChoiceError, UsageError
from schemas.overlay import PhysicsOverlay
from schemas.settings import RunSettings
from schemas.table import Row

MOTIONS = "motions"
"""Folder of an output in which recordings and films are: ``motions/ASSET/TASK/``."""
LIMIT_S, MEMORY_MB = 300.0, 4096
"""Wall time and memory that one trial may take."""

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Job:
    """One trial to do: a task with an asset of an output."""

    out: Path
    folder: Path
    task: Task
    method: str
    model: str
    run_id: str | None
    filmed: bool
    gripper: str = "panda"
    owner: str = ""

    @property
    def to(self) -> Path:
        """Where its recording goes."""
        return motion_folder(self.out, self.folder.name, self.task.name)


def motion_folder(out: Path, asset_id: str, task: str) -> Path:
    """The folder of a trial's recording and film."""
    return out / MOTIONS / asset_id / task.replace(" ", "-")


def jobs_of(out: Path, asset_ids: Collection[str], filmed: bool, gripper: str = "panda") -> list[Job]:
    """The trials of an output's refined objects, all or these. Raises UsageError where there is no catalog or no
    refined object, UnknownChoiceError for an asset that is none of it."""
    (assets,) = latest_rows(out, "assets")
    known = {str(row["asset_id"]): row for row in assets.to_dict("records")}
    for asset_id in asset_ids:
        if asset_id not in known:
            raise UnknownChoiceError("asset", asset_id, sorted(known))
    found: list[Job] = []
    for asset_id, row in known.items():
        folder = out / "assets" / asset_id
        if (asset_ids and asset_id not in asset_ids) or not (folder / "overlay.json").is_file():
            continue
        overlay = PhysicsOverlay.model_validate_json((folder / "overlay.json").read_text(encoding="utf-8"))
        who = str(row["method"]), str(row["model"]), str(row["run_id"])
        found.extend(Job(out, folder, task, *who, filmed, gripper) for task in tasks_of(overlay))
    if not found:
        raise UsageError(f"{out} holds no refined object to do anything with")
    return found


def run_trials(jobs: Sequence[Job], run: RunSettings, told: Callable[[Row, int], None]) -> None:
    """Do every trial and store its row in its output; ``told`` hears each row and how many are left. Whatever a trial
    does is a row. An interruption ends the children and keeps the rows so far."""
    files = {job.out: OwnFile(job.out, TRIALS) for job in jobs}
    owner = f"trials-{uuid.uuid4().hex}"
    accept_children(owner)
    with tempfile.TemporaryDirectory() as place, sigterm_as_interrupt(), open_client(run, Path(place)) as client:
        try:
            for done, (job, row) in enumerate(results(client, [replace(job, owner=owner) for job in jobs]), start=1):
                files[job.out].add([row])
                told(row, len(jobs) - done)
        finally:
            stop_children(owner)


def results(client: Client, jobs: Sequence[Job]) -> Iterator[tuple[Job, Row]]:
    """Each job and its row, as they end."""
    futures = {client.submit(trial_of, job, pure=False): job for job in jobs}
    for future in as_completed(futures):
        yield futures[future], future.result()


def trial_of(job: Job) -> Row:
    """One trial in a child of its own, which may crash or hang."""
    with tempfile.TemporaryDirectory(prefix="asset2sim-trial-") as place:
        outcome = run_isolated(
            run_trial,
            (job.folder, job.task, job.to, job.filmed, TrialSettings.model_validate({"gripper": job.gripper})),
            time_limit_s=LIMIT_S,
            memory_limit_mb=MEMORY_MB,
            services={},
            log_path=Path(place, "trial.log"),
            owner=job.owner,
        )
    row: Row = {"task": job.task.name, "asset_id": job.folder.name, "verb": job.task.verb.value}
    if outcome.ending is Ending.RETURNED and isinstance(outcome.value, dict):
        row = outcome.value
    else:
        row |= {"outcome": "failed", "reason": outcome.reason}
    who: Row = {"method": job.method, "model": job.model, "run_id": job.run_id, "gripper": job.gripper}
    return dict.fromkeys(TRIALS.schema.names) | row | who | {"recorded_at": datetime.now(UTC)}


def latest_trials(outs: Sequence[Path]) -> pd.DataFrame:
    """The latest trial of every task, asset, method and model in these outputs."""
    frames = [read_own_files(out, TRIALS) for out in outs]
    whole = pd.concat(frames, ignore_index=True) if frames else pd.DataFrame()
    key = list(TRIALS.key)
    return whole.sort_values("recorded_at").drop_duplicates(key, keep="last").sort_values(key, ignore_index=True)
