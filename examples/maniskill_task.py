"""A ManiSkill task with one object of a pack (``asset2sim pack OUT --for maniskill --out PACK``): a Panda beside it
does nothing for a second, and the object's joints stay where they start. On the CPU: ManiSkill's GPU scenes take
objects through its own builders.

    python examples/maniskill_task.py PACK NAME
"""

import sys

import gymnasium
import numpy as np
from mani_skill.envs.sapien_env import BaseEnv
from mani_skill.utils.building.ground import build_ground
from mani_skill.utils.registration import register_env

pack, name = sys.argv[1:]
sys.path.insert(0, pack)

import refined_objects  # noqa: E402


@register_env("RefinedObject-v1", max_episode_steps=200)
class RefinedObject(BaseEnv):
    """An empty task with one refined object on the ground, a metre and a half in front of the robot."""

    def _load_scene(self, options: dict[str, object]) -> None:
        build_ground(self.scene)
        self.items = refined_objects.add(self.scene, name, position=(1.5, 0.0))

    def _initialize_episode(self, env_idx: object, options: dict[str, object]) -> None:
        refined_objects.reset(self.items)

    def evaluate(self) -> dict[str, object]:
        """Nothing is asked of it."""
        return {}

    def _get_obs_extra(self, info: object) -> dict[str, object]:
        return {}


env = gymnasium.make("RefinedObject-v1", num_envs=1, sim_backend="cpu", render_backend="none", robot_uids="panda",
                     obs_mode="state_dict", reward_mode="none")  # fmt: skip
env.reset(seed=0)
(item,) = env.unwrapped.items
start = item.positions()
for _ in range(env.unwrapped.control_freq):
    env.step(np.zeros(env.action_space.shape))
moved = [position - start[joint] for joint, position in item.positions().items()]
print(f"{name}: joints moved by at most {np.abs(moved).max():.2g} rad or m in a second")
