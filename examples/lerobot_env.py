"""A pack for LeRobot's EnvHub (``asset2sim pack OUT --for lerobot --out PACK``, then ``hf upload USER/NAME PACK``):
LeRobot downloads the environment, makes two copies, resets and steps them.

    python examples/lerobot_env.py USER/NAME
"""

import sys

import numpy as np
from lerobot.envs import make_env

(suite,) = make_env(sys.argv[1], n_envs=2, trust_remote_code=True).values()
env = suite[0]
seen, _ = env.reset(seed=[0, 1])
for _ in range(10):
    seen, reward, *_ = env.step(env.action_space.sample())
print(f"{env.num_envs} copies of {env.action_space.shape[1]} actions, ten steps: reward {np.mean(reward):.3g}")
env.close()
