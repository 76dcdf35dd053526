"""How fast robosuite's own door task is: run by an interpreter that has robosuite, SECONDS [GRIPPER]; prints JSON."""

import importlib
import json
import sys
import time

import numpy as np


def main(seconds: float, gripper: str) -> None:
    """Random actions for so many seconds of processor time, as robosuite sets its task up, without pictures."""
    robosuite = importlib.import_module("robosuite")
    options = {"has_renderer": False, "has_offscreen_renderer": False, "use_camera_obs": False, "reward_shaping": True}
    env = robosuite.make("Door", robots="Panda", gripper_types=gripper, control_freq=20, horizon=10**9, **options)
    env.reset()
    low, high = env.action_spec
    random = np.random.default_rng(0)
    for _ in range(20):  # numba compiles
        env.step(random.uniform(low, high))
    began, actions = time.process_time(), 0
    while time.process_time() - began < seconds:
        env.step(random.uniform(low, high))
        actions += 1
    took = time.process_time() - began
    sys.stdout.write(
        json.dumps({"rate": actions / took, "action_s": env.control_timestep, "timestep_s": env.model_timestep}) + "\n"
    )


if __name__ == "__main__":
    main(float(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else "default")
