"""Probe trials of many refined objects, as a study: the table of them."""

import pkgutil
import shutil
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from asset2sim.catalog.read import latest_rows
from asset2sim.experiments.isolation import Ending as ChildEnding
from asset2sim.experiments.isolation.supervise import Work
from asset2sim.gym.arm.gripper import PANDA
from lab.probes.answers import TrialEnding
from lab.probes.observation import Policy
from lab.probes.policies import BLIND, PolicySpec
from lab.probes.probe_trial import run_probe
from lab.probes.tasks import PAPER11, ProbeTask
from lab.runner import Done, RunWork, Study, done_row, run_study
from lab.schemas.probe_settings import ProbeSettings
from lab.schemas.tables import PROBE_TRIALS
from lab.trials.trial import FILM
from schemas.errors import UnknownChoiceError, UsageError
from schemas.settings import RunSettings
from schemas.table import Row

PROBES_FOLDER = "probes"
"""Folder of an output in which films are: ``probes/POLICY/ASSET/TASK/TRIAL/``."""
ALL_TASKS = "paper11"
"""The name of all of the paper's tasks."""
EPISODE = "lab.probes.episode:run_episode"
MAKER = "lab.probes.policies:make_probe"


@dataclass(frozen=True)
class ProbeJob:
    """One trial to do: a task with an asset of an output, by a policy, from a start that the seed makes. ``episode``
    and ``maker`` name the functions ``module:function`` that run it and that make a probe of ours."""

    out: Path
    folder: Path
    task: ProbeTask
    spec: PolicySpec
    trial: int
    seed: int
    method: str
    model: str
    run_id: str | None
    film: bool = True
    episode: str = EPISODE
    maker: str = MAKER

    @property
    def to(self) -> Path:
        """Where its film goes."""
        task = self.task.name.replace(" ", "-")
        return self.out / PROBES_FOLDER / self.spec.folder / self.folder.name / task / str(self.trial)

    @property
    def known(self) -> Row:
        """Columns known of it before it is done: columns of its row."""
        return {
            "task": self.task.name, "asset_id": self.folder.name, "method": self.method, "model": self.model,
            "policy": self.spec.name, "trial": self.trial, "seed": self.seed, "protocol": self.spec.protocol,
            "ours": self.spec.ours, "run_id": self.run_id, "gripper": self.task.gripper,
        }  # fmt: skip


@dataclass(frozen=True)
class ProbeChoice:
    """Which trials are asked for: tasks, assets and methods (all where empty), how many, from which seed on."""

    tasks: Sequence[ProbeTask]
    asset_ids: Collection[str] = ()
    methods: Collection[str] = ()
    trials: int = 5
    seed: int = 0
    film: bool = True


def chosen_tasks(names: Sequence[str], gripper: str = PANDA.name) -> tuple[ProbeTask, ...]:
    """The tasks of these names, ``ALL_TASKS`` among them, with a gripper. Raises UnknownChoiceError for a name
    that is none."""
    for name in names:
        if name != ALL_TASKS and name not in PAPER11:
            raise UnknownChoiceError("task", name, (ALL_TASKS, *PAPER11))
    found = (task for name, task in PAPER11.items() if name in names or ALL_TASKS in names)
    return tuple(replace(task, gripper=gripper) for task in found)


def jobs_of(outs: Sequence[Path], spec: PolicySpec, choice: ProbeChoice) -> list[ProbeJob]:
    """The trials of outputs' refined objects. The seed of a trial is the choice's plus its number, for all methods and
    policies the same. Raises UsageError where there is no catalog or nothing to do, UnknownChoiceError for an asset or
    a method that no output has."""
    rows = [(out, row) for out in outs for (frame,) in [latest_rows(out, "assets")] for row in frame.to_dict("records")]
    for kind, names, column in (("asset", choice.asset_ids, "asset_id"), ("method", choice.methods, "method")):
        there = {str(row[column]) for _, row in rows}
        for name in names:
            if name not in there:
                raise UnknownChoiceError(kind, name, there)
    found: list[ProbeJob] = []
    for out, row in rows:
        asset_id, method = str(row["asset_id"]), str(row["method"])
        folder = out / "assets" / asset_id
        if asset_id not in (choice.asset_ids or (asset_id,)) or method not in (choice.methods or (method,)):
            continue
        if (folder / "overlay.json").is_file():
            who = method, str(row["model"]), str(row["run_id"])
            found.extend(
                ProbeJob(out, folder, task, spec, trial, choice.seed + trial, *who, choice.film)
                for task in choice.tasks
                if task.asset_id == asset_id
                for trial in range(choice.trials)
            )
    if not found:
        known = ", ".join(sorted({task.asset_id for task in choice.tasks}))
        raise UsageError(
            f"{', '.join(map(str, outs))}: no refined object among those chosen has one of these tasks; they are of "
            f"the assets {known}"
        )
    return found


def probe_study(settings: ProbeSettings) -> Study[ProbeJob]:
    """The study of probe trials. A trial is settled by a result of the same seed and of the object as it is now."""
    return Study(
        "probe", (PROBE_TRIALS,), partial(do_probe, settings=settings),
        lambda row: f"{row['policy']} {row['method']} {row['task']} ({row['asset_id']}), trial {row['trial']}",
        lambda job, row: row["success"] is not None
        and (row["seed"], row["run_id"], row.get("gripper")) == (job.seed, job.run_id, job.task.gripper),
    )  # fmt: skip


def run_probes(
    jobs: Sequence[ProbeJob],
    run: RunSettings,
    settings: ProbeSettings,
    told: Callable[[str, Row, int], None] | None = None,
) -> int:
    """Do every trial, as ``run_study`` does. Returns how many were left undone: all that remain once several trials in
    a row found no policy to ask."""
    alone = 0

    def enough(row: Row) -> bool:
        nonlocal alone
        alone = alone + 1 if row["outcome"] == TrialEnding.UNREACHABLE else 0
        return alone == settings.unreachable_in_a_row

    return run_study(probe_study(settings), jobs, run, told, enough)


def do_probe(job: ProbeJob, run: RunWork, settings: ProbeSettings) -> Done:
    """One trial, done in a child."""
    outcome = run(Work(episode_of, (job, settings), settings.trial_s, settings.trial_mb))
    # A child that dies or hangs does so over the object; an exception is a broken program, and says nothing of it.
    result: Row = {"success": None if outcome.ending is ChildEnding.RAISED else False}
    row = result | done_row(outcome)
    # An episode may say more.
    return Done({name: value for name, value in row.items() if name in PROBE_TRIALS.schema.names})


def episode_of(job: ProbeJob, settings: ProbeSettings) -> Row:
    """The trial itself: what a child does."""
    shutil.rmtree(job.to, ignore_errors=True)
    job.to.mkdir(parents=True)
    episode = pkgutil.resolve_name(job.episode)
    to, drawn = (job.to if job.film else None), job.film or job.spec.name not in BLIND
    row = run_probe(
        lambda policy: episode(job.folder, job.task, job.seed, policy, to, drawn),
        job.spec,
        partial(_make, job),
        settings,
    )
    # Of an episode that its policy has ended there is a film, too.
    film = job.to / FILM
    return row | {"video": str(film.relative_to(job.out)) if film.is_file() else None}


def _make(job: ProbeJob) -> Policy:
    found: Policy = pkgutil.resolve_name(job.maker)(job.spec, job.folder, job.task, job.seed)
    return found
