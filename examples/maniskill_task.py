"""A refined object in a ManiSkill task. ManiSkill's scenes hold SAPIEN scenes, which ``load`` takes: friction, springs
and the initial state are set as in SAPIEN. On the CPU: its GPU scenes take objects through its own builders.

    python examples/maniskill_task.py data/refined/assets/laptop_silver
"""

import sys

import gymnasium
from mani_skill.envs.sapien_env import BaseEnv
from mani_skill.utils.registration import register_env

from asset2sim.load import load


@register_env("RefinedObject-v1", max_episode_steps=200)
class RefinedObject(BaseEnv):
    """An empty task with one refined object on the ground, half a metre in front of the robot."""

    def _load_scene(self, options: dict[str, object]) -> None:
        from mani_skill.utils.building.ground import build_ground

        build_ground(self.scene)
        self.items = [
            load(sys.argv[1], engine="sapien", into=scene, position=(0.5, 0.0)) for scene in self.scene.sub_scenes
        ]

    def _initialize_episode(self, env_idx: object, options: dict[str, object]) -> None:
        for item in self.items:
            initial = {joint.name: joint.initial_position for joint in item.about.joints}
            item.articulation.set_qpos([initial[joint.name] for joint in item.articulation.active_joints])

    def evaluate(self) -> dict[str, object]:
        """Nothing is asked of it."""
        return {}


if __name__ == "__main__":
    env = gymnasium.make("RefinedObject-v1", num_envs=1, sim_backend="cpu", robot_uids="panda")
    env.reset()
    print(env.unwrapped.items[0].positions())
