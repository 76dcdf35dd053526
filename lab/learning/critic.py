"""A critic that sees more than the actor, as the paper's does: how far the object itself was moved."""

from typing import Any

import gymnasium
import mujoco
import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor

from asset2sim.gym.environment import SIZE, Action, ObjectEnv
from asset2sim.physics.arrays import Array
from schemas.learning_settings import GuardSettings

Seen = NDArray[np.float32]
OBJECT = 9
"""How many numbers the critic alone sees."""
MOST = np.full(OBJECT, 10.0)
"""Where each of them is cut off: its unit is a bound, or rad/s and m/s."""


class CriticEnv(gymnasium.Wrapper[Seen, Action, Seen, Action]):
    """An ``ObjectEnv`` that shows nine numbers more, after its 38: tilt, lift and travel of the object as shares of the
    guards' bounds, and the angular (rad/s) and linear (m/s) velocity of its root link in the world."""

    def __init__(self, env: ObjectEnv) -> None:
        super().__init__(env)
        self.one = env
        self.observation_space = with_object_space(env.observation_space)  # type: ignore[arg-type, assignment]

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Seen, dict[str, Any]]:
        """Begin an episode, as ``ObjectEnv`` does."""
        seen, info = self.env.reset(seed=seed, options=options)
        return self.with_object(seen), info

    def step(self, action: Action) -> tuple[Seen, float, bool, bool, dict[str, Any]]:
        """Do one action, as ``ObjectEnv`` does."""
        seen, reward, lost, ended, info = self.env.step(action)
        return self.with_object(seen), float(reward), lost, ended, info

    def with_object(self, seen: Seen) -> Seen:
        """(47,) what the actor sees, (38,), and what the critic alone sees."""
        one, speed = self.one, np.zeros(6)
        mujoco.mj_objectVelocity(one.stage.model, one.stage.data, mujoco.mjtObj.mjOBJ_BODY, one.root, speed, 0)
        return np.concatenate([seen, of_object(one.displaced()[0], speed[:3], speed[3:], one.settings.guards)])


def of_object(moved: Array, spin: Array, speed: Array, bounds: GuardSettings) -> Seen:
    """(…, 9) what the critic alone sees: tilt, lift and travel (rad, m) as shares of the guards' bounds, and the
    angular (rad/s) and linear (m/s) velocity of the root link in the world."""
    shares = moved / (bounds.tilt_rad, bounds.lift_m, bounds.travel_m)
    # A world that has diverged has no numbers; its episode is over.
    found = np.clip(np.nan_to_num(np.concatenate([shares, spin, speed], axis=-1)), -MOST, MOST)
    return np.asarray(found, dtype=np.float32)


def with_object_space(space: spaces.Box) -> spaces.Box:
    """The space of observations with what the critic alone sees behind them."""
    high = np.concatenate([space.high, MOST]).astype(np.float32)
    return spaces.Box(-high, high, dtype=np.float32)


class Blind(BaseFeaturesExtractor):  # type: ignore[misc]
    """Observations in which what the critic alone sees is 0."""

    def __init__(self, space: spaces.Box) -> None:
        super().__init__(space, features_dim=space.shape[0])
        self.register_buffer("seen", (torch.arange(space.shape[0]) < SIZE).float())

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """(n, 47) observations → (n, 47)."""
        return observations * self.seen


class AsymmetricPolicy(ActorCriticPolicy):  # type: ignore[misc]
    """The library's actor and critic, of which the actor is blind to what the critic alone sees."""

    def __init__(self, *words: Any, **options: Any) -> None:
        super().__init__(*words, share_features_extractor=False, **options)
        self.pi_features_extractor = self.features_extractor = Blind(self.observation_space)
