"""Probe trials of many refined objects, as a study: the table of them."""

import pkgutil
import shutil
import statistics
import time
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import mujoco

from asset2sim.catalog.read import latest_rows
from asset2sim.experiments.isolation import Ending as ChildEnding
from asset2sim.experiments.isolation.supervise import Work
from asset2sim.gym.arm.gripper import PANDA
from asset2sim.load import LoadError
from lab.probes.experts import NoWayError
from lab.probes.observation import Chunk, Observation, Policy, PolicyError, TrialEnding
from lab.probes.policies import BLIND, PolicySpec, opened
from lab.probes.serving import ServingError
from lab.probes.tasks import PAPER11, ProbeTask
from lab.runner import FAILED, Done, RunWork, Study, done_row, run_study
from lab.schemas.settings import ProbeSettings
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


SHARE = 0.8
"""Share of a trial's wall time that its policy may take in all: the trial then ends by itself and says so."""
Episode = Callable[[Callable[[Observation], Chunk]], Row]
"""An episode to be run with a policy; its row holds columns of the table of probe trials."""


class Timed:
    """A policy whose answers are timed. Raises PolicyError once they took too long in all."""

    def __init__(self, policy: Policy, most_s: float) -> None:
        self.policy, self.most_s = policy, most_s
        self.latencies: list[float] = []

    def __call__(self, seen: Observation) -> Chunk:
        """The policy's answer."""
        if sum(self.latencies) > self.most_s:
            raise PolicyError(TrialEnding.TIMED_OUT, f"{len(self.latencies)} answers took more than {self.most_s:g} s")
        began = time.monotonic()
        try:
            return self.policy(seen)
        finally:
            self.latencies.append(time.monotonic() - began)


def run_probe(episode: Episode, spec: PolicySpec, make: Callable[[], Policy], settings: ProbeSettings) -> Row:
    """The row of an episode with a policy, but for what the run knows. What the policy does wrong is an outcome, and no
    result of the object; that it cannot be put into the scene, or that a probe of ours finds no way, is one."""
    began = time.monotonic()
    timed: Timed | None = None
    try:
        with opened(spec, make, settings) as policy:
            timed = Timed(policy, SHARE * settings.trial_s)
            row = episode(timed)
    except PolicyError as error:
        row = {"outcome": error.ending.value, "reason": str(error), "success": None}
    except (LoadError, ValueError, NoWayError, ServingError, mujoco.FatalError) as error:
        row = {"outcome": FAILED, "reason": str(error).partition("\n")[0], "success": False}
    latencies = timed.latencies if timed is not None else []
    times: Row = {
        "latency_s": statistics.median(latencies) if latencies else None,
        "latency_max_s": max(latencies, default=None),
    }
    return row | times | {"asked": len(latencies), "seconds": time.monotonic() - began}
