"""Trainings of many refined objects, as a study: the tables of learning, and a run in MLflow for each."""

import importlib.util
import logging
import shutil
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from asset2sim.catalog.mlflow_log import experiment_of, open_mlflow
from asset2sim.catalog.read import latest_rows
from asset2sim.experiments.isolation import Ending
from asset2sim.experiments.isolation.supervise import Work
from asset2sim.gym.arm.tasks import PAPER, Task, Verb, joint_of
from asset2sim.gym.subject import learned_tasks, task_to_learn
from lab.learning.lesson import Lesson, Point, read_progress
from lab.runner import FAILED, Done, RunWork, Study, left_to_do
from lab.schemas.settings import PpoSettings
from lab.schemas.tables import LEARNING, LEARNING_CURVES
from schemas.errors import UnknownChoiceError, UsageError
from schemas.learning_settings import LearningSettings
from schemas.overlay import PhysicsOverlay
from schemas.table import Row

EXPERIMENT = "asset2sim-learning"
IDENTITY = "mlflow_run"
"""File beside a training's checkpoints that names its run, so that it goes on in it."""

log = logging.getLogger(__name__)


@contextmanager
def store_of(out: Path, name: str) -> Iterator[Any]:
    """A client of OUT's MLflow store; what the store or its server refuses is said, and the tables are whole."""
    try:
        with open_mlflow(out) as client:
            yield client
    except Exception as error:  # whatever a store or a server can raise
        lines = str(error).splitlines() or [type(error).__name__]
        log.warning("MLflow does not hold %s: %s; the tables are complete", name, lines[0][:300])


def begin_run(out: Path, to: Path, name: str, params: Mapping[str, object]) -> str | None:
    """The id of the run in OUT's store of the training in ``to``, a new one where it has none; None where MLflow
    refuses."""
    file = to / IDENTITY
    with store_of(out, name) as client:
        from mlflow.entities import Param

        if file.is_file():
            known = file.read_text(encoding="utf-8")
            client.update_run(known, status="RUNNING")
        else:
            known = str(client.create_run(experiment_of(client, out, EXPERIMENT), run_name=name).info.run_id)
            client.log_batch(known, params=[Param(key, str(value)[:500]) for key, value in params.items()])
            to.mkdir(parents=True, exist_ok=True)
            file.write_text(known, encoding="utf-8")
        return known
    return None


def log_point(out: Path, run: str | None, point: Point) -> None:
    """Add a checkpoint to a run's curves."""
    figures = {"s": point.s, "success": point.success, "reward": point.reward, "fps": point.fps}
    figures |= {name.replace("/", "_"): value for name, value in point.numbers.items()}
    log_figures(out, run, figures | {"seconds": point.seconds}, point.steps)


def log_figures(out: Path, run: str | None, figures: Mapping[str, float], step: int, row: Row | None = None) -> None:
    """Add figures of one step to a run, and close it with what its training's row says where that is given."""
    if run is None:
        return
    with store_of(out, run) as client:
        from mlflow.entities import Metric

        now = int(1000 * time.time())
        client.log_batch(run, metrics=[Metric(name, value, now, step) for name, value in figures.items()])
        if row is not None:
            client.set_tag(run, "outcome", str(row["outcome"]))
            client.set_tag(run, "reason", str(row["reason"])[:500])
            client.set_terminated(run, status="FAILED" if row["outcome"] == "failed" else "FINISHED")


def end_run(out: Path, run: str | None, row: Row) -> None:
    """Close a training's run with what its row says."""
    found = {f"final_{name}": float(str(row[name])) for name in ("s", "success") if row.get(name) is not None}
    steps = row.get("steps")
    log_figures(out, run, found, steps if isinstance(steps, int) else 0, row)


PAPER9 = "paper9"
POLICIES = "policies"
"""Folder of OUT in which checkpoints and films are: ``policies/ASSET/TASK/METHOD-MODEL-SEED/``."""
CURVE = {"steps", "seconds", "s", "success", "reward"}
"""What of a checkpoint is a row of ``learning_curves``."""
LIBRARIES = ("av", "gymnasium", "mujoco", "stable_baselines3", "torch")
TRAIN = "lab.learning.training:train"
REST_S = 600.0
"""Wall time that a training may take beside its minutes, s: its world, the last checkpoint's rollouts, and the film."""

Heard = Callable[["Training", Point], None]


@dataclass(frozen=True)
class Training:
    """One training to do, and whose it is."""

    lesson: Lesson
    method: str
    model: str
    run_id: str | None
    category: str
    out: Path

    @property
    def who(self) -> Row:
        """The key of its row."""
        lesson = self.lesson
        return {
            "task": lesson.task.name, "asset_id": lesson.folder.name, "method": self.method, "model": self.model,
            "seed": lesson.seed,
        }  # fmt: skip

    @property
    def known(self) -> Row:
        """Columns of its rows that are known before it is done."""
        return self.who | {"category": self.category, "run_id": self.run_id, "budget": self.lesson.budget}


def check_libraries(*, warp: bool = False) -> None:
    """Raise UsageError where what learns, with ``warp`` also MuJoCo Warp, is not installed."""
    missing = [name for name in LIBRARIES if importlib.util.find_spec(name) is None]
    if missing:
        raise UsageError(f"learning needs {', '.join(missing)}: pip install './lab[learn]' (make learn does it)")
    if warp and importlib.util.find_spec("mujoco_warp") is None:
        raise UsageError("--warp needs MuJoCo Warp: pip install './lab[warp]'")


