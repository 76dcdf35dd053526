"""One training: what a child process does for one task, one refined object and one seed."""

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from stable_baselines3 import PPO

from asset2sim.gym.environment import ObjectEnv
from asset2sim.load import LoadError
from lab.learning.lesson import Lesson, Point, TrainingProgress, checkpoint, read_progress, write_progress
from lab.learning.ppo import acting, environments, load_policy, new_model, on_device, restore, save
from lab.learning.rollouts import DISPLACED, GUARDS, Rolled, roll, rollout_seeds, write_film
from schemas.errors import UsageError
from schemas.table import Row

FILM = "rollout.mp4"
LEARNT, NOT_LEARNT, SOLVED, DIVERGED, FAILED = "learnt", "not learnt", "solved at start", "diverged", "failed"
MOST_SEED = 2**31
NUMBERS = ("train/approx_kl", "train/clip_fraction", "train/explained_variance", "train/std", "train/value_loss")
"""What the library says of an update that is kept of each checkpoint."""


def train(lesson: Lesson, *, tell: Callable[[Point], None]) -> tuple[Row, tuple[Point, ...]]:
    """Train, or go on from the last checkpoint; the row of the table ``learning``, but for what the run knows, and the
    checkpoints. ``tell`` hears of each new one. Whatever goes wrong with the object is an outcome."""
    try:
        first = made(lesson)
    except (UsageError, LoadError) as error:
        return ended(FAILED, str(error).splitlines()[0]), ()
    if first.reset(options={"start": 0})[1]["solved_at_start"]:
        return ended(SOLVED, f"{first.subject.joint.name} starts where it should end, by its limits as loaded"), ()
    lesson.to.mkdir(parents=True, exist_ok=True)
    progress = read_progress(lesson.to, lesson.key)
    lesson.to.mkdir(parents=True, exist_ok=True)
    judges = [first, *(made(lesson) for _ in range(min(9, lesson.ppo.checkpoint_rollouts) - 1))]
    progress = learnt(lesson, progress, judges, tell)
    best = progress.best
    if best is None:
        return ended(DIVERGED, progress.ended), ()
    act = load_policy(checkpoint(lesson.to, best))
    seeds = rollout_seeds(lesson.seed, lesson.ppo.rollouts)
    found = roll(judges, act, seeds)
    if lesson.filmed:
        write_film(lesson.folder, first, act, seeds[0], lesson.to / FILM)
    return row_of(lesson, progress, best, found), progress.points


def learnt(
    lesson: Lesson, progress: TrainingProgress, judges: Sequence[ObjectEnv], tell: Callable[[Point], None]
) -> TrainingProgress:
    """Train until S is held, the budget or the time is used up, or the policy diverges."""
    ppo, at = lesson.ppo, progress.points[-1] if progress.points else None
    if lesson.finished(progress):
        return progress
    # Episodes other than those that it began with, where it goes on.
    seed, make = (lesson.seed + 1000 * progress.steps) % MOST_SEED, partial(made, lesson)
    if at is None:
        model = new_model(environments(make, ppo, seed), ppo, seed)
    else:
        model = restore(checkpoint(lesson.to, at), make, ppo, seed)
    seeds = rollout_seeds(lesson.seed, ppo.rollouts + ppo.checkpoint_rollouts)[ppo.rollouts :]
    began, before = time.monotonic(), progress.seconds
    late = began + 60.0 * lesson.minutes - before

    def go_on(*_: Any) -> bool:
        return time.monotonic() < late

    while not lesson.finished(progress):
        steps, then = model.num_timesteps, time.monotonic()
        try:
            some = min(ppo.checkpoint_steps, lesson.budget - steps)
            model.learn(some, callback=go_on, reset_num_timesteps=False, log_interval=None)
        except (ValueError, FloatingPointError) as error:  # of numbers that are none
            return progress.model_copy(update={"ended": f"the policy diverged: {str(error).splitlines()[0]}"})
        took = time.monotonic() - then
        found = roll(judges, acting(model), seeds)
        point = Point(
            steps=model.num_timesteps, seconds=before + time.monotonic() - began, s=mean(item.s for item in found),
            success=mean(item.success for item in found), reward=mean(item.reward for item in found),
            fps=(model.num_timesteps - steps) / took, numbers=numbers(model),
        )  # fmt: skip
        save(model, checkpoint(lesson.to, point))
        progress = progress.model_copy(update={"points": (*progress.points, point), "device": on_device(ppo)})
        write_progress(lesson.to, progress)
        tell(point)
    return progress


def made(lesson: Lesson) -> ObjectEnv:
    """One more environment of what is to be learnt."""
    return ObjectEnv(lesson.folder, lesson.task, settings=lesson.learning)


def numbers(model: PPO) -> dict[str, float]:
    """Figures of the library on the last update."""
    known = model.logger.name_to_value
    return {name: float(known[name]) for name in NUMBERS if name in known}


def mean(values: Any) -> float:
    """The mean."""
    return float(np.mean(list(values)))


def row_of(lesson: Lesson, progress: TrainingProgress, best: Point, found: Sequence[Rolled]) -> Row:
    """A training's row."""
    seconds, rate = progress.seconds, mean(item.success for item in found)
    if progress.held(lesson.ppo.held):
        outcome = ended(LEARNT, "")
    elif progress.ended:
        outcome = ended(DIVERGED, progress.ended)
    else:
        used = "actions" if progress.steps >= lesson.budget else "minutes"
        last = progress.points[-1]
        outcome = ended(NOT_LEARNT, f"its {used} are used up; at the last checkpoint {last.success:.0%} succeeded")
    return outcome | {
        "steps": progress.steps, "chosen_steps": best.steps, "seconds": seconds, "fps": progress.steps / seconds,
        "s": mean(item.s for item in found), "success": rate, "rollouts": len(found), "first_seed": found[0].seed,
        "diverged": sum(item.diverged for item in found), "gripper": lesson.learning.gripper,
        "device": progress.device or on_device(lesson.ppo), "video": FILM if lesson.filmed else None,
        "reached": mean(item.reached for item in found),
        **{name: sum(bool(getattr(item, name)) for item in found) for name in GUARDS},
        **{name: max(getattr(item, name) for item in found) for name in DISPLACED},
    }  # fmt: skip


def ended(outcome: str, reason: str) -> Row:
    """How a training ended."""
    return {"outcome": outcome, "reason": reason}
