"""From a tool's way to an arm's: where its base stands, and its joint positions over time."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product

import mujoco
import numpy as np

from asset2sim.gym.arm.franka import HOME, Arm, waiting
from asset2sim.gym.arm.grasps import pull_paths
from asset2sim.gym.arm.paths import ToolPath, push_paths
from asset2sim.gym.arm.scene import CompiledScene, base_at, place_joints, quaternion
from asset2sim.gym.arm.tasks import Task, Verb, target_of
from asset2sim.gym.world import TOOL
from asset2sim.physics.arrays import Array
from schemas.overlay import JointPhysics

AZIMUTHS = tuple(math.radians(angle) for angle in (-60, 60, -30, 30, -90, 90, 0, -120, 120, 180, 150, -150))
"""Where the base may stand about the object, seen from above."""
DISTANCES_M = (0.5, 0.42, 0.6, 0.7)
FROM_ABOVE = -0.9
"""Vertical part of the fingers' direction below which a hand comes from above."""
OFF_M, TILT_RAD, HELD_RAD = 0.004, 0.9, 0.1
"""By how much the tool may miss its way, and point elsewhere where it pushes, and where it holds something."""
OVERLAP_M = 0.004
"""How deep the arm may be in the object along a plan, but for the finger tips where they push."""
SPEED_M_S, PUSH_M_S, TURN_RAD_S = 0.3, 0.1, 1.2
"""Speeds of the tool on its way and while it moves a part, and of the fastest of the arm's joints."""
CHECKED = 0.06
"""By how much a servo may move between two places at which the plan is looked at, rad or m."""
CARRIED = ("lift", "carry", "lower", "release")
"""Phases in which the object is in the hand."""
SETTLE_S, PAUSE_S, GRIP_S, REST_S = 1.0, 0.3, 0.6, 1.5
"""What is recorded before the arm moves, between its phases, while the fingers move, and after it has gone back."""
ABOVE = np.array([0.0, 0.0, 0.12])
"""From how far above the tool comes to its way, and where it leaves it to, m."""
NEAREST_M, FURTHEST_M = 0.25, 0.75
"""Horizontal distance from the base within which the tool's way must be."""
COARSE = 8
"""Points of a way at which it is tried first."""
TRIED = 600
"""Ways and places of the base that are tried at most."""


@dataclass(frozen=True, eq=False)
class ToolPlan:
    """A tool's motion: the (4, 4) ``base``, (n,) ``times_s``, (n, k) ``commands`` to its servos (seven joints,
    rad, and the gripper's) and the ``phases``, one a point; between two points the
    commands change evenly."""

    base: Array
    times_s: Array
    commands: Array
    phases: tuple[str, ...]


def command(plan: ToolPlan, time_s: float) -> Array:
    """(k,) what the tool's servos are told at a time."""
    index = int(np.clip(np.searchsorted(plan.times_s, time_s, side="right"), 1, len(plan.times_s) - 1))
    first, last = plan.times_s[index - 1], plan.times_s[index]
    share = float(np.clip((time_s - first) / max(last - first, 1e-9), 0.0, 1.0))
    found: Array = plan.commands[index - 1] + share * (plan.commands[index] - plan.commands[index - 1])
    return found


def plan_arm(stage: CompiledScene, arm: Arm, joint: str | None, paths: Iterable[ToolPath]) -> ToolPlan | None:
    """The first way that the arm can follow from somewhere about the object without running into it; None for none."""
    tried = 0
    for path in list(paths):  # all of them before the arm comes near: they are found by rays
        tilt_rad = TILT_RAD if path.across is None else HELD_RAD
        for distance, azimuth in product(DISTANCES_M, AZIMUTHS):
            base = base_at(azimuth, distance, stage.about)
            away = np.linalg.norm(path.points[:, :2] - base[:2, 3], axis=1)
            if away.min() < NEAREST_M or away.max() > FURTHEST_M:
                continue
            tried += 1
            if tried > TRIED:
                return None
            chosen = sorted({round(at) for at in np.linspace(0, len(path.points) - 1, COARSE)})
            coarse = joints_along(arm, base, path, chosen, tilt_rad)
            if coarse is None:
                continue
            if path.across is not None and not hand_fits(stage, arm, path, base, coarse[0], tilt_rad):
                if path.axes[0, 2] < FROM_ABOVE:
                    break  # nor does it from anywhere else: hand and forearm are the same
                continue
            found = joints_along(arm, base, path, range(len(path.points)), tilt_rad)
            if found is None:
                continue
            plan = timed_motion(arm, base, path, found)
            if not runs_into(stage, joint, path, plan):
                return plan
    return None


def hand_fits(stage: CompiledScene, arm: Arm, path: ToolPath, base: Array, near: Array, tilt_rad: float) -> bool:
    """Whether hand and open fingers are free of the object where they are about to close."""
    last = max(index for index, phase in enumerate(path.phases) if phase == "approach")
    assert path.across is not None  # only such ways say how the hand is turned
    turn, across = base[:3, :3].T, path.across[last]
    found = arm.reach(turn @ (path.points[last] - base[:3, 3]), turn @ path.axes[last], near, turn @ across)
    move_base(stage, base)
    fingers = arm.gripper.servos(path.opening[last : last + 1])[0]
    place_joints(stage, stage.about.positions_at(), np.concatenate([found.joints, fingers]))
    deep = deepest_overlap(stage, tips=True)
    return found.off_m <= OFF_M and found.tilt_rad <= tilt_rad and deep <= OVERLAP_M


