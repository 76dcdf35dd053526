"""Rollouts of a policy: several at once, what became of each, and the recording of one for its film."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from asset2sim.gym.arm.tasks import Verb
from asset2sim.gym.environment import Action, ObjectEnv
from lab.trials.film import film, write_mp4
from lab.trials.record import TrackSamples

Act = Callable[[NDArray[np.float32]], Action]
"""(n, 38) observations → (n, k) actions."""
FIRST_SEED = 1_000_000
"""Seed of the first rollout of all: the rollouts of a training begin at this many times one more than its seed, so that
no training episode's seed, which are small, is among them."""
PHASE = "policy"


@dataclass(frozen=True)
class Rolled:
    """Result of one rollout: its ``seed`` and ``start``, S at its end (a press: the largest), the sum of its
    rewards, whether it is a success, and what the guards found. ``diverged`` is whether the simulation did, ``reached``
    whether it ended at the target, guards aside; ``tilted_rad``, ``lifted_m`` and ``travelled_m`` are of the object."""

    seed: int
    start: int
    s: float
    reward: float
    success: bool
    solved_at_start: bool = False
    drifted: bool = False
    moved_untouched: bool = False
    struck: bool = False
    spring_did_it: bool = False
    displaced: bool = False
    diverged: bool = False
    reached: bool = False
    tilted_rad: float = 0.0
    lifted_m: float = 0.0
    travelled_m: float = 0.0


def rollout_seeds(training_seed: int, count: int) -> range:
    """The seeds of a training's rollouts."""
    first = FIRST_SEED * (training_seed + 1)
    return range(first, first + count)


def roll(envs: Sequence[ObjectEnv], act: Act, seeds: Sequence[int]) -> list[Rolled]:
    """Results of a rollout from each of these seeds, as many at a time as there are environments."""
    found: list[Rolled] = []
    for first in range(0, len(seeds), len(envs)):
        some = seeds[first : first + len(envs)]
        found.extend(together(envs[: len(some)], act, some))
    return found


def together(envs: Sequence[ObjectEnv], act: Act, seeds: Sequence[int]) -> list[Rolled]:
    """One rollout in each environment, side by side: a policy answers all of them at once."""
    begun = [env.reset(seed=seed) for env, seed in zip(envs, seeds, strict=True)]
    seen, starts = np.array([first for first, _ in begun]), [int(info["start"]) for _, info in begun]
    rewards, ends = np.zeros(len(envs)), dict[int, Rolled]()
    while len(ends) < len(envs):
        actions = act(seen)
        for index in set(range(len(envs))) - set(ends):
            env = envs[index]
            seen[index], reward, lost, ended, info = env.step(actions[index])
            rewards[index] += reward
            if info.get("diverged"):
                ends[index] = Rolled(seeds[index], starts[index], 0.0, rewards[index], False, diverged=True)
            elif lost or ended:
                pressed = env.subject.task.verb is Verb.PRESS
                said: dict[str, Any] = {name: bool(info[name]) for name in (*GUARDS, "reached")}
                said |= {name: float(info[name]) for name in DISPLACED}
                s, done = info["S_best" if pressed else "S"], bool(info["is_success"])
                ends[index] = Rolled(seeds[index], starts[index], s, float(rewards[index]), done, **said)
    return [ends[index] for index in range(len(envs))]


GUARDS = ("solved_at_start", "drifted", "moved_untouched", "struck", "spring_did_it", "displaced")
"""The guards, as the end of an episode names them."""
DISPLACED = ("tilted_rad", "lifted_m", "travelled_m")
"""How far the object itself was moved at most in an episode."""


def write_film(folder: Path, env: ObjectEnv, act: Act, seed: int, to: Path) -> None:
    """Do the rollout of this seed once more and write its film. Raises UsageError where the package ``av`` is not
    installed."""
    samples = TrackSamples(env.stage)

    def watch(data: mujoco.MjData, work_j: float) -> None:
        samples.take(data, 0.0, work_j)

    env.watched = watch
    try:
        (end,) = together([env], act, [seed])
    finally:
        env.watched = None
    track = samples.phased((PHASE,) * len(samples.times), not end.diverged)
    write_mp4(film(folder, track, env.stage.base, None, env.stage.gripper), to)
