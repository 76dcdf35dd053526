"""The environments of MuJoCo Warp as stable-baselines3 takes them."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv

from lab.learning.critic import with_object_space
from lab.learning.warp_env import WarpEnv


class WarpVecEnv(VecEnv):  # type: ignore[misc]
    """One ``WarpEnv`` as the library's vectorised environment, ``with_object`` as ``CriticEnv`` shows it; each has no
    object of its own to be asked."""

    def __init__(self, envs: WarpEnv, with_object: bool = False) -> None:
        self.envs, self.actions = envs, np.zeros(envs.action_space.shape or (0,), dtype=np.float32)
        self.first_seed: int | None = None
        self.with_object = with_object
        space = envs.single_observation_space
        super().__init__(envs.num_envs, with_object_space(space) if with_object else space, envs.single_action_space)

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """The seed of the next reset, of all together."""
        self.first_seed = seed
        return [seed] * self.num_envs

    def reset(self) -> NDArray[np.float32]:
        """Begin all anew; what they see."""
        seen, _ = self.envs.reset(seed=self.first_seed)
        self.first_seed = None
        return self.shown(seen, self.envs.object_moved())

    def shown(self, seen: NDArray[np.float32], of_object: NDArray[np.float32]) -> NDArray[np.float32]:
        """(n, 38) or (n, 47) what is shown of observations (n, 38) and what the critic alone sees (n, 9)."""
        return np.concatenate([seen, of_object], axis=1) if self.with_object else seen

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Remember what is to be done."""
        self.actions = actions

    def step_wait(self) -> tuple[NDArray[np.float32], NDArray[Any], NDArray[np.bool_], list[dict[str, Any]]]:
        """Do it. Of those that ended, what they last saw is in their info, and whether time alone ended them."""
        seen, rewards, lost, ended, info = self.envs.step(self.actions)
        over = lost | ended
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        last = self.shown(info.get("final_obs", seen), info["object"])
        for index in np.flatnonzero(over):
            infos[index] = {"terminal_observation": last[index], "TimeLimit.truncated": bool(ended[index])}
        seen = self.shown(seen, self.envs.object_moved())
        return seen, rewards.astype(np.float32), over, infos

    def close(self) -> None:
        """Nothing is held."""

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute of all of them together, once for each that is asked."""
        return [getattr(self.envs, attr_name, None) for _ in self._indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """There is nothing to set. Raises AttributeError."""
        raise AttributeError(f"{attr_name} cannot be set: worlds of MuJoCo Warp share one model")

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **options: Any) -> list[Any]:
        """There is nothing to call. Raises AttributeError."""
        raise AttributeError(f"{method_name} cannot be called: worlds of MuJoCo Warp are stepped together")

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """None is."""
        return [False for _ in self._indices(indices)]

    def _indices(self, indices: Any) -> Iterable[int]:
        found: Iterable[int] = self._get_indices(indices)
        return found