@dataclass(frozen=True)
class TrainingChoice:
    """Choice of an output's objects to train, and how: empty names choose all; ``seeds`` is how many."""

    tasks: Collection[str] = ()
    assets: Collection[str] = ()
    methods: Collection[str] = ()
    seeds: int = 3
    budget: int = 2_000_000
    minutes: float = 30.0
    filmed: bool = True
    learning: LearningSettings = field(default_factory=LearningSettings)
    ppo: PpoSettings = field(default_factory=PpoSettings)


def trainings_of(data: Path, out: Path, chosen: TrainingChoice) -> list[Training]:
    """The trainings of an output's refined objects. An object without a joint is left out, unless it is asked for by
    its name. Raises UnknownChoiceError for an asset that is none of it, CatalogError where there is no catalog."""
    (rows,) = latest_rows(data, "assets")
    known = {str(row["asset_id"]): row for row in rows.to_dict("records")}
    for asset_id in chosen.assets:
        if asset_id not in known:
            raise UnknownChoiceError("asset", asset_id, sorted(known))
    found: list[Training] = []
    for asset_id, row in known.items():
        folder, method = data / "assets" / asset_id, str(row["method"])
        task = task_chosen(folder, chosen)
        if task is None or (chosen.methods and method not in chosen.methods):
            continue
        model = str(row["model"])
        place = out / POLICIES / asset_id / task.name.replace(" ", "-")
        for seed in range(chosen.seeds):
            to = place / f"{method}-{model.replace('/', '_')}-{seed}"
            limits = chosen.learning, chosen.ppo, chosen.budget, chosen.minutes, chosen.filmed
            lesson = Lesson(folder, task, seed, to, *limits)
            found.append(Training(lesson, method, model, str(row["run_id"]), str(row["category"]), out))
    return found


def task_chosen(folder: Path, chosen: TrainingChoice) -> Task | None:
    """The task that is to be learnt with the refined object in a folder; None for none."""
    file, asset_id = folder / "overlay.json", folder.name
    if not file.is_file() or (chosen.assets and asset_id not in chosen.assets):
        return None
    try:
        overlay = PhysicsOverlay.model_validate_json(file.read_text(encoding="utf-8"))
    except ValueError:  # its training says so, in its row
        task = learned_tasks().get(asset_id, Task("open", Verb.OPEN))
    else:
        task = task_to_learn(overlay)
        if not chosen.assets and joint_of(task, overlay) is None:
            return None
    asked = not chosen.tasks or task.name in chosen.tasks or (PAPER9 in chosen.tasks and asset_id in PAPER)
    return task if asked else None


def learning_study(heard: Heard) -> Study[Training]:
    """The study of trainings; ``heard`` hears of each checkpoint. A training that broke down is not settled: the next
    command does what is left of it."""
    return Study(
        "learn", (LEARNING, LEARNING_CURVES), partial(do_training, heard=heard),
        lambda row: f"{row['task']} {row['method']} seed {row['seed']}",
        lambda item, row: row["outcome"] != FAILED and has_ended(item.lesson),
    )  # fmt: skip


def do_training(item: Training, run: RunWork, heard: Heard) -> Done:
    """One training in a child, or what is left of it, with its run in MLflow; then what its checkpoints hold."""
    lesson = item.lesson
    name = f"{lesson.task.name}, {item.method}, seed {lesson.seed}"
    params = item.who | {"budget": lesson.budget, **lesson.ppo.model_dump()}
    if not read_progress(lesson.to, lesson.key).points:
        shutil.rmtree(lesson.to, ignore_errors=True)  # a run in MLflow of its own, if it began before
    logged = begin_run(item.out, lesson.to, name, params)

    def tell(point: Point) -> None:
        heard(item, point)
        log_point(item.out, logged, point)

    limits = 60.0 * lesson.minutes + REST_S, lesson.ppo.memory_mb
    outcome = run(Work(TRAIN, (lesson,), *limits, services={"tell": tell}, fresh=True))
    row: Row = {"outcome": FAILED, "reason": outcome.reason}
    points: tuple[Point, ...] = ()
    if outcome.ending is Ending.RETURNED and isinstance(outcome.value, tuple):
        row, points = outcome.value
    film = row.get("video")
    row |= {"video": str((lesson.to / str(film)).relative_to(item.out)) if film else None}
    end_run(item.out, logged, row)
    return Done(row, {LEARNING_CURVES.name: [point.model_dump(include=CURVE) for point in points]})


def trainings_left(todo: Sequence[Training], heard: Heard, force: bool) -> list[Training]:
    """The trainings that have not ended, by their checkpoints and the table, or broke down; with ``force`` all, from
    the beginning."""
    if force:
        for item in todo:
            shutil.rmtree(item.lesson.to, ignore_errors=True)
        return list(todo)
    return left_to_do(learning_study(heard), todo)


def has_ended(lesson: Lesson) -> bool:
    """Whether a training with a row would find nothing left to train."""
    progress = read_progress(lesson.to, lesson.key)
    return lesson.finished(progress) if progress.points else False