def joints_along(arm: Arm, base: Array, path: ToolPath, chosen: Sequence[int], tilt_rad: float) -> Array | None:
    """(n, 7) joint positions along the chosen points; None where one cannot be reached."""
    turn, origin = base[:3, :3], base[:3, 3]
    across = None if path.across is None else path.across @ turn
    now, found = HOME, []
    # The first solution decides the arm's posture: come to it from above.
    above = turn.T @ (path.points[chosen[0]] + ABOVE - origin)
    now = arm.reach(above, turn.T @ path.axes[chosen[0]], now, None if across is None else across[chosen[0]]).joints
    for index in chosen:
        held = None if across is None else across[index]
        reached = arm.reach(turn.T @ (path.points[index] - origin), turn.T @ path.axes[index], now, held)
        if reached.off_m > OFF_M or reached.tilt_rad > tilt_rad:
            return None
        now = reached.joints
        found.append(now)
    return np.array(found)


def timed_motion(arm: Arm, base: Array, path: ToolPath, joints: Array) -> ToolPlan:
    """The arm's whole motion: wait, come from above, follow the way, go back up, wait."""
    lifted = []
    for index in (0, -1):
        across = None if path.across is None else base[:3, :3].T @ path.across[index]
        point = base[:3, :3].T @ (path.points[index] + ABOVE - base[:3, 3])
        lifted.append(arm.reach(point, base[:3, :3].T @ path.axes[index], joints[index], across).joints)
    whole = np.array([HOME, HOME, lifted[0], *joints, lifted[1], HOME, HOME])
    opening = np.concatenate([np.full(3, path.opening[0]), path.opening, np.full(3, path.opening[-1])])
    tools = np.array([arm.tool(at)[0] for at in whole])
    phases = ("settle", "settle", "approach", *path.phases, "retreat", "retreat", "rest")
    commands = np.concatenate([whole, arm.gripper.servos(opening)], axis=1)
    return ToolPlan(base, times_of(tools, commands, phases), commands, phases)


def times_of(tools: Array, commands: Array, phases: tuple[str, ...]) -> Array:
    """(n,) times of a motion's points, s, from where the (n, 3) tool is and the (n, k) servos are."""
    times = [0.0, SETTLE_S]
    for index in range(2, len(tools)):
        moved = float(np.linalg.norm(tools[index] - tools[index - 1]))
        turned = float(np.abs(commands[index, :7] - commands[index - 1, :7]).max())
        speed = SPEED_M_S if phases[index] in ("approach", "retreat", "carry") else PUSH_M_S
        took = max(moved / speed, turned / TURN_RAD_S, 0.01)
        took += PAUSE_S if phases[index] != phases[index - 1] else 0.0
        took += GRIP_S if np.abs(commands[index, 7:] - commands[index - 1, 7:]).max(initial=0.0) > 1e-6 else 0.0
        times.append(times[-1] + (REST_S if phases[index] == "rest" else took))
    return np.array(times)


def runs_into(stage: CompiledScene, joint: str | None, path: ToolPath, plan: ToolPlan) -> bool:
    """Whether the arm would be in the object or the floor somewhere along a plan; of the finger tips while they push or
    hold, that is meant. What is carried is not looked at."""
    if (plan.base != stage.base).any():
        move_base(stage, plan.base)
    start = stage.about.positions_at().get(joint or "", 0.0)
    first = len(plan.commands) - len(path.points) - 3
    whole = np.concatenate([np.full(first, start), path.positions, np.full(3, path.positions[-1])])
    try:
        for index in range(2, len(plan.commands)):
            if plan.phases[index] in CARRIED:
                continue
            meant = plan.phases[index] not in ("approach", "retreat", "rest")
            turned = float(np.abs(plan.commands[index] - plan.commands[index - 1]).max())
            for share in np.linspace(1.0, 0.0, max(1, math.ceil(turned / CHECKED)), endpoint=False):
                at = plan.commands[index - 1] + share * (plan.commands[index] - plan.commands[index - 1])
                if path.across is not None:  # what the fingers hold keeps them apart
                    at[7:] = plan.commands[0, 7:]
                position = whole[index - 1] + share * (whole[index] - whole[index - 1])
                place_joints(stage, {joint: float(position)} if joint else {}, at)
                if deepest_overlap(stage, tips=not meant) > OVERLAP_M:
                    return True
        return False
    finally:
        place_joints(stage, stage.about.positions_at(), plan.commands[0])


def deepest_overlap(stage: CompiledScene, *, tips: bool) -> float:
    """How deep the arm is in anything else, m; its finger tips count only if asked."""
    contact, ours = stage.data.contact, stage.tool_geoms
    if not len(contact.dist):
        return 0.0
    first, second = contact.geom[:, 0], contact.geom[:, 1]
    touched = ours[first] | ours[second]
    if not tips:
        touched &= ~(stage.tip_geoms[first] | stage.tip_geoms[second])
    return float(max(0.0, -contact.dist[touched].min(initial=0.0)))


def move_base(stage: CompiledScene, base: Array) -> None:
    """Put the arm's base elsewhere."""
    root = int(stage.model.body(f"{TOOL}panda_link0").id)
    stage.model.body_pos[root], stage.model.body_quat[root] = base[:3, 3], quaternion(base)
    stage.base[:] = base
    mujoco.mj_kinematics(stage.model, stage.data)


def moving_plan(stage: CompiledScene, arm: Arm, task: Task, joint: JointPhysics) -> ToolPlan | None:
    """The arm's motion for a task that moves a joint, in a world in which the arm is anywhere; None for none."""
    place_joints(stage, stage.about.positions_at(), waiting(arm.gripper))
    mujoco.mj_forward(stage.model, stage.data)
    target, plan = target_of(task, joint), None
    if task.verb is Verb.OPEN:
        plan = plan_arm(stage, arm, joint.name, pull_paths(stage, joint, target))
    return plan or plan_arm(stage, arm, joint.name, push_paths(stage, joint, target, task.verb))
