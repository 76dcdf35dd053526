"""From a policy's actions to the arm's servos, as DROID's controller does it: 15 a second, each a change of the joints
from where they are measured to be."""

import numpy as np

from asset2sim.gym.arm.franka import Arm
from asset2sim.gym.arm.gripper import Gripper
from asset2sim.physics.arrays import Array
from lab.probes.observation import ACTION_WIDTH, CONTROL_HZ, JOINTS, OPEN_LOOP, ActionKind, Chunk
from lab.probes.scene import FLANGE

STEP_RAD = 0.2
"""Most that a joint is told to move in one step of 1/15 s, rad: DROID's ``max_joint_delta``. Its servos do less than
half of that in the time, and so do ours."""
OPENING_M = 0.05 / CONTROL_HZ
"""Most that the gripper is told to open or close in one step, m: DROID's moves at 0.05 m/s."""


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
    """(k,) what the servos are told for one step: joint positions, rad, and the gripper. ``measured`` are the arm's
    seven joints, ``fingers`` what the gripper was told before. A velocity that is too fast is scaled down as a whole,
    as DROID does; a position is told as it is."""
    if kind == "joint_velocity":
        change = action[:JOINTS] / CONTROL_HZ
        to = measured + change / max(1.0, float(np.abs(change).max()) / STEP_RAD)
    else:
        to = action[:JOINTS] + FLANGE
    gripper = arm.gripper
    wanted = (1.0 - float(np.clip(action[JOINTS], 0.0, 1.0))) * gripper.opening_m
    before = gripper.opening_of(fingers)
    told = gripper.servos(np.array([before + np.clip(wanted - before, -OPENING_M, OPENING_M)]))[0]
    return np.concatenate([np.clip(to, arm.lower, arm.upper), told])


def closed_share(gripper: Gripper, joints: Array) -> float:
    """0 open … 1 closed, of the positions of the gripper's joints, m or rad."""
    return float(np.clip(1.0 - gripper.opened(joints) / gripper.opening_m, 0.0, 1.0))
