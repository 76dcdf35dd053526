"""The paper's reward and its success S, on arrays of environments: NumPy alone."""

from dataclasses import dataclass

import numpy as np

from asset2sim.physics.arrays import Array
from schemas.learning_settings import RewardSettings

DOWN = np.array([0.0, 0.0, -1.0])
TERMS = ("reach", "reach_xy", "joint", "opening", "tilt", "off_xy", "gate")
"""The terms, and the gate, as ``info`` names them."""


@dataclass(frozen=True, eq=False)
class Terms:
    """(n,) terms of the reward, weights included, penalties negative, and the (n,) ``gate`` (0 or 1) that ``joint`` has
    been multiplied with. The reward of a step is ``dt_s`` times the sum of the six."""

    reach: Array
    reach_xy: Array
    joint: Array
    opening: Array
    tilt: Array
    off_xy: Array
    gate: Array
    dt_s: float

    @property
    def reward(self) -> Array:
        """(n,) reward of the step."""
        whole: Array = self.dt_s * (self.reach + self.reach_xy + self.joint + self.opening + self.tilt + self.off_xy)
        return whole


def reward_terms(
    to_part: Array, x: Array, target: Array, opening: Array, tool_axis: Array, dt_s: float, settings: RewardSettings
) -> Terms:
    """The terms of one step of n environments: ``to_part`` (n, 3) from tool to part, m, world; ``x`` and ``target``
    (n, k) joint positions as shares of their limits; ``opening`` (n,) of the gripper, 0 to 1; ``tool_axis`` (n, 3) unit
    vectors to which the fingers point, world; ``dt_s`` the time of the step, s."""
    away, flat = np.linalg.norm(to_part, axis=-1), np.linalg.norm(to_part[..., :2], axis=-1)
    gate = (away < settings.gate_m).astype(float)
    error = np.abs(x - target).sum(axis=-1)
    return Terms(
        reach=settings.reach_weight * (1.0 - np.tanh(away / settings.reach_m)),
        reach_xy=settings.reach_xy_weight * (1.0 - np.tanh(flat / settings.reach_xy_m)),
        joint=gate * settings.joint_weight * np.exp(-settings.joint_decay * error),
        opening=-settings.opening_weight * opening,
        tilt=-settings.tilt_weight * (1.0 - tool_axis @ DOWN),
        off_xy=-settings.off_xy_weight * flat,
        gate=gate,
        dt_s=dt_s,
    )


def success(x: Array, start: Array, target: Array, settings: RewardSettings) -> Array:
    """(n,) S, 0 to 1: the share of the way from ``start`` to ``target`` that is done; all (n, k), shares of the limits.
    A way shorter than ε counts as ε."""
    way = np.maximum(np.abs(start - target).sum(axis=-1), settings.least_way)
    done: Array = np.clip(1.0 - np.abs(x - target).sum(axis=-1) / way, 0.0, 1.0)
    return done
