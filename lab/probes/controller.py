"""From a policy's actions to the arm's servos, as DROID's controller does it: 15 a second, each a change of the joints
from where they are measured to be."""

import numpy as np

from asset2sim.gym.arm.franka import Arm
from asset2sim.gym.arm.gripper import PANDA
from asset2sim.physics.arrays import Array
from lab.probes.observation import ACTION_WIDTH, CONTROL_HZ, JOINTS, OPEN_LOOP, ActionKind, Chunk
from lab.probes.scene import FLANGE

STEP_RAD = 0.2
"""Most that a joint is told to move in one step of 1/15 s, rad: DROID's ``max_joint_delta``. Its servos do less than
half of that in the time, and so do ours."""
FINGER_M = 0.1 / CONTROL_HZ / 2.0
"""Most that a finger is told to move in one step, m: the Panda's fingers part at 0.1 m/s."""


def carried_out(chunk: Chunk) -> Array:
    """(n, 8) the chunk's actions that are carried out before the policy is asked again. Raises ValueError for actions
    of another shape, or that are no numbers."""
    actions = np.asarray(chunk.actions, dtype=float)
    if actions.ndim != 2 or actions.shape[1] != ACTION_WIDTH or not len(actions):
        raise ValueError(f"a chunk of shape {actions.shape}: (n, {ACTION_WIDTH}) with at least one row is valid")
    if not np.isfinite(actions).all():
        raise ValueError("a chunk has numbers that are not finite")
    return actions[:OPEN_LOOP]


def commands_of(action: Array, kind: ActionKind, measured: Array, fingers: Array, arm: Arm) -> Array:
    """(9,) what the servos are told for one step: joint positions, rad, and fingers, m. ``measured`` are the arm's
    seven joints, ``fingers`` what the two fingers were told before. A velocity that is too fast is scaled down as a
    whole, as DROID does; a position is led to in steps of the same size."""
    if kind == "joint_velocity":
        change = action[:JOINTS] / CONTROL_HZ
        change = change / max(1.0, float(np.abs(change).max()) / STEP_RAD)
    else:
        change = np.clip(action[:JOINTS] + FLANGE - measured, -STEP_RAD, STEP_RAD)
    wanted = (1.0 - float(np.clip(action[JOINTS], 0.0, 1.0))) * PANDA.opening_m / 2.0
    told = fingers + np.clip(wanted - fingers, -FINGER_M, FINGER_M)
    return np.concatenate([np.clip(measured + change, arm.lower, arm.upper), told])


def gripper_of(fingers: Array) -> float:
    """0 open … 1 closed, of two fingers' positions, m."""
    return float(np.clip(1.0 - fingers.sum() / PANDA.opening_m, 0.0, 1.0))
