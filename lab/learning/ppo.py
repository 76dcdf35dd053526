"""PPO of stable-baselines3 on environments of one object: made, kept in files, and taken from them again. Only what a
training's child runs imports this: torch takes seconds to load."""

import os
import pickle
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv, VecNormalize

from asset2sim.gym.environment import Action, ObjectEnv
from lab.learning.critic import AsymmetricPolicy, CriticEnv
from lab.learning.rollouts import Act
from lab.schemas.settings import PpoSettings

MODEL, SCALING = "policy.zip", "scaling.pkl"
"""Files of a checkpoint: the policy with its optimiser, and the running mean and deviation of what it observes."""
CLIPPED = 10.0
"""Deviations at which what is observed, and a reward, is cut off: the library's."""


def environments(make: Callable[[], ObjectEnv], settings: PpoSettings, seed: int) -> VecNormalize:
    """Environments side by side in this thread, what they show and pay scaled to deviation 1 as it comes."""
    torch.set_num_threads(1)
    if settings.physics == "warp":
        from lab.learning.warp_env import WarpEnv
        from lab.learning.warp_ppo import WarpVecEnv

        worlds = WarpEnv(make(), settings.environments, on_device(settings))
        several: VecEnv = WarpVecEnv(worlds, settings.critic_sees_object)
    else:
        shown = (lambda: CriticEnv(make())) if settings.critic_sees_object else make
        several = DummyVecEnv([shown for _ in range(settings.environments)])
    several.seed(seed)
    return VecNormalize(several, gamma=settings.discount, clip_obs=CLIPPED, clip_reward=CLIPPED)


def on_device(settings: PpoSettings) -> str:
    """Where the policy is trained, and the worlds of Warp are: ``cuda`` where there is a GPU and it is wanted."""
    return "cuda" if settings.device == "auto" and torch.cuda.is_available() else "cpu"


def new_model(envs: VecNormalize, settings: PpoSettings, seed: int) -> PPO:
    """A policy that has learnt nothing."""
    noisy = settings.noise_actions > 0
    policy = AsymmetricPolicy if settings.critic_sees_object else "MlpPolicy"
    return PPO(
        policy, envs, n_steps=settings.rollout, batch_size=settings.minibatch, n_epochs=settings.epochs,
        learning_rate=settings.learning_rate, gamma=settings.discount, gae_lambda=settings.smoothing,
        clip_range=settings.clip, target_kl=settings.most_divergence, ent_coef=settings.entropy, seed=seed,
        use_sde=noisy, sde_sample_freq=settings.noise_actions if noisy else -1, device=on_device(settings),
        policy_kwargs={"net_arch": list(settings.hidden), "log_std_init": settings.noise_log_std},
    )  # fmt: skip


def save(model: PPO, to: Path) -> None:
    """Write a checkpoint into a folder of its own, which is there only when it is whole."""
    part = to.with_name(f".{to.name}.part")
    part.mkdir(parents=True, exist_ok=True)
    model.save(part / MODEL)
    scaling = model.get_vec_normalize_env()
    assert scaling is not None
    scaling.save(str(part / SCALING))
    shutil.rmtree(to, ignore_errors=True)
    os.replace(part, to)


def restore(checkpoint: Path, make: Callable[[], ObjectEnv], settings: PpoSettings, seed: int) -> PPO:
    """A policy that goes on from its checkpoint; its environments begin with other episodes than they first had."""
    envs = VecNormalize.load(str(checkpoint / SCALING), environments(make, settings, seed).venv)
    found: PPO = PPO.load(checkpoint / MODEL, env=envs, device=on_device(settings))
    found.set_random_seed(seed)
    return found


def acting(model: PPO) -> Act:
    """Actions of a policy in training, without noise."""
    scaling = model.get_vec_normalize_env()
    assert scaling is not None
    return without_noise(model, scaling)


def load_policy(checkpoint: str | Path) -> Act:
    """The policy in a checkpoint's folder: (n, 38) observations → (n, 7) actions. The files are pickled:
    load only what you or somebody whom you trust has trained."""
    with (Path(checkpoint) / SCALING).open("rb") as file:
        scaling = pickle.load(file)
    return without_noise(PPO.load(Path(checkpoint) / MODEL, device="cpu"), scaling)


def without_noise(model: PPO, scaling: VecNormalize) -> Act:
    """A policy's mean actions, of observations that are scaled as they were when it learnt."""

    def act(seen: NDArray[np.float32]) -> Action:
        (size,) = scaling.observation_space.shape
        seen = np.pad(seen, ((0, 0), (0, size - seen.shape[1])))  # the actor is blind to the rest
        found: Action = model.predict(scaling.normalize_obs(seen), deterministic=True)[0]
        return found

    return act
