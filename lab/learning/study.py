"""Trainings of many refined objects: each in a killable child, spread over Dask's workers; the tables of learning."""

import importlib.util
import shutil
import tempfile
import uuid
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path

import pandas as pd
from distributed import Client, as_completed

from asset2sim.catalog.own_files import OwnFile, read_own_files
from asset2sim.catalog.read import latest_rows
from asset2sim.experiments.cluster import open_client
from asset2sim.experiments.interrupt import sigterm_as_interrupt
from asset2sim.experiments.isolation import Ending, accept_children, run_isolated, stop_children
from asset2sim.gym.arm.tasks import PAPER, Task, Verb, joint_of
from asset2sim.gym.subject import learned_tasks, task_to_learn
from lab.learning.learning_log import begin_run, end_run, log_point
from lab.learning.lesson import Lesson
from lab.learning.progress import Point, read_progress
from lab.schemas.tables_learning import LEARNING, LEARNING_CURVES
from schemas.errors import UnknownChoiceError, UsageError
from schemas.learning_settings import LearningSettings, PpoSettings
from schemas.overlay import PhysicsOverlay
from schemas.settings import RunSettings
from schemas.table import Row, Table

PAPER9 = "paper9"
POLICIES = "policies"
"""Folder of OUT in which checkpoints and films are: ``policies/ASSET/TASK/METHOD-MODEL-SEED/``."""
LIBRARIES = ("av", "gymnasium", "mujoco", "stable_baselines3", "torch")
TRAIN = "lab.learning.training:train"
FAILED = "failed"
"""Outcome of a training that broke down: the next command does what is left of it."""
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
    owner: str = ""

    @property
    def who(self) -> Row:
        """The key of its row."""
        lesson = self.lesson
        return {
            "task": lesson.task.name, "asset_id": lesson.folder.name, "method": self.method, "model": self.model,
            "seed": lesson.seed,
        }  # fmt: skip


def check_libraries(*, warp: bool = False) -> None:
    """Raise UsageError where what learns, with ``warp`` also MuJoCo Warp, is not installed."""
    missing = [name for name in LIBRARIES if importlib.util.find_spec(name) is None]
    if missing:
        raise UsageError(f"learning needs {', '.join(missing)}: pip install 'asset2sim[learn]' (make learn does it)")
    if warp and importlib.util.find_spec("mujoco_warp") is None:
        raise UsageError("--warp needs MuJoCo Warp: pip install 'asset2sim[warp]'")


@dataclass(frozen=True)
class Chosen:
    """What of an output's objects is trained, and how: empty names choose all; ``seeds`` is how many."""

    tasks: Collection[str] = ()
    assets: Collection[str] = ()
    methods: Collection[str] = ()
    seeds: int = 3
    budget: int = 2_000_000
    minutes: float = 30.0
    filmed: bool = True
    learning: LearningSettings = field(default_factory=LearningSettings)
    ppo: PpoSettings = field(default_factory=PpoSettings)


def trainings_of(data: Path, out: Path, chosen: Chosen) -> list[Training]:
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


def task_chosen(folder: Path, chosen: Chosen) -> Task | None:
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


def run_trainings(
    todo: Sequence[Training], out: Path, run: RunSettings, heard: Heard, told: Callable[[Row, int], None]
) -> None:
    """Do every training, or go on with it, and store its row and its curve in OUT. ``heard`` hears of each checkpoint,
    ``told`` each row and how many are left. Whatever a training does is a row. An interruption ends the children and
    keeps the rows and checkpoints so far."""
    rows, curves = OwnFile(out, LEARNING), OwnFile(out, LEARNING_CURVES)
    owner = f"learning-{uuid.uuid4().hex}"
    accept_children(owner)
    with tempfile.TemporaryDirectory() as place, sigterm_as_interrupt(), open_client(run, Path(place)) as client:
        try:
            owned = [replace(item, owner=owner) for item in todo]
            for done, (item, row, points) in enumerate(results(client, owned, heard), start=1):
                rows.add([row])
                if points:
                    curves.add([curve_row(item, point, row) for point in points])
                told(row, len(todo) - done)
        finally:
            stop_children(owner)


def results(
    client: Client, todo: Sequence[Training], heard: Heard
) -> Iterator[tuple[Training, Row, tuple[Point, ...]]]:
    """Each training, its row and its checkpoints, as they end. Workers are threads of this process: they may hear."""
    futures = {client.submit(trained, item, heard, pure=False): item for item in todo}
    for future in as_completed(futures):
        yield futures[future], *future.result()


def trained(item: Training, heard: Heard) -> tuple[Row, tuple[Point, ...]]:
    """One training in a child of its own, which may crash or hang; then what its checkpoints hold is kept."""
    lesson = item.lesson
    name = f"{lesson.task.name}, {item.method}, seed {lesson.seed}"
    params = item.who | {"budget": lesson.budget, **lesson.ppo.model_dump()}
    if not read_progress(lesson.to, lesson.key).points:
        shutil.rmtree(lesson.to, ignore_errors=True)  # a run in MLflow of its own, if it began before
    run = begin_run(item.out, lesson.to, name, params)

    def tell(point: Point) -> None:
        heard(item, point)
        log_point(item.out, run, point)

    with tempfile.TemporaryDirectory(prefix="asset2sim-learn-") as place:
        outcome = run_isolated(
            TRAIN, (lesson,), time_limit_s=60.0 * lesson.minutes + REST_S, memory_limit_mb=lesson.ppo.memory_mb,
            services={"tell": tell}, log_path=Path(place, "training.log"), owner=item.owner, fresh=True,
        )  # fmt: skip
    row: Row = {"outcome": FAILED, "reason": outcome.reason}
    points: tuple[Point, ...] = ()
    if outcome.ending is Ending.RETURNED and isinstance(outcome.value, tuple):
        row, points = outcome.value
    film = row.get("video")
    row = dict.fromkeys(LEARNING.schema.names) | row | item.who | {
        "category": item.category, "run_id": item.run_id, "budget": lesson.budget,
        "video": str((lesson.to / str(film)).relative_to(item.out)) if film else None,
        "recorded_at": datetime.now(UTC),
    }  # fmt: skip
    end_run(item.out, run, row)
    return row, points


def curve_row(item: Training, point: Point, row: Row) -> Row:
    """A checkpoint's row."""
    return item.who | {
        "steps": point.steps, "seconds": point.seconds, "s": point.s, "success": point.success,
        "reward": point.reward, "recorded_at": row["recorded_at"],
    }  # fmt: skip


def left_to_do(todo: Sequence[Training], out: Path, force: bool) -> list[Training]:
    """The trainings that have not ended, by their checkpoints and the table, or broke down; with ``force`` all, from
    the beginning."""
    if force:
        for item in todo:
            shutil.rmtree(item.lesson.to, ignore_errors=True)
        return list(todo)
    rows = latest(out, LEARNING)
    known = rows[rows["outcome"] != FAILED].set_index(list(LEARNING.key)).index
    return [item for item in todo if tuple(item.who.values()) not in known or not has_ended(item.lesson)]


def has_ended(lesson: Lesson) -> bool:
    """Whether a training with a row would find nothing left to train."""
    progress = read_progress(lesson.to, lesson.key)
    return lesson.finished(progress) if progress.points else False


def latest(out: Path, table: Table) -> pd.DataFrame:
    """The latest row of every key of one of the tables of learning in OUT."""
    whole, key = read_own_files(out, table), list(table.key)
    return whole.sort_values("recorded_at").drop_duplicates(key, keep="last").sort_values(key, ignore_index=True)
