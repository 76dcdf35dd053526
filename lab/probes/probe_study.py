"""Probe trials of many refined objects: each in a killable child, spread over Dask's workers; the table of them."""

import pkgutil
import shutil
import tempfile
import uuid
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from distributed import Client, as_completed

from asset2sim.catalog.own_files import OwnFile
from asset2sim.catalog.read import latest_rows
from asset2sim.experiments.cluster import open_client
from asset2sim.experiments.interrupt import sigterm_as_interrupt
from asset2sim.experiments.isolation import Ending as ChildEnding
from asset2sim.experiments.isolation import accept_children, run_isolated, stop_children
from lab.probes.answers import Ending
from lab.probes.kept_trials import KEY, results
from lab.probes.policies import PolicySpec
from lab.probes.probe_trial import FAILED, run_probe
from lab.probes.seen import Policy
from lab.probes.tasks import PAPER11, ProbeTask
from lab.schemas.probe_settings import ProbeSettings
from lab.schemas.tables_probes import PROBE_TRIALS
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
    episode: str = EPISODE
    maker: str = MAKER
    owner: str = ""

    @property
    def to(self) -> Path:
        """Where its film goes."""
        task = self.task.name.replace(" ", "-")
        return self.out / PROBES_FOLDER / self.spec.folder / self.folder.name / task / str(self.trial)

    @property
    def known(self) -> Row:
        """What is known of it before it is done: columns of its row."""
        return {
            "task": self.task.name, "asset_id": self.folder.name, "method": self.method, "model": self.model,
            "policy": self.spec.name, "trial": self.trial, "seed": self.seed, "protocol": self.spec.protocol,
            "ours": self.spec.ours, "run_id": self.run_id,
        }  # fmt: skip


@dataclass(frozen=True)
class ProbeChoice:
    """Which trials are asked for: tasks, assets and methods (all where empty), how many, from which seed on."""

    tasks: Sequence[ProbeTask]
    asset_ids: Collection[str] = ()
    methods: Collection[str] = ()
    trials: int = 5
    seed: int = 0


def chosen_tasks(names: Sequence[str]) -> tuple[ProbeTask, ...]:
    """The tasks of these names, ``ALL_TASKS`` among them. Raises UnknownChoiceError for a name that is none."""
    for name in names:
        if name != ALL_TASKS and name not in PAPER11:
            raise UnknownChoiceError("task", name, (ALL_TASKS, *PAPER11))
    return tuple(task for name, task in PAPER11.items() if name in names or ALL_TASKS in names)


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
                ProbeJob(out, folder, task, spec, trial, choice.seed + trial, *who)
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


def left_to_do(jobs: Sequence[ProbeJob]) -> list[ProbeJob]:
    """The jobs whose latest row, of the same seed and of the object as it is now, is none or has no result."""
    kept = []
    done = {out: results(out) for out in dict.fromkeys(job.out for job in jobs)}
    for job in jobs:
        row = job.known
        if (*(row[name] for name in KEY), job.seed, job.run_id) not in done[job.out]:
            kept.append(job)
    return kept


def run_probes(
    jobs: Sequence[ProbeJob], run: RunSettings, settings: ProbeSettings, told: Callable[[Row, int], None]
) -> int:
    """Do every trial and store its row in its output; ``told`` hears each row and how many are left. Whatever a trial
    or its policy does is a row. Returns how many were left undone: all that remain once several trials in a row found
    nobody to ask. An interruption ends the children and keeps the rows so far."""
    files = {job.out: OwnFile(job.out, PROBE_TRIALS) for job in jobs}
    owner = f"probes-{uuid.uuid4().hex}"
    accept_children(owner)
    left, alone = len(jobs), 0
    with tempfile.TemporaryDirectory() as place, sigterm_as_interrupt(), open_client(run, Path(place)) as client:
        try:
            futures = _submit(client, [replace(job, owner=owner) for job in jobs], settings)
            for future in as_completed(futures):
                job, row = futures[future], future.result()
                files[job.out].add([row])
                left -= 1
                told(row, left)
                alone = alone + 1 if row["outcome"] == Ending.UNREACHABLE else 0
                if alone == settings.unreachable_in_a_row:
                    break
        finally:
            stop_children(owner)
    return left


def _submit(client: Client, jobs: Sequence[ProbeJob], settings: ProbeSettings) -> dict[object, ProbeJob]:
    return {client.submit(trial_of, job, settings, pure=False): job for job in jobs}


def trial_of(job: ProbeJob, settings: ProbeSettings) -> Row:
    """One trial in a child of its own, which may crash or hang."""
    with tempfile.TemporaryDirectory(prefix="asset2sim-probe-") as place:
        outcome = run_isolated(
            episode_of,
            (job, settings),
            time_limit_s=settings.trial_s,
            memory_limit_mb=settings.trial_mb,
            services={},
            log_path=Path(place, "probe.log"),
            owner=job.owner,
        )
    # A child that dies or hangs does so over the object; an exception is a broken program, and says nothing of it.
    row: Row = {
        "outcome": FAILED,
        "reason": outcome.reason,
        "success": None if outcome.ending is ChildEnding.RAISED else False,
    }
    if outcome.ending is ChildEnding.RETURNED and isinstance(outcome.value, dict):
        row = outcome.value
    columns = PROBE_TRIALS.schema.names
    kept = {name: value for name, value in row.items() if name in columns}
    return dict.fromkeys(columns) | kept | job.known | {"recorded_at": datetime.now(UTC)}


def episode_of(job: ProbeJob, settings: ProbeSettings) -> Row:
    """The trial itself: what a child does."""
    shutil.rmtree(job.to, ignore_errors=True)
    job.to.mkdir(parents=True)
    episode = pkgutil.resolve_name(job.episode)
    row = run_probe(
        lambda policy: episode(job.folder, job.task, job.seed, policy, job.to), job.spec, partial(_make, job), settings
    )
    # Of an episode that its policy has ended there is a film, too.
    film = job.to / FILM
    return row | {"video": str(film.relative_to(job.out)) if film.is_file() else None}


def _make(job: ProbeJob) -> Policy:
    found: Policy = pkgutil.resolve_name(job.maker)(job.spec, job.folder, job.task, job.seed)
    return found
