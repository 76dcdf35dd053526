"""A Gymnasium environment for any refined object: importing this registers ``Asset2Sim-v0``."""

from asset2sim.gym.environment import ENVIRONMENT, ObjectEnv, make_env
from asset2sim.gym.scripted import replay

__all__ = ["ENVIRONMENT", "ObjectEnv", "make_env", "replay"]
